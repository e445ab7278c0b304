"""The table of every cell: nothing that was run is left out of the report."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from dva_sim.experiments.analysis.robustness import Support
from dva_sim.experiments.analysis.run_grid import Floats, RunGrid, plain_level, present
from dva_sim.experiments.report.prose import note, sentence
from dva_sim.experiments.study.tuning import TunedValues, TuningBasis
from dva_sim.kernel.config import validate
from dva_sim.kernel.units import unit_of
from dva_sim.kernel.wording import number, percent
from dva_sim.simulation.labels import factor_name, level_name, measure_name, setting, with_unit
from dva_sim.statistics import mean_interval


@dataclass(frozen=True)
class CellTable:
    """A table ready to print.

    Attributes:
        part: Part of the study.
        heads: Column heads.
        labels: Number of leading columns that name the cell.
        rows: Printed values.
        empty: Number of cells without a run.
        note: Meaning of a mark in the table.
    """

    part: str
    heads: list[str]
    labels: int
    rows: list[list[str]]
    empty: int = 0
    note: str = ""


def _hundredths(share: float) -> str:
    """Return a share in percent, whose sign stands in the head."""
    return percent(share).removesuffix("\N{NO-BREAK SPACE}%")


# column of the runs, head, how the runs of a cell become one number, how it is printed
_Summarise = Callable[[Floats], Any]
Summary = tuple[str, str, _Summarise, Callable[[float], str]]
SUMMARIES: tuple[Summary, ...] = (
    ("age_in_force_mean_s", "age of the command in force [s]", np.mean, number),
    ("command_rate_hz", "applied commands [Hz]", np.mean, number),
    ("stop_share", "in safe stop [%]", np.mean, _hundredths),
    ("contacts", "contacts per run", np.mean, number),
    ("completed_share", "completed", np.mean, percent),
    ("error_share", "errors", np.mean, percent),
    ("throughput_bps", "throughput [bit/s]", np.mean, number),
    ("delay_felt_s", "delay felt [s]", np.mean, number),
    ("plugin_failures", "failures of own classes", np.sum, number),
    ("violations", "violations", np.sum, number),
)


def cell_table(
    part: RunGrid,
    measure: str,
    summaries: Sequence[Summary] = SUMMARIES,
    support: Support | None = None,
    possible: tuple[float, float] = (-np.inf, np.inf),
    is_listed: bool = False,
    points: Sequence[str] = (),
) -> CellTable:
    """Return every cell of a part.

    Size, confirmed share, the measure with its interval, and the rest.

    Args:
        part: The runs.
        measure: Column that is shown with its interval.
        summaries: Further columns.
        support: Coverage by published data, which marks extrapolations.
        possible: Least and greatest value of the measure.
        is_listed: True if the design lists its cells, so that those without a run do not exist.
        points: Factors other than axes, whose values are shown for each cell.
    """
    settings = list(part.settings())
    columns: list[_Column | None] = [_value(part, name) for name in points]
    columns += [
        ("runs", [str(len(values)) for values in _cells(part, "seed")]),
        *_endings(part),
        *_measure(part, measure, possible),
    ]
    columns += [
        (head, [_text(summary, cell, text) for cell in _cells(part, column)])
        for column, head, summary, text in summaries
        if column != measure and part.has(column)
    ]
    columns.append(_beyond(support))
    filled = [c for c in columns if c is not None]
    names = [factor_name(f.name) for f in part.factors]
    rows = [
        [
            *(level_name(factor, level) for factor, level in setting.items()),
            *(values[i] for _, values in filled),
        ]
        for i, setting in enumerate(settings)
    ]
    ran = [bool(filled) for filled in part.ran.ravel()]
    if is_listed:
        rows = [row for row, filled in zip(rows, ran, strict=True) if filled]
    empty = 0 if is_listed else ran.count(False)
    heads = [*names, *(head for head, _ in filled)]
    whole = CellTable(part.name, heads, len(names) + len(points), rows, empty)
    same = [f"{whole.heads[n]} {whole.rows[0][n]}" for n in _constant(whole)]
    notes = f"The same in all configurations: {', '.join(same)}." if same else ""
    notes = " ".join(filter(None, (notes, _what_is_covered(support))))
    return replace(_without_constants(whole), note=notes)


def _constant(table: CellTable) -> list[int]:
    """Return the columns with equal values in all rows; none for a single row."""
    columns = range(table.labels, len(table.heads))
    if len(table.rows) < _MIN_ROWS:
        return []
    return [n for n in columns if len({row[n] for row in table.rows}) == 1]


def _without_constants(table: CellTable) -> CellTable:
    """Return the table without the columns that do not vary."""
    columns = [n for n in range(len(table.heads)) if n not in _constant(table)]
    heads = [table.heads[n] for n in columns]
    rows = [[row[n] for n in columns] for row in table.rows]
    return replace(table, heads=heads, rows=rows)


_Column = tuple[str, list[str]]
_MIN_ROWS = 3  # with fewer, a column that does not vary says little
_MARK = "\N{NO-BREAK SPACE}†"


def _cells(part: RunGrid, column: str) -> list[Floats]:
    """Return the finite values of every cell, in the order of `RunGrid.settings`."""
    return [present(cell) for cell in _by_cell(part, part.grid(column))]


def _by_cell(part: RunGrid, grid: Floats) -> Floats:
    return grid.reshape(-1, len(part.persons), len(part.trials))


def _value(part: RunGrid, name: str) -> _Column:
    """Return values of a factor outside the grid, one for each cell."""
    values = [plain_level(value) for value in part.first_of_cells(name)]
    return with_unit(name), [f"{v:.3g}" if isinstance(v, float) else str(v) for v in values]


_ENDINGS = {
    "refuted": "refuted",
    "lost link": "link lost",
    "gave up": "given up",
    "refused": "obeyed no more",
    "escalated": "escalated",
    "expired": "expired",
    "undetected": "never reported",
    "timeout": "nothing by the end",
    "no drive": "no drive",
}


def _endings(part: RunGrid) -> Iterator[_Column]:
    """Yield the share confirmed, and the endings of the last drives to other events."""
    if not part.has("confirmed"):
        return
    grid = part.grid("confirmed")
    yield (
        "first event confirmed",
        [_text(np.mean, present(cell), percent) for cell in _by_cell(part, grid)],
    )
    how = part.treated.get("outcome", np.array([]))
    for outcome, head in _ENDINGS.items():
        if np.any(how == outcome):
            share = np.where(
                np.isfinite(grid), part.laid_out((how == outcome).astype(float)), np.nan
            )
            yield head, [_text(np.mean, present(cell), percent) for cell in _by_cell(part, share)]


def _measure(part: RunGrid, measure: str, possible: tuple[float, float]) -> list[_Column]:
    """Return median and mean with its 95 % interval, in excess of the reference if there is one.

    An interval ends where no value is possible.
    """
    if not part.has(measure):
        return []
    excess = part.has_reference(measure)
    grid = _by_cell(part, part.outcome(measure))
    medians = [_text(np.median, present(cell), number) for cell in grid]
    intervals = [mean_interval(cell.ravel(), part.person) for cell in grid]
    widest = possible[1] - possible[0]
    least, most = (-widest, widest) if excess else possible
    means = [
        f"{number(i.mean)} ({number(max(i.low, least))} to {number(min(i.high, most))})"
        for i in intervals
    ]
    name = "excess time" if excess and unit_of(measure) == "s" else measure_name(measure)
    unit = f" [{unit_of(measure)}]" if unit_of(measure) else ""
    return [(f"{name}, median{unit}", medians), (f"its mean (95 % interval){unit}", means)]


def _beyond(support: Support | None) -> _Column | None:
    """Return the delay that people would have been watched at, marked where nobody was."""
    if support is None:
        return None
    pairs = zip(support.delays.ravel(), support.outside.ravel(), strict=True)
    marked = [number(delay) + (_MARK if outside else "") for delay, outside in pairs]
    return "picture to effect, without the person [s]", marked


def _what_is_covered(support: Support | None) -> str:
    if support is None:
        return ""
    facts = {"mark": _MARK.strip(), "covered": support.words}
    return note("extrapolated", **facts, is_outside=bool(support.outside.any()))


def _text(summary: _Summarise, cell: Floats, text: Callable[[float], str]) -> str:
    """Return the runs of a cell as one printed number; a dash where there are none."""
    return text(float(summary(cell))) if len(cell) else "–"


def tuned_table(manifest: Mapping[str, Any]) -> CellTable | None:
    """Return the table of everything that a tuning tried; None where nothing was tuned."""
    if not manifest.get("tuned"):
        return None
    tuned = validate(TunedValues, manifest["tuned"])
    rule = tuned.tuning
    chosen = {(str(c.when), c.value) for c in tuned.chosen}
    rows = [
        [
            *(level_name(name, level) for name, level in trial.when.items()),
            f"{trial.value:g}",
            f"{number(trial.mean)} ({number(trial.low)} to {number(trial.high)})",
            "chosen" if (str(trial.when), trial.value) in chosen else "",
        ]
        for trial in tuned.seen
    ]
    heads = [*(factor_name(name) for name in rule.by), factor_name(rule.key)]
    heads += [f"{measure_name(rule.measure)}, mean (95 % interval)", ""]
    is_other = str(manifest["versions"].get("fingerprint")) not in tuned.made_with
    text = note("tuning", rule=rule, at=setting(rule.at), is_other_version=is_other)
    return CellTable(rule.part, heads, len(rule.by), rows, note=text)


def tuning_warning(manifest: Mapping[str, Any]) -> str:
    """Warn that values were tuned with other persons or phones than the study's."""
    if not manifest.get("tuned"):
        return ""
    tuned = validate(TunedValues, manifest["tuned"])
    others = tuned.basis.unlike(validate(TuningBasis, manifest["basis"]))
    if not others:
        return ""
    factor = factor_name(tuned.tuning.key)
    return sentence("tuned_otherwise", factor=factor, others=others, study=tuned.study)
