"""How much persons differ from each other, and from themselves: components of variance."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from dva_sim.experiments.cells import CellTable
from dva_sim.experiments.effects import Floats, View
from dva_sim.experiments.labels import factor_name, level_name, number, percent, unit_of

_FEWEST = 2


@dataclass(frozen=True)
class Components:
    """The variance of one value per run, split.

    Attributes:
        between: Of the persons' own means; never below zero.
        within: Of one person's trials around that mean.
    """

    between: float
    within: float

    @property
    def share(self) -> float:
        """How much of the variance of a single run lies between persons."""
        total = self.between + self.within
        return self.between / total if total > 0 else math.nan


def components(values: ArrayLike) -> Components:
    """Split the variance of `(persons, trials)` by the method of moments; nan are left out.

    The mean squares of a one-way analysis of variance are set equal to what they estimate,
    with unequal numbers of trials allowed for. Nan with fewer than two persons, or where nobody
    has a second trial.

    References:
        Searle, Casella & McCulloch, Variance Components (1992), chapter 3.
    """
    grid = np.asarray(values, dtype=float)
    there = np.isfinite(grid)
    grid, there = grid[there.any(axis=1)], there[there.any(axis=1)]
    count = there.sum(axis=1)
    persons, runs = len(count), int(count.sum())
    if persons < _FEWEST or runs <= persons:
        return Components(math.nan, math.nan)
    filled = np.where(there, grid, 0.0)
    means = filled.sum(axis=1) / count
    off = np.where(there, grid - means[:, np.newaxis], 0.0)
    within = float((off**2).sum() / (runs - persons))
    grand = filled.sum() / runs
    square_between = float((count * (means - grand) ** 2).sum() / (persons - 1))
    trials = (runs - float((count**2).sum()) / runs) / (persons - 1)
    return Components(max(0.0, (square_between - within) / trials), within)


def spread_table(view: View) -> CellTable | None:
    """Spread between and within persons, in the panel that the answer speaks of."""
    if view.contrast is None or view.line is None or len(view.part.trials) < _FEWEST:
        return None
    panel, values = view.panels[0], view.values
    first, second = (view.curve(values, panel, level) for level in view.contrast)
    names = [level_name(view.line.name, level) for level in view.contrast]
    kinds = [(names[0], first), (names[1], second), (f"{names[0]} − {names[1]}", first - second)]
    rows = [
        [_stop_name(view, stop), name, *_printed(components(curve[stop]))]
        for stop in range(len(view.stops))
        for name, curve in kinds
    ]
    unit = f" [{unit_of(view.measure)}]" if unit_of(view.measure) else ""
    over = factor_name(view.over.name) if view.over else ""
    heads = [over, "of", f"between persons{unit}", f"within a person{unit}", "share between"]
    return CellTable(view.part.name, heads, 2, rows)


def _stop_name(view: View, stop: int) -> str:
    return level_name(view.over.name, view.stops[stop]) if view.over else ""


def _printed(found: Components) -> list[str]:
    """As standard deviations, which have the measure's own unit."""
    deviations: Floats = np.sqrt([found.between, found.within])
    return [*(number(float(x)) for x in deviations), percent(found.share)]
