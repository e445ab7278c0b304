"""Means over persons, and what differs between two treatments of the same persons."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from dva_sim.experiments.statistics.bands import band
from dva_sim.experiments.statistics.persons import LEVEL, RESAMPLES, Interval, person_means


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
