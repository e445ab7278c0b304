"""Proportions and quantiles of clustered runs, by their effective sample size."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dva_sim.statistics.persons import LEVEL, Floats, Interval, students_t


def share_interval(flags: ArrayLike, person: ArrayLike) -> Interval:
    """Return the share of flags that are set, with Korn and Graubard's interval.

    Runs of one person are worth less than as many runs of different persons: the number of
    runs is divided by how much the variance between persons exceeds that of independent
    runs. Where all runs agree nothing can be learnt of that, and each person counts once.

    Args:
        flags: True where it happened `(n,)`; nan or None where the run is missing.
        person: Person of each run `(n,)`.

    References:
        Korn & Graubard, Survey Methodology 24 (1998) 193-201.
    """
    numbers, code, persons = _present(flags, person)
    if not persons:
        return Interval(math.nan, math.nan, math.nan, 0)
    share = float(numbers.mean())
    return interval_of_share(share, _variance(numbers, code), persons, len(numbers))


def interval_of_share(share: float, variance: float, persons: int, runs: int) -> Interval:
    """Return Clopper and Pearson's interval on as many runs as would have this variance.

    Args:
        share: The estimate.
        variance: Variance of the estimate, from the differences between persons.
        persons: The least number of runs that it counts as; of one, the ends are nan.
        runs: The greatest.
    """
    from scipy import special

    n = _runs_worth(share, variance, persons, runs)
    if math.isnan(n):
        return Interval(share, math.nan, math.nan, persons)
    beyond = (1 - LEVEL) / 2
    successes = share * n
    low = special.betaincinv(successes, n - successes + 1, beyond) if share > 0 else 0.0
    high = special.betaincinv(successes + 1, n - successes, 1 - beyond) if share < 1 else 1.0
    return Interval(share, float(low), float(high), persons)


def quantile_interval(values: ArrayLike, person: ArrayLike, q: float = 0.5) -> Interval:
    """Return a quantile of all runs, between the values whose own shares are compatible with it.

    Few persons may not bound a high quantile: if all of them can lie below it
    by chance, the upper end is infinite. With 24 persons and 5 trials the 95th percentile of runs
    that hardly cluster has two ends, and mostly one where the trials of each are much alike.

    Args:
        values: One value per run `(n,)`, nan where missing.
        person: Person of each run `(n,)`.
        q: Probability of the quantile; 0.5 is the median.

    References:
        Woodruff, JASA 47 (1952) 635-646.
    """
    numbers, code, persons = _present(values, person)
    if not persons:
        return Interval(math.nan, math.nan, math.nan, 0)
    estimate = float(np.quantile(numbers, q))
    if persons < 2:
        return Interval(estimate, math.nan, math.nan, 1)
    below = (numbers <= estimate).astype(float)
    runs = len(numbers)
    n = _runs_worth(float(below.mean()), _variance(below, code), persons, runs)
    compatible = np.flatnonzero(_is_compatible(np.arange(runs + 1) / runs, n, q))
    ends = np.concatenate([[-np.inf], np.sort(numbers), [np.inf]])
    return Interval(estimate, float(ends[compatible[0]]), float(ends[compatible[-1] + 1]), persons)


def _present(values: ArrayLike, person: ArrayLike) -> tuple[Floats, NDArray[np.intp], int]:
    """Return numbers that are there `(n,)`, whose each is `(n,)`, and how many persons have any."""
    numbers = np.asarray(values, dtype=float)
    person_of_row = np.asarray(person)
    is_finite = np.isfinite(numbers)
    persons, code = np.unique(person_of_row[is_finite], return_inverse=True)
    return numbers[is_finite], code, len(persons)


def _variance(flags: Floats, code: NDArray[np.intp]) -> float:
    """Estimate the variance of the share of all runs over resampled persons; nan for one person."""
    surplus = np.bincount(code, weights=flags - flags.mean())
    persons = len(surplus)
    if persons < 2:
        return math.nan
    return persons / (persons - 1) * float((surplus**2).sum()) / len(flags) ** 2


def _runs_worth(share: float, variance: float, persons: int, runs: int) -> float:
    """Return the number of equivalent independent runs, reduced as the variance is estimated."""
    if not 0 < share < 1:
        n = float(persons)
    else:
        n = min(max(share * (1 - share) / variance, persons), runs) if variance > 0 else runs
    return n * (students_t(LEVEL, runs) / students_t(LEVEL, persons)) ** 2


def _is_compatible(share: Floats, n: float, q: float) -> NDArray[np.bool_]:
    """Return True where `q` lies within the interval of a share `(k,)` of `n` independent runs."""
    from scipy import special

    beyond = (1 - LEVEL) / 2
    successes = share * n
    with np.errstate(invalid="ignore"):
        is_below = special.betainc(successes, n - successes + 1, q) <= beyond
        is_above = special.betainc(successes + 1, n - successes, q) >= 1 - beyond
    return np.asarray(~((share > 0) & is_below) & ~((share < 1) & is_above), dtype=bool)
