"""Did pairing help: how alike two treatments' luck is, and what that does to the variance."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from dva_sim.experiments.statistics.persons import (
    LEVEL,
    Floats,
    Interval,
    paired_means,
)
from dva_sim.experiments.statistics.resampling import studentised_interval

Moments = tuple[Floats, Floats, Floats]

RESAMPLES = 1000  # each takes as many jackknife steps as there are persons
_ONE = 1 - 1e-12  # a perfect correlation, on Fisher's scale still finite

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

    References:
        Fisher, Metron 1 (1921) 3-32 (the scale of correlations).
    """
    first, second = paired_means(a, b, person)
    n = len(first)
    if n < _FEWEST or np.ptp(first) == 0 or np.ptp(second) == 0:
        nothing = Interval(math.nan, math.nan, math.nan, n)
        return VarianceReduction(nothing, nothing)
    correlation = _on_fishers_scale(_correlation, first, second, level, seed, resamples)
    shared = _on_fishers_scale(_shared, first, second, level, seed, resamples)
    ratio = Interval(1 - shared.mean, 1 - shared.high, 1 - shared.low, n)
    return VarianceReduction(correlation, ratio)


def _on_fishers_scale(
    statistic: Callable[[Moments], Floats],
    first: Floats,
    second: Floats,
    level: float,
    seed: int,
    resamples: int,
) -> Interval:
    """The interval of a correlation, made where it has no bounds and is spread evenly."""

    def unbounded(weights: Floats) -> Floats:
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.arctanh(np.clip(statistic(_moments(first, second, weights)), -_ONE, _ONE))

    found = studentised_interval(unbounded, len(first), level, seed, resamples)
    low, mean, high = np.tanh([found.low, found.mean, found.high]).tolist()
    return Interval(mean, low, high, found.n_persons)


def _correlation(moments: Moments) -> Floats:
    first, second, joint = moments
    return np.asarray(joint / np.sqrt(first * second))


def _shared(moments: Moments) -> Floats:
    """Share of the sum of variances that goes by pairing."""
    first, second, joint = moments
    return np.asarray(2 * joint / (first + second))


def _moments(first: Floats, second: Floats, weights: Floats) -> Moments:
    """Variances and covariance `(b,)` of persons weighted `(b, n)`."""
    one, two = first - first.mean(), second - second.mean()
    total = weights.sum(axis=1)
    means = weights @ one / total, weights @ two / total
    return (
        np.maximum(weights @ one**2 / total - means[0] ** 2, 0),
        np.maximum(weights @ two**2 / total - means[1] ** 2, 0),
        weights @ (one * two) / total - means[0] * means[1],
    )
