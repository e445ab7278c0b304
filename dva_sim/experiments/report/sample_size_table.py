"""How many persons it takes, and which few runs weigh much, as a report says it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dva_sim.experiments.analysis.answer import Finding
from dva_sim.experiments.analysis.run_grid import Floats
from dva_sim.experiments.analysis.sample_size import MOST_PERSONS, POWERS, Count, SizePlan
from dva_sim.experiments.analysis.study_view import StudyView
from dva_sim.experiments.report.cell_table import CellTable
from dva_sim.kernel.wording import number, quantity
from dva_sim.simulation.labels import level_name
from dva_sim.statistics import quantile_interval


def few_that_weigh(finding: Finding, view: StudyView) -> str:
    """Where runs that count with the whole horizon pull at the mean, and what the median is."""
    if finding.horizon is None or not view.part.has("confirmed"):
        return ""
    told = [_weight(finding, view, stop) for stop in range(len(view.stops))]
    if not any(told):
        return ""
    return (
        f"Where some runs count with {quantity(finding.horizon, 's')}, the mean hangs on them and "
        f"the median of the differences tells more: {'; '.join(filter(None, told))}."
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


def plan_table(found: Sequence[SizePlan], cluster: str) -> CellTable:
    """A line for each plan."""
    heads = ["to show", "if the true difference is"]
    heads += [f"{cluster}s for {100 * p:.0f} % power" for p in POWERS]
    rows = [
        [f"{p.name}: {p.what}", p.assumed, *(map(_told, p.counts) if p.counts else _NEVER)]
        for p in found
    ]
    return CellTable("", heads, len(heads), rows, note=_assumes(found, cluster))


def plan_lines(found: Sequence[SizePlan], cluster: str) -> list[str]:
    """A line for each plan, and what they assume."""
    lines = [
        f"To show {p.name} ({p.what}), if the true difference is {p.assumed}: {_line(p, cluster)}."
        for p in found
    ]
    return [*lines, _assumes(found, cluster)] if found else []


_NEVER = ["no number: it is not true then"] * len(POWERS)


def _line(plan: SizePlan, cluster: str) -> str:
    if not plan.counts:
        return "no number of them, for it is not true then"
    needed = [
        f"{_told(count)} {cluster}s for {100 * wanted:.0f} % power"
        for count, wanted in zip(plan.counts, POWERS, strict=True)
    ]
    return ", ".join(needed)


def _told(count: Count) -> str:
    return f"{_persons(count.persons)} ({_persons(count.low)} to {_persons(count.high)})"


def _persons(count: float) -> str:
    return f"{count:.0f}" if math.isfinite(count) else f"more than {MOST_PERSONS:,}"


def _assumes(found: Sequence[SizePlan], cluster: str) -> str:
    counts = sorted({plan.known_from for plan in found})
    known = str(counts[0]) if len(counts) == 1 else f"{counts[0]} to {counts[-1]}"
    return (
        f"Power: the chance that a study of that size shows it. All by one law: the interval shown "
        f"here, narrowed by more {cluster}s with as many runs of each (noncentral t). In brackets, "
        f"what else would fit (95 %), since the spread is known from {known} {cluster}s only. A "
        "difference found in few of them is often too large: rather count on the smallest that "
        "matters."
    )
