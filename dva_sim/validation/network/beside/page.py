"""Measured rows of middleware beside the predictions, in words, tables and figures."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Final

from dva_sim.experiments.report.figures.palette import FAINT, SOFT
from dva_sim.experiments.report.figures.style import Drawn, log_axis, panels, styled
from dva_sim.simulation.measures.middleware import RUN_COLUMNS
from dva_sim.validation.frame import ResultSheet, Row, ValidationResult, captioned
from dva_sim.validation.frame import short_number as number
from dva_sim.validation.network.beside.measured import MIN_INSIDE, Beside, BesideRow
from dva_sim.validation.network.beside.predictions import ALLOWANCES, rows_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

NAME: Final = "beside"
MEANINGS: Final = {column.name: column.meaning for column in RUN_COLUMNS}
DRAWN: Final = ("age_in_force_p95_s", "longest_gap_s")
_GOOD = "#0072B2"
_BAD = "#D55E00"
_PALE = "#9a9a9a"
_COLUMNS = 3  # panels side by side
_LEAST_S = 0.01  # where logarithmic axes begin [s]


def evidence(beside: Beside, conditions: Mapping[str, str]) -> ValidationResult:
    """Result of all rows.

    Args:
        conditions: Conditions of the comparison, by name.
    """
    summary = ResultSheet(
        "Rows inside their bands",
        ("measure", "inside", "judged", "verdict"),
        summary_of(beside),
        words=frozenset({0, 3}),
    )
    reasons = ResultSheet("Without a verdict", ("why", "rows"), reasons_of(beside), wraps=True)
    misses = _sheet("Outside their bands", beside.with_word("outside"), with_measure=True)
    by_measure = [
        _sheet(f"{measure}: {MEANINGS[measure]}", [r for r in beside.rows if r.measure == measure])
        for measure in ALLOWANCES
    ]
    tables = {NAME: [row_of(row) for row in beside.rows]}
    if played := rows_of(beside.played):
        tables["predictions"] = played
    is_measured = any(row.word == "inside" or row.word == "outside" for row in beside.rows)
    shown = [summary, misses] if is_measured else by_measure[:1]
    return ValidationResult(
        name=NAME,
        headline=headline(beside),
        passes=beside.passes,
        notes=notes(beside),
        conditions=conditions,
        sheets=[sheet for sheet in (summary, reasons, misses, *by_measure) if sheet.rows],
        printed=[sheet for sheet in (*shown, reasons) if sheet.rows],
        draw=partial(draw_all, beside),
        tables=tables,
    )


def headline(beside: Beside) -> str:
    """Headline of the result."""
    inside, judged = beside.share
    if not judged:
        return f"{len(beside.with_word('predicted'))} rows are predicted; nothing is judged."
    verdict = "passes" if beside.passes else "fails"
    return (
        f"{inside} of {judged} rows ({100 * inside / judged:.1f} %) lie inside their bands; "
        f"{100 * MIN_INSIDE:.0f} % are asked for. The model {verdict}."
    )


def notes(beside: Beside) -> list[str]:
    """Notes on the origin of the bands."""
    reports = []
    if beside.kept:
        reports.append(
            f"The bands of {beside.kept} configurations were kept before their rows were measured."
        )
    if now := len(rows_of(beside.played)):
        reports.append(f"{now} configurations were played now, by the model as it is.")
    return reports


def summary_of(beside: Beside) -> list[tuple[str, str, str, str]]:
    """Number of rows inside, by measure."""
    lines = []
    for measure in ALLOWANCES:
        words = [row.word for row in beside.rows if row.measure == measure]
        inside = words.count("inside")
        judged = words.count("inside") + words.count("outside")
        if judged:
            verdict = "all inside" if inside == judged else f"{judged - inside} outside"
            lines.append((measure, str(inside), str(judged), verdict))
    return lines


def reasons_of(beside: Beside) -> list[tuple[str, str]]:
    """Reasons why rows have no verdict, with counts."""
    count: dict[str, int] = {}
    for row in beside.with_word("not predicted", "not judged"):
        count[row.why] = count.get(row.why, 0) + 1
    return [(why, str(rows)) for why, rows in count.items()]


def _sheet(title: str, rows: Sequence[BesideRow], with_measure: bool = False) -> ResultSheet:
    factors = list(rows[0].levels) if rows else []
    heads = (*factors, *(("measure",) if with_measure else ()))
    own = ("measured", "least", "most", "predicted", "from", "to", "verdict")
    lines = [
        (*row.levels.values(), *((row.measure,) if with_measure else ()), *_numbers(row))
        for row in rows
    ]
    words = frozenset({*range(len(heads)), len(heads) + len(own) - 1})
    return ResultSheet(title, (*heads, *own), lines, words=words)


def _numbers(row: BesideRow) -> tuple[str, ...]:
    values = row.values
    band = row.band
    measured = (row.median, min(values), max(values)) if len(values) else (math.nan,) * 3
    shown = (*measured, *((band.predicted, band.low, band.high) if band else (math.nan,) * 3))
    return (*map(number, shown), row.word if not row.why else f"{row.word}: {row.why}")


def row_of(row: BesideRow) -> Row:
    """A row of the table that is written."""
    values = row.values
    band = row.band
    return {
        **row.levels,
        "measure": row.measure,
        "runs": len(values),
        "measured": row.median if len(values) else None,
        "least": min(values, default=None),
        "most": max(values, default=None),
        "predicted": band.predicted if band else None,
        "low": band.low if band else None,
        "high": band.high if band else None,
        "verdict": row.word,
        "why": row.why,
    }


def draw_all(beside: Beside) -> list[Drawn]:
    """A figure of each drawn measure."""
    with styled():
        return [_draw(beside, measure) for measure in DRAWN]


def _draw(beside: Beside, measure: str) -> Drawn:
    """A panel for each level of the last factor, a line for each level of the others."""
    by_panel: dict[str, list[tuple[str, BesideRow]]] = {}
    for row in beside.rows:
        if row.measure == measure:
            *line, panel = row.levels.values() or ("",)
            by_panel.setdefault(panel, []).append((" ".join(line), row))
    most = max(len(lines) for lines in by_panel.values())
    columns = min(_COLUMNS, len(by_panel))
    figure, axes = panels(
        -(-len(by_panel) // columns), columns, 0.8 + 0.19 * most, sharex=True, sharey=True
    )
    every = [ax for row in axes for ax in row]
    for ax, (panel, lines) in zip(every, by_panel.items(), strict=False):
        for place, (_, row) in enumerate(lines):
            _mark(ax, place, row)
        ax.set_title(panel)
        ax.set_yticks(range(len(lines)), [name for name, _ in lines])
        ax.grid(visible=False, axis="y")
    for ax in every[len(by_panel) :]:
        ax.set_visible(False)
    every[0].invert_yaxis()
    log_axis(every[0], "x")
    for ax in axes[-1]:
        ax.set_xlabel("[s]")
    return captioned(figure, f"{NAME}-{measure}")


def _mark(axes: Axes, place: int, row: BesideRow) -> None:
    """The band as a bar, the runs as a thin line, their median as a mark."""
    if row.band is not None:
        low = max(row.band.low, _LEAST_S)
        high = max(row.band.high, _LEAST_S)
        axes.barh(place, high - low, left=low, height=0.7, color=FAINT)
        axes.plot([row.band.predicted] * 2, [place - 0.35, place + 0.35], color=SOFT, lw=0.8)
    if len(row.values):
        colour = {"inside": _GOOD, "outside": _BAD}.get(row.word, _PALE)
        axes.plot([min(row.values), max(row.values)], [place] * 2, color=colour, lw=0.8)
        axes.plot(row.median, place, "o", color=colour, ms=3.5, mew=0)
