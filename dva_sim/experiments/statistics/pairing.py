"""Did pairing help: how alike two treatments' luck is, and what that does to the variance."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from dva_sim.experiments.statistics.persons import (
    LEVEL,
    RESAMPLES,
    Floats,
    Interval,
    draws,
    paired_means,
)
from dva_sim.experiments.statistics.resampling import bca

_FEWEST = 3  # persons; of two, any are perfectly correlated


@dataclass(frozen=True)
class VarianceReduction:
    """What pairing did to the variance of a difference of two means.

    Attributes:
        correlation: Pearson's, of the persons' means under the two treatments.
        ratio: Variance of the paired difference over the sum of the variances, which is what
            other persons in each treatment would give: 0.5 halves the persons needed.
    """

    correlation: Interval
    ratio: Interval

    @property
    def is_lower(self) -> bool:
        """Whether the variance is lower beyond doubt; False where nothing can be told."""
        return self.ratio.high < 1


def pair_correlation(a: ArrayLike, b: ArrayLike) -> float:
    """Pearson's correlation of paired runs: how much of their luck two treatments share.

    Nan with fewer than two pairs, or where one side does not vary.
    """
    first, second = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    both = np.isfinite(first) & np.isfinite(second)
    first, second = first[both], second[both]
    if len(first) < 2 or np.ptp(first) == 0 or np.ptp(second) == 0:
        return math.nan
    return float(np.corrcoef(first, second)[0, 1])


def variance_reduction(
    a: ArrayLike,
    b: ArrayLike,
    person: ArrayLike,
    level: float = LEVEL,
    seed: int = 1,
    resamples: int = RESAMPLES,
) -> VarianceReduction:
    """The correlation and the ratio of variances that pairing achieved, with their intervals.

    Args:
        a: One treatment `(n,)`, nan where missing.
        b: The other `(n,)`, row by row the same person and trial.
        person: Whose run it was `(n,)`.
        level: Confidence level.
        seed: Of the resampling.
        resamples: How many times persons are drawn.
    """
    first, second = paired_means(a, b, person)
    n = len(first)
    if n < _FEWEST or np.ptp(first) == 0 or np.ptp(second) == 0:
        nothing = Interval(math.nan, math.nan, math.nan, n)
        return VarianceReduction(nothing, nothing)
    whole = _weighted(first, second, np.ones((1, n)))
    drawn = _weighted(first, second, draws(n, seed, resamples))
    left_out = _weighted(first, second, 1 - np.eye(n))
    correlation, ratio = (
        Interval(float(whole[i, 0]), *bca(float(whole[i, 0]), drawn[i], left_out[i], level), n)
        for i in range(2)
    )
    return VarianceReduction(correlation, ratio)


def _weighted(first: Floats, second: Floats, weights: Floats) -> Floats:
    """Correlation and ratio of variances `(2, b)` of persons weighted `(b, n)`."""
    one, two = first - first.mean(), second - second.mean()
    total = weights.sum(axis=1)
    m1, m2 = weights @ one / total, weights @ two / total
    v1, v2 = weights @ one**2 / total - m1**2, weights @ two**2 / total - m2**2
    joint = weights @ (one * two) / total - m1 * m2
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.array([joint / np.sqrt(v1 * v2), 1 - 2 * joint / (v1 + v2)])
