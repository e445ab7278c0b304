"""The few runs that weigh much: they count with the whole horizon, so the median stands beside."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from dva_sim.experiments.analysis.answer import Finding
from dva_sim.experiments.analysis.run_grid import Floats
from dva_sim.experiments.analysis.study_view import StudyView
from dva_sim.kernel.wording import number, quantity
from dva_sim.simulation.labels import level_name
from dva_sim.statistics import quantile_interval


def few_that_weigh(finding: Finding, view: StudyView) -> str:
    """Warn where runs that count with the whole horizon dominate the mean; give the median."""
    if finding.horizon is None or not view.part.has("confirmed"):
        return ""
    clauses = [_weight(finding, view, stop) for stop in range(len(view.stops))]
    if not any(clauses):
        return ""
    return (
        f"Where some runs count with {quantity(finding.horizon, 's')}, the mean hangs on them and "
        f"the median of the differences tells more: {'; '.join(filter(None, clauses))}."
    )


def _weight(finding: Finding, view: StudyView, stop: int) -> str:
    """`at 20 s 2 of 48 runs, median 4.0 s (3.1 to 4.9 s)`; empty where none or all count so."""
    grid, panel = view.part.grid("confirmed"), view.panels[0]
    sides = [view.curve(grid, panel, side)[stop] for side in (finding.first, finding.second)]
    runs = sum(int(np.isfinite(side).sum()) for side in sides)
    missed = sum(int((side < 1).sum()) for side in sides)
    if not 0 < missed < runs / 4:
        return ""
    found = quantile_interval(*_differences(finding, view, stop))
    ends = f" ({number(found.low)} to {quantity(found.high, finding.unit)})"
    where = f"at {level_name(finding.over, view.stops[stop])} " if view.over else ""
    return (
        f"{where}{missed} of {runs} runs, median {quantity(found.mean, finding.unit)}"
        f"{ends if np.isfinite(found.low) else ''}"
    )


def _differences(finding: Finding, view: StudyView, stop: int) -> tuple[Floats, NDArray[Any]]:
    """First minus second, run by run, and whose they are."""
    values, panel = view.values, view.panels[0]
    first, second = (
        view.curve(values, panel, side)[stop] for side in (finding.first, finding.second)
    )
    person = np.repeat(view.part.persons, len(view.part.trials))
    return (first - second).ravel(), person
