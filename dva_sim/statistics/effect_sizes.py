"""Effect sizes, the reduction of variance by pairing, and components of variance.

Effect sizes and pairing are statistics of sums over the persons' pairs of means, so that a
jackknife leaves a person out by subtraction.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from dva_sim.statistics.bands import MIN_ERROR, reach
from dva_sim.statistics.persons import LEVEL, Floats, Interval, draws, paired_means

RESAMPLES = 1000  # bootstrap samples; each takes a jackknife over all persons
_MAX_CORRELATION = 1 - 1e-12  # largest correlation, finite on Fisher's scale
_MIN_PERSONS = 3  # minimum number of persons: two are always perfectly correlated


@dataclass(frozen=True)
class EffectSize:
    """A paired difference in two standardised forms.

    Attributes:
        paired: Mean difference over the standard deviation of persons' differences
            (`d_z`, with Hedges' correction); it determines how many persons a study needs.
        average: Mean difference over the average standard deviation of persons under the two
            treatments (`d_av`, with Hedges' correction): its size relative to the differences
            between persons.
    """

    paired: Interval
    average: Interval


def effect_size(
    a: ArrayLike, b: ArrayLike, person: ArrayLike, resamples: int = RESAMPLES
) -> EffectSize:
    """Return the standardised sizes of `a - b`, over persons' means.

    Args:
        a: Values under one treatment `(n,)`, nan where missing.
        b: Values under the other `(n,)`, for the same person and trial in each row.
        person: Person of each run `(n,)`.
        resamples: Number of bootstrap resamples.

    References:
        Lakens, Front. Psychol. 4 (2013) 863; Hedges, J. Educ. Stat. 6 (1981) 107-128.
    """
    first, second = paired_means(a, b, person)
    n = len(first)
    if n < _MIN_PERSONS:
        return EffectSize(_nothing(n), _nothing(n))
    sizes = _beside_differences, _beside_persons
    intervals = _studentised(sizes, first, second, resamples)
    paired, average = (_times(each, _hedges(n)) for each in intervals)
    return EffectSize(paired, average)


def _nothing(n: int) -> Interval:
    return Interval(math.nan, math.nan, math.nan, n)


def _beside_differences(pairs: Pairs) -> Floats:
    return _size(pairs, np.sqrt(pairs.apart))


def _beside_persons(pairs: Pairs) -> Floats:
    return _size(pairs, (np.sqrt(pairs.first) + np.sqrt(pairs.second)) / 2)


def _size(pairs: Pairs, spread: Floats) -> Floats:
    """Return mean differences over a spread, corrected to `n - 1` degrees of freedom.

    Nan without spread.
    """
    varies = spread > 0
    size = pairs.difference / np.where(varies, spread, 1)
    return np.where(
        varies, size * np.sqrt(np.maximum(pairs.persons - 1, 0) / pairs.persons), np.nan
    )


def _times(interval: Interval, factor: float) -> Interval:
    return Interval(
        interval.mean * factor, interval.low * factor, interval.high * factor, interval.n_persons
    )


def _hedges(n: int) -> float:
    """Return Hedges' correction of a standardised mean of `n` persons."""
    half = (n - 1) / 2
    return math.exp(math.lgamma(half) - math.lgamma(half - 0.5)) / math.sqrt(half)


@dataclass(frozen=True)
class VarianceReduction:
    """Change in the variance of a difference of two means due to pairing.

    Attributes:
        correlation: Pearson's correlation of the persons' means under the two treatments.
        ratio: Variance of the paired difference over the sum of the variances, which is the
            variance without pairing: 0.5 halves the number of persons needed.
    """

    correlation: Interval
    ratio: Interval

    @property
    def is_lower(self) -> bool:
        """True if the variance is significantly lower; False where it is undetermined."""
        return self.ratio.high < 1


def pair_correlation(a: ArrayLike, b: ArrayLike) -> float:
    """Return Pearson's correlation of paired runs, a measure of shared randomness.

    Nan with fewer than two pairs, or where one side does not vary.
    """
    first = np.asarray(a, dtype=float)
    second = np.asarray(b, dtype=float)
    both = np.isfinite(first) & np.isfinite(second)
    first = first[both]
    second = second[both]
    if len(first) < 2 or np.ptp(first) == 0 or np.ptp(second) == 0:
        return math.nan
    return float(np.corrcoef(first, second)[0, 1])


def variance_reduction(
    a: ArrayLike, b: ArrayLike, person: ArrayLike, resamples: int = RESAMPLES
) -> VarianceReduction:
    """Return the correlation and ratio of variances that pairing achieved, with intervals.

    The arguments are those of `effect_size`.

    References:
        Fisher, Metron 1 (1921) 3-32 (the scale of correlations).
    """
    first, second = paired_means(a, b, person)
    n = len(first)
    if n < _MIN_PERSONS or np.ptp(first) == 0 or np.ptp(second) == 0:
        return VarianceReduction(_nothing(n), _nothing(n))
    scaled = _on_fishers_scale(_correlation), _on_fishers_scale(_shared)
    intervals = _studentised(scaled, first, second, resamples)
    correlation, shared = (_back(each) for each in intervals)
    ratio = Interval(1 - shared.mean, 1 - shared.high, 1 - shared.low, n)
    return VarianceReduction(correlation, ratio)


def _on_fishers_scale(statistic: Statistic) -> Statistic:
    """Transform a correlation to Fisher's scale, without bounds and with constant variance."""

    def transformed(pairs: Pairs) -> Floats:
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.arctanh(np.clip(statistic(pairs), -_MAX_CORRELATION, _MAX_CORRELATION))

    return transformed


def _back(interval: Interval) -> Interval:
    low, mean, high = np.tanh([interval.low, interval.mean, interval.high]).tolist()
    return Interval(mean, low, high, interval.n_persons)


def _correlation(pairs: Pairs) -> Floats:
    joint = (pairs.first + pairs.second - pairs.apart) / 2
    return np.asarray(joint / np.sqrt(pairs.first * pairs.second))


def _shared(pairs: Pairs) -> Floats:
    """Return the variance of the difference over the sum of the variances."""
    return np.asarray(1 - pairs.apart / (pairs.first + pairs.second))


@dataclass(frozen=True)
class Components:
    """Variance of a value per run, between and within persons.

    Attributes:
        between: Variance of the persons' expected values; never below zero.
        within: Variance of a person's trials around that value.
    """

    between: float
    within: float

    @property
    def share(self) -> float:
        """Share of the variance of a single run that lies between persons."""
        total = self.between + self.within
        return self.between / total if total > 0 else math.nan


def components(values: ArrayLike) -> Components:
    """Split the variance of `(persons, trials)` by the method of moments; nan are left out.

    The mean squares of a one-way analysis of variance are equated with their expectations, also
    for unequal numbers of trials. Nan with fewer than two persons, or if no person has two trials.

    References:
        Searle, Casella & McCulloch, Variance Components (1992), chapter 3.
    """
    grid = np.asarray(values, dtype=float)
    is_finite = np.isfinite(grid)
    grid = grid[is_finite.any(axis=1)]
    is_finite = is_finite[is_finite.any(axis=1)]
    count = is_finite.sum(axis=1)
    persons = len(count)
    runs = int(count.sum())
    if persons < 2 or runs <= persons:
        return Components(math.nan, math.nan)
    filled = np.where(is_finite, grid, 0.0)
    means = filled.sum(axis=1) / count
    deviations = np.where(is_finite, grid - means[:, np.newaxis], 0.0)
    within = float((deviations**2).sum() / (runs - persons))
    grand = filled.sum() / runs
    square_between = float((count * (means - grand) ** 2).sum() / (persons - 1))
    trials = (runs - float((count**2).sum()) / runs) / (persons - 1)
    return Components(max(0.0, (square_between - within) / trials), within)


class Pairs(NamedTuple):
    """Statistics of the pairs of means of some persons; all entries have the same shape.

    Attributes:
        persons: Number of persons.
        difference: Mean of first minus second.
        first: Variance of the first means, divided by the number of persons.
        second: Variance of the second means, divided by the number of persons.
        apart: Variance of the differences, divided by the number of persons.
    """

    persons: Floats
    difference: Floats
    first: Floats
    second: Floats
    apart: Floats


Statistic = Callable[[Pairs], Floats]


def _studentised(
    statistics: Sequence[Statistic], first: Floats, second: Floats, resamples: int
) -> list[Interval]:
    """Return the bootstrap-t of smooth statistics, with the jackknife for their standard errors.

    Args:
        statistics: Statistics, each on a scale without bounds.
        first: Persons' means under one treatment `(n,)`, at least 3.
        second: Persons' means under the other treatment `(n,)`.
        resamples: Number of bootstrap resamples.

    References:
        Efron & Tibshirani, An Introduction to the Bootstrap (1993), chapters 11 and 12.
    """
    n = len(first)
    a, b, off = (x - x.mean() for x in (first, second, first - second))
    rows = np.stack([np.ones(len(first)), a, b, a**2, b**2, off**2])
    shift = float((first - second).mean())
    sample, drawn = (
        _Resamples(weights, rows, shift) for weights in (np.ones((1, n)), draws(n, resamples))
    )
    return [_interval(statistic, sample, drawn, n) for statistic in statistics]


class _Resamples:
    """Resamples of persons, with the statistics of each and of each without one person.

    Args:
        weights: Number of times each person is drawn `(b, n)`.
        rows: Contribution of each person to the sums `(6, n)`.
        shift: Mean difference over all persons.
    """

    def __init__(self, weights: Floats, rows: Floats, shift: float) -> None:
        self.weights = weights
        sums = rows @ weights.T
        self.whole = _pairs(sums, shift)
        self.left_out = _pairs(sums[:, :, np.newaxis] - rows[:, np.newaxis, :], shift)

    def of(self, statistic: Statistic) -> tuple[Floats, Floats]:
        """Return a statistic of each draw and its jackknife standard error, each `(b,)`."""
        left_out = statistic(self.left_out)
        n = self.weights.shape[1]
        weights = np.where(np.isfinite(left_out), self.weights, 0.0)
        left_out = np.where(weights > 0, left_out, 0.0)
        total = weights.sum(axis=1)
        centre = (weights * left_out).sum(axis=1) / np.maximum(total, 1)
        square = (weights * (left_out - centre[:, np.newaxis]) ** 2).sum(axis=1)
        error = np.where(total > 1, np.sqrt((n - 1) / n * square), np.nan)
        return statistic(self.whole), error


def _interval(statistic: Statistic, sample: _Resamples, drawn: _Resamples, n: int) -> Interval:
    estimate, error = (float(x[0]) for x in sample.of(statistic))
    if not error > 0:
        width = 0.0 if error == 0 else np.nan
        return Interval(estimate, estimate - width, estimate + width, n)
    values, errors = drawn.of(statistic)
    ratio = (values - estimate) / np.maximum(errors, MIN_ERROR * error)
    ratio = ratio[np.isfinite(ratio), np.newaxis]
    (down,), (up,) = reach(ratio, np.array([n]), LEVEL)
    return Interval(estimate, float(estimate - down * error), float(estimate + up * error), n)


def _pairs(sums: Floats, shift: float) -> Pairs:
    """Return pairs from sums over persons `(6, ...)`."""
    count = sums[0]
    first, second, *squares = sums[1:] / np.maximum(count, 1)
    means = first, second, first - second
    variances = (np.maximum(s - m**2, 0) for s, m in zip(squares, means, strict=True))
    return Pairs(count, first - second + shift, *variances)
