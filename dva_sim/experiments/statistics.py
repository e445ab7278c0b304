"""Intervals in which the simulated person is the cluster.

Trials of one person are alike, so they never count as independent: every interval here rests
on persons, either through their means or by drawing persons with all their trials. Missing
runs are nan and are left out; with fewer than two persons an interval is nan, not an error.
All intervals are Monte Carlo intervals: they hold given the model.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]

LEVEL = 0.95
RESAMPLES = 4000
_FEWEST_TO_RESAMPLE = 6  # below, 5 % of the draws repeat one person only and have no spread
_LEAST_ERROR = 0.25  # of the sample's standard error, in any draw
_ROUNDING = 1e-12  # spread below this share of the values is rounding, not variation


@dataclass(frozen=True)
class Interval:
    """An estimate with its interval.

    Attributes:
        mean: The estimate (a mean, a quantile or a share).
        low: Lower end; nan where there are too few persons.
        high: Upper end.
        n_persons: How many persons it rests on.
    """

    mean: float
    low: float
    high: float
    n_persons: int


@dataclass(frozen=True)
class Band:
    """Means at `k` levels, with intervals for each level alone and for all of them at once.

    Attributes:
        mean: Means over persons `(k,)`; nan where nobody has a value.
        low: Lower edge of the simultaneous band `(k,)`; nan with fewer than two persons.
        high: Its upper edge `(k,)`.
        pointwise_low: Lower end of each level's own interval `(k,)`.
        pointwise_high: Its upper end `(k,)`.
        critical: Standard errors between the mean and the band's edge.
        n_persons: How many persons have at least one value.
    """

    mean: Floats
    low: Floats
    high: Floats
    pointwise_low: Floats
    pointwise_high: Floats
    critical: float
    n_persons: int


def person_means(values: ArrayLike, person: ArrayLike) -> tuple[NDArray[Any], Floats]:
    """Each person's mean over the trials that gave a number.

    Args:
        values: One value per run `(n,)`, nan where missing.
        person: Who drove it `(n,)`.

    Returns:
        The persons `(m,)`, sorted, and their means `(m,)`; nobody without a value.
    """
    numbers, who = np.asarray(values, dtype=float), np.asarray(person)
    there = np.isfinite(numbers)
    persons, code = np.unique(who[there], return_inverse=True)
    totals = np.bincount(code, weights=numbers[there], minlength=len(persons))
    return persons, totals / np.bincount(code, minlength=len(persons))


def mean_interval(values: ArrayLike, person: ArrayLike, level: float = LEVEL) -> Interval:
    """The mean over persons, with Student's t interval on the persons' means.

    With 24 persons whose means have a skewness of 1.1 the 95 % interval covers in 94 % of
    studies, with a skewness of 2.3 in 92 %.
    """
    means = person_means(values, person)[1]
    n = len(means)
    if n == 0:
        return Interval(math.nan, math.nan, math.nan, 0)
    mean = float(means.mean())
    half = _t(level, n) * float(means.std(ddof=1)) / math.sqrt(n) if n > 1 else math.nan
    return Interval(mean, mean - half, mean + half, n)


def paired_difference(
    a: ArrayLike, b: ArrayLike, person: ArrayLike, level: float = LEVEL
) -> Interval:
    """The mean of `a - b`, run by run, with Student's t interval on persons.

    Args:
        a: One treatment `(n,)`.
        b: The other `(n,)`, row by row the same person and trial.
        person: Whose run it was `(n,)`.
        level: Confidence level.
    """
    return mean_interval(np.asarray(a, dtype=float) - np.asarray(b, dtype=float), person, level)


def band(
    differences: ArrayLike, level: float = LEVEL, seed: int = 1, resamples: int = RESAMPLES
) -> Band:
    """A band that holds all levels at once with the given confidence.

    Its width comes from the largest studentised deviation over the levels when persons are
    drawn anew: that respects how the levels depend on each other and how skewed they are.
    A draw that happens to repeat the same few persons has next to no spread of its own;
    it is given at least a quarter of the sample's. Without that a level at which most
    persons do not differ at all makes the band endless; with it the 95 % band holds in 92
    to 97 % of studies of 6 to 24 persons, normal, skewed (skewness 2.3) or four fifths
    zero. With fewer than 6 persons Bonferroni's t stands in.

    Args:
        differences: One row per person `(n_persons, k)`, nan where a cell is missing.
        level: Confidence level.
        seed: Of the resampling.
        resamples: How many times persons are drawn.

    References:
        Efron & Tibshirani, An Introduction to the Bootstrap (1993), section 12.5 (bootstrap-t);
        Westfall & Young, Resampling-Based Multiple Testing (1993), section 2.2 (max-t).
    """
    values = np.atleast_2d(np.asarray(differences, dtype=float))
    values = values[np.isfinite(values).any(axis=1)]
    mean, error, count = _moments(values, np.ones((1, len(values))))
    mean, error, count = mean[0], error[0], count[0]
    alone = np.array([_t(level, int(n)) for n in count])
    critical = _critical(values, mean, error, count, level, seed, resamples)
    low, high = mean - critical * error, mean + critical * error
    return Band(mean, low, high, mean - alone * error, mean + alone * error, critical, len(values))


def _critical(
    values: Floats,
    mean: Floats,
    error: Floats,
    count: Floats,
    level: float,
    seed: int,
    resamples: int,
) -> float:
    """Standard errors that hold all levels at once; never less than the widest one alone."""
    judged = error > 0  # neither nan nor without spread
    if not judged.any():
        return math.nan
    fewest = int(count[judged].min())
    if fewest < _FEWEST_TO_RESAMPLE:
        return _t(1 - (1 - level) / int(judged.sum()), fewest)
    weights = _draws(len(values), seed, resamples)
    drawn, drawn_error, _ = _moments(values[:, judged], weights)
    ratio = abs(drawn - mean[judged]) / np.maximum(drawn_error, _LEAST_ERROR * error[judged])
    largest = np.quantile(ratio.max(axis=1), level, method="inverted_cdf")
    return max(float(largest), _t(level, fewest))


def _moments(values: Floats, weights: Floats) -> tuple[Floats, Floats, Floats]:
    """Mean, standard error and count per level `(b, k)` for rows weighted `(b, n)`."""
    there = np.isfinite(values)
    filled = np.where(there, values, 0.0)
    count = weights @ there
    nobody, few = count < 1, count < 2
    centre = filled.sum(axis=0) / np.maximum(there.sum(axis=0), 1)
    off = np.where(there, values - centre, 0.0)  # centred first: squares keep their digits
    mean = np.where(nobody, np.nan, (weights @ off) / np.maximum(count, 1))
    square = (weights @ off**2) / np.maximum(count, 1)
    variance = np.where(few, np.nan, (square - mean**2) / np.maximum(count - 1, 1))
    tiny = (_ROUNDING * (abs(centre) + abs(off).max(axis=0, initial=0.0))) ** 2
    error = np.sqrt(np.where(variance <= tiny, 0.0, variance))
    return mean + centre, error, count


def quantile_interval(
    values: ArrayLike,
    person: ArrayLike,
    q: float = 0.5,
    level: float = LEVEL,
    seed: int = 1,
    resamples: int = RESAMPLES,
) -> Interval:
    """A quantile of all runs, with the percentile interval of drawing persons anew.

    Args:
        values: One value per run `(n,)`, nan where missing.
        person: Whose run it was `(n,)`.
        q: Which quantile; 0.5 is the median.
        level: Confidence level.
        seed: Of the resampling.
        resamples: How many times persons are drawn.
    """
    numbers, who = np.asarray(values, dtype=float), np.asarray(person)
    there = np.isfinite(numbers)
    persons, code = np.unique(who[there], return_inverse=True)
    if not len(persons):
        return Interval(math.nan, math.nan, math.nan, 0)
    order = np.argsort(numbers[there], kind="stable")
    ranked, owner = numbers[there][order], code[order]
    estimate = float(np.quantile(ranked, q))
    if len(persons) < 2:
        return Interval(estimate, math.nan, math.nan, 1)
    weights = _draws(len(persons), seed, resamples)[:, owner]
    drawn = _weighted_quantiles(ranked, weights, q)
    low, high = np.quantile(drawn, [(1 - level) / 2, (1 + level) / 2])
    return Interval(estimate, float(low), float(high), len(persons))


def _weighted_quantiles(ranked: Floats, weights: Floats, q: float) -> Floats:
    """Quantiles of ascending values, each repeated as often as its whole weight `(b, n)` says."""
    upto = np.cumsum(weights, axis=1)
    place = q * (upto[:, -1] - 1)
    below = np.floor(place)
    first = ranked[(upto > below[:, None]).argmax(axis=1)]
    second = ranked[(upto > np.ceil(place)[:, None]).argmax(axis=1)]
    return np.asarray(first + (place - below) * (second - first))


def share_interval(flags: ArrayLike, person: ArrayLike, level: float = LEVEL) -> Interval:
    """How often something happened, with Wilson's interval on the effective number of runs.

    Runs of one person are worth less than as many runs of different persons: the number of
    runs is divided by how much the variance between persons exceeds that of independent
    runs. Where all runs agree nothing can be learnt of that, and each person counts once.

    Args:
        flags: True where it happened `(n,)`; nan or None where the run is missing.
        person: Whose run it was `(n,)`.
        level: Confidence level.

    References:
        Wilson, JASA 22 (1927) 209-212; Korn & Graubard, Survey Methodology 24 (1998) 193-201.
    """
    numbers, who = np.asarray(flags, dtype=float), np.asarray(person)
    there = np.isfinite(numbers)
    persons, code = np.unique(who[there], return_inverse=True)
    if not len(persons):
        return Interval(math.nan, math.nan, math.nan, 0)
    share = float(numbers[there].mean())
    if len(persons) < 2:
        return Interval(share, math.nan, math.nan, 1)
    surplus = np.bincount(code, weights=numbers[there] - share)
    n = _effective_runs(share, surplus.astype(np.float64), int(there.sum()))
    low, high = _wilson(share, n, _t(level, len(persons)))
    return Interval(share, low, high, len(persons))


def _effective_runs(share: float, surplus: Floats, runs: int) -> float:
    """Independent runs worth as much as these; between the persons and the runs."""
    persons = len(surplus)
    between = persons / (persons - 1) * float((surplus**2).sum()) / runs**2
    if not 0 < share < 1:
        return persons
    independent = share * (1 - share) / runs
    return min(max(runs * independent / between, persons), runs) if between > 0 else runs


def _wilson(share: float, n: float, t: float) -> tuple[float, float]:
    centre = (share + t**2 / (2 * n)) / (1 + t**2 / n)
    half = t / (1 + t**2 / n) * math.sqrt(share * (1 - share) / n + t**2 / (4 * n**2))
    return max(0.0, centre - half), min(1.0, centre + half)


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


def _t(level: float, n: int) -> float:
    """Student's two-sided quantile for `n` persons; nan with fewer than two."""
    from scipy import special

    return float(special.stdtrit(n - 1, (1 + level) / 2)) if n > 1 else math.nan


def _draws(persons: int, seed: int, resamples: int) -> Floats:
    """How often each person is drawn `(resamples, persons)`."""
    rng = np.random.Generator(np.random.PCG64(seed))
    chances = np.full(persons, 1 / persons)
    return rng.multinomial(persons, chances, size=resamples).astype(float)
