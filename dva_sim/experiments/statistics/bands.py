"""Several levels at once: means over persons with a band that holds all of them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from dva_sim.experiments.statistics.persons import LEVEL, RESAMPLES, Floats, students_t
from dva_sim.experiments.statistics.studentised import (
    FEWEST_TO_RESAMPLE,
    moments,
    reach,
    studentised,
)


@dataclass(frozen=True)
class Band:
    """Means at `k` levels, with intervals for each level alone and for all of them at once.

    Attributes:
        mean: Means over persons `(k,)`; nan where nobody has a value.
        low: Lower edge of the simultaneous band `(k,)`; nan with fewer than two persons.
        high: Its upper edge `(k,)`.
        pointwise_low: Lower end of each level's own interval `(k,)`.
        pointwise_high: Its upper end `(k,)`.
        critical: Standard errors between the mean and the band's edge, if no level's own
            interval ends farther out.
        n_persons: How many persons have at least one value.
    """

    mean: Floats
    low: Floats
    high: Floats
    pointwise_low: Floats
    pointwise_high: Floats
    critical: float
    n_persons: int


def band(
    differences: ArrayLike, level: float = LEVEL, seed: int = 1, resamples: int = RESAMPLES
) -> Band:
    """A band that holds all levels at once with the given confidence.

    Its width comes from the largest studentised deviation over the levels when persons are
    drawn anew: that respects how the levels depend on each other and how skewed they are.
    Nowhere does it end inside a level's own interval. The 95 % band over 6 levels holds in 93 to
    97 % of studies of 12 or 24 persons, normal, skewed or with a level four fifths zero.
    With fewer than 6 persons Bonferroni's t stands in.

    Args:
        differences: One row per person `(n_persons, k)`, nan where a cell is missing.
        level: Confidence level.
        seed: Of the resampling.
        resamples: How many times persons are drawn.

    References:
        Westfall & Young, Resampling-Based Multiple Testing (1993), section 2.2 (max-t).
    """
    values = np.atleast_2d(np.asarray(differences, dtype=float))
    values = values[np.isfinite(values).any(axis=1)]
    mean, error, count = (x[0] for x in moments(values, np.ones((1, len(values)))))
    judged = error > 0  # neither nan nor without spread
    ratio = studentised(values[:, judged], mean[judged], error[judged], seed, resamples)
    down, up = np.where(count > 1, 0.0, np.nan), np.where(count > 1, 0.0, np.nan)
    down[judged], up[judged] = reach(ratio, count[judged], level)
    critical = _critical(ratio, count[judged], level)
    lowest, highest = mean - down * error, mean + up * error
    low = np.minimum(mean - critical * error, lowest)
    high = np.maximum(mean + critical * error, highest)
    return Band(mean, low, high, lowest, highest, critical, len(values))


def _critical(ratio: Floats, count: Floats, level: float) -> float:
    """Standard errors that hold all levels at once; never less than the widest one alone."""
    if not len(count):
        return math.nan
    fewest = int(count.min())
    if fewest < FEWEST_TO_RESAMPLE:
        return students_t(1 - (1 - level) / len(count), fewest)
    largest = np.quantile(abs(ratio).max(axis=1), level, method="inverted_cdf")
    return max(float(largest), students_t(level, fewest))
