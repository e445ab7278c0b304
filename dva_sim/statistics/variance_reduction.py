"""Did pairing help: how alike two treatments' random numbers are, and what that does to variance.

It rests on statistics of persons' pairs of means, and how far they would scatter with other
persons. Everything is sums over persons, so that leaving one out is a subtraction.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from dva_sim.statistics.bands import LEAST_ERROR, reach
from dva_sim.statistics.persons import LEVEL, Floats, Interval, draws, paired_means

RESAMPLES = 1000  # each takes as many jackknife steps as there are persons


class Pairs(NamedTuple):
    """What is known of the pairs of means of some persons, each entry of the same shape.

    Attributes:
        persons: How many.
        difference: Mean of first minus second.
        first: Variance of the first means, divided by the number of persons.
        second: Of the second.
        apart: Of the differences.
    """

    persons: Floats
    difference: Floats
    first: Floats
    second: Floats
    apart: Floats


Statistic = Callable[[Pairs], Floats]


def studentised_intervals(
    statistics: Sequence[Statistic],
    first: Floats,
    second: Floats,
    level: float,
    seed: int,
    resamples: int,
) -> list[Interval]:
    """The bootstrap-t of smooth statistics, with the jackknife for their standard errors.

    Args:
        statistics: Each on a scale without bounds.
        first: Persons' means under one treatment `(n,)`, at least 3.
        second: Under the other.
        level: Confidence level.
        seed: Of the resampling.
        resamples: How many times persons are drawn.

    References:
        Efron & Tibshirani, An Introduction to the Bootstrap (1993), chapters 11 and 12.
    """
    n, rows, shift = len(first), _rows(first, second), float((first - second).mean())
    whole, drawn = (
        _Drawn(weights, rows, shift) for weights in (np.ones((1, n)), draws(n, seed, resamples))
    )
    return [_interval(statistic, whole, drawn, level, n) for statistic in statistics]


class _Drawn:
    """Draws of persons, each also without each of its persons.

    Args:
        weights: How often each person is drawn `(b, n)`.
        rows: What each adds to the sums `(6, n)`.
        shift: Mean difference of all.
    """

    def __init__(self, weights: Floats, rows: Floats, shift: float) -> None:
        self.weights = weights
        sums = rows @ weights.T
        self.whole = _pairs(sums, shift)
        self.left_out = _pairs(sums[:, :, np.newaxis] - rows[:, np.newaxis, :], shift)

    def of(self, statistic: Statistic) -> tuple[Floats, Floats]:
        """A statistic of each draw and its jackknife standard error, each `(b,)`."""
        left_out, n = statistic(self.left_out), self.weights.shape[1]
        weights = np.where(np.isfinite(left_out), self.weights, 0.0)
        left_out = np.where(weights > 0, left_out, 0.0)
        total = weights.sum(axis=1)
        centre = (weights * left_out).sum(axis=1) / np.maximum(total, 1)
        square = (weights * (left_out - centre[:, np.newaxis]) ** 2).sum(axis=1)
        error = np.where(total > 1, np.sqrt((n - 1) / n * square), np.nan)
        return statistic(self.whole), error


def _interval(statistic: Statistic, whole: _Drawn, drawn: _Drawn, level: float, n: int) -> Interval:
    estimate, error = (float(x[0]) for x in whole.of(statistic))
    if not error > 0:
        width = 0.0 if error == 0 else np.nan
        return Interval(estimate, estimate - width, estimate + width, n)
    values, errors = drawn.of(statistic)
    ratio = (values - estimate) / np.maximum(errors, LEAST_ERROR * error)
    ratio = ratio[np.isfinite(ratio), np.newaxis]
    (down,), (up,) = reach(ratio, np.array([n]), level)
    return Interval(estimate, float(estimate - down * error), float(estimate + up * error), n)


def _rows(first: Floats, second: Floats) -> Floats:
    """What each person adds to the sums `(6, n)`, centred so that squares keep their digits."""
    one, two, off = (x - x.mean() for x in (first, second, first - second))
    return np.stack([np.ones(len(first)), one, two, one**2, two**2, off**2])


def _pairs(sums: Floats, shift: float) -> Pairs:
    """From sums over persons `(6, ...)`."""
    count = sums[0]
    one, two, *squares = sums[1:] / np.maximum(count, 1)
    means = one, two, one - two
    variances = (np.maximum(s - m**2, 0) for s, m in zip(squares, means, strict=True))
    return Pairs(count, one - two + shift, *variances)


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
