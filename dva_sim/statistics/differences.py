"""Means over persons, and what differs between two treatments of the same persons.

How much persons differ from each other, and from themselves: components of variance.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from dva_sim.statistics.bands import band
from dva_sim.statistics.persons import LEVEL, RESAMPLES, Interval, person_means


def mean_interval(
    values: ArrayLike,
    person: ArrayLike,
    level: float = LEVEL,
    seed: int = 1,
    resamples: int = RESAMPLES,
) -> Interval:
    """The mean over persons, each counting the same.

    It is what a band gives for one level alone.

    Args:
        values: One value per run `(n,)`, nan where missing.
        person: Whose run it was `(n,)`.
        level: Confidence level.
        seed: Of the resampling.
        resamples: How many times persons are drawn.
    """
    means = person_means(values, person)[1]
    found = band(means[:, np.newaxis], level, seed, resamples)
    low, high = float(found.pointwise_low[0]), float(found.pointwise_high[0])
    return Interval(float(found.mean[0]), low, high, len(means))


def paired_difference(
    a: ArrayLike,
    b: ArrayLike,
    person: ArrayLike,
    level: float = LEVEL,
    seed: int = 1,
    resamples: int = RESAMPLES,
) -> Interval:
    """The mean over persons of `a - b`, run by run.

    Args:
        a: One treatment `(n,)`.
        b: The other `(n,)`, row by row the same person and trial.
        person: Whose run it was `(n,)`.
        level: Confidence level.
        seed: Of the resampling.
        resamples: How many times persons are drawn.
    """
    differences = np.asarray(a, dtype=float) - np.asarray(b, dtype=float)
    return mean_interval(differences, person, level, seed, resamples)


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
