"""How much persons differ from each other, and from themselves: components of variance."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

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
