"""The answer level by level: both sides and their difference, in numbers."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dva_sim.experiments.analysis.run_grid import Floats, nan_mean, person_means
from dva_sim.experiments.analysis.study_view import StudyView
from dva_sim.experiments.report.cell_table import CellTable
from dva_sim.kernel.wording import number
from dva_sim.simulation.labels import factor_name, level_name

if TYPE_CHECKING:
    from dva_sim.experiments.analysis.answer import Finding
    from dva_sim.experiments.report.summary import Reading


def answer_table(reading: Reading) -> CellTable | None:
    """A row for each level that the answer runs over; None where it has no contrast."""
    view, finding = reading.view, reading.worded_finding
    if view is None or finding is None or not finding.over:
        return None
    first, second = (_means(view, level) for level in (finding.first, finding.second))
    rows = [
        [level_name(finding.over, level), number(a), number(b), difference]
        for level, a, b, difference in zip(
            finding.levels, first, second, _differences(finding), strict=True
        )
    ]
    unit = f" [{finding.unit}]" if finding.unit else ""
    sides = [f"{level_name(finding.factor, x)}{unit}" for x in (finding.first, finding.second)]
    heads = [factor_name(finding.over), *sides, f"difference (95 % band){unit}"]
    return CellTable(finding.part, heads, 1, rows)


def _means(view: StudyView, level: object) -> Floats:
    """Over persons, at each stop."""
    curve = view.curve(view.values, view.panels[0], level)  # type: ignore[arg-type]
    return nan_mean(person_means(curve), axis=0)


def _differences(finding: Finding) -> list[str]:
    """`7.6 (2.1 to 13.1)`."""
    return [
        f"{number(mean)} ({number(low)} to {number(high)})" if np.isfinite(low) else number(mean)
        for mean, low, high in zip(finding.mean, finding.low, finding.high, strict=True)
    ]
