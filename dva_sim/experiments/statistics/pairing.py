"""Did pairing help: how alike two treatments' luck is, and what that does to the variance."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from dva_sim.experiments.statistics.pairs import (
    RESAMPLES,
    Pairs,
    Statistic,
    studentised_intervals,
)
from dva_sim.experiments.statistics.persons import LEVEL, Floats, Interval, paired_means

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
    scaled = _on_fishers_scale(_correlation), _on_fishers_scale(_shared)
    found = studentised_intervals(scaled, first, second, level, seed, resamples)
    correlation, shared = (_back(each) for each in found)
    ratio = Interval(1 - shared.mean, 1 - shared.high, 1 - shared.low, n)
    return VarianceReduction(correlation, ratio)


def _on_fishers_scale(statistic: Statistic) -> Statistic:
    """A correlation where it has no bounds and is spread evenly."""

    def unbounded(pairs: Pairs) -> Floats:
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.arctanh(np.clip(statistic(pairs), -_ONE, _ONE))

    return unbounded


def _back(found: Interval) -> Interval:
    low, mean, high = np.tanh([found.low, found.mean, found.high]).tolist()
    return Interval(mean, low, high, found.n_persons)


def _correlation(pairs: Pairs) -> Floats:
    joint = (pairs.first + pairs.second - pairs.apart) / 2
    return np.asarray(joint / np.sqrt(pairs.first * pairs.second))


def _shared(pairs: Pairs) -> Floats:
    """Share of the sum of variances that goes by pairing."""
    return np.asarray(1 - pairs.apart / (pairs.first + pairs.second))
