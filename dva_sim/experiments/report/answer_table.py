"""The answer level by level in numbers: sides, difference, and spread between persons."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from dva_sim.experiments.analysis.run_grid import Floats, nan_mean, person_means
from dva_sim.experiments.analysis.study_view import StudyView
from dva_sim.experiments.report.cell_table import CellTable
from dva_sim.experiments.report.prose import note
from dva_sim.kernel.units import unit_of
from dva_sim.kernel.wording import as_number, number, percent
from dva_sim.simulation.labels import factor_name, level_name
from dva_sim.statistics import Components, components

if TYPE_CHECKING:
    from dva_sim.experiments.report.summary import Reading


def answer_table(reading: Reading) -> CellTable | None:
    """Return a row for each level that the answer runs over; None where it has no contrast."""
    view = reading.view
    finding = reading.worded_finding
    if view is None or finding is None or not finding.over:
        return None
    first, second = (_means(view, level) for level in (finding.first, finding.second))
    differences = [
        f"{number(mean)} ({number(low)} to {number(high)})" if np.isfinite(low) else number(mean)
        for mean, low, high in zip(finding.mean, finding.low, finding.high, strict=True)
    ]
    rows = [
        [level_name(finding.over, level), number(a), number(b), difference]
        for level, a, b, difference in zip(finding.levels, first, second, differences, strict=True)
    ]
    unit = f" [{finding.unit}]" if finding.unit else ""
    sides = [f"{level_name(finding.factor, x)}{unit}" for x in (finding.first, finding.second)]
    heads = [factor_name(finding.over), *sides, f"difference (95 % band){unit}"]
    return CellTable(finding.part, heads, 1, rows, note=_why_no_sum(view, first - second, rows))


def _why_no_sum(view: StudyView, plain: Floats, rows: Sequence[Sequence[str]]) -> str:
    """Explain why a printed difference is not that of the two means beside it; empty if all are.

    Args:
        view: The study.
        plain: Difference of the two means, at each stop.
        rows: The table as it is printed.
    """
    printed = [[as_number(text.partition(" (")[0]) for text in row[1:]] for row in rows]
    if all(np.isclose(a - b, difference) for a, b, difference in printed if np.isfinite(a - b)):
        return ""
    is_rounded = all(
        row[-1].partition(" (")[0] == number(x) for row, x in zip(rows, plain, strict=True)
    )
    return note("differences", is_rounded=is_rounded, is_adjusted=bool(view.covariates))


def _means(view: StudyView, level: object) -> Floats:
    """Return means over persons, at each stop."""
    curve = view.curve(view.values, view.panels[0], level)  # type: ignore[arg-type]
    return nan_mean(person_means(curve), axis=0)


_MIN_PERSONS = 2


def spread_table(view: StudyView) -> CellTable | None:
    """Spread between and within persons, in the panel that the answer speaks of."""
    if view.contrast is None or view.series_factor is None or len(view.part.trials) < _MIN_PERSONS:
        return None
    panel = view.panels[0]
    values = view.values
    first, second = (view.curve(values, panel, level) for level in view.contrast)
    names = [level_name(view.series_factor.name, level) for level in view.contrast]
    kinds = [(names[0], first), (names[1], second), (f"{names[0]} − {names[1]}", first - second)]
    rows = [
        [
            level_name(view.over.name, view.stops[stop]) if view.over else "",
            name,
            *_printed(components(curve[stop])),
        ]
        for stop in range(len(view.stops))
        for name, curve in kinds
    ]
    unit = f" [{unit_of(view.measure)}]" if unit_of(view.measure) else ""
    over = factor_name(view.over.name) if view.over else ""
    heads = [over, "of", f"between persons{unit}", f"within a person{unit}", "share between"]
    return CellTable(view.part.name, heads, 2, rows)


def _printed(parts: Components) -> list[str]:
    """Return standard deviations in the measure's unit, and the share between persons."""
    deviations: Floats = np.sqrt([parts.between, parts.within])
    return [*(number(float(x)) for x in deviations), percent(parts.share)]
