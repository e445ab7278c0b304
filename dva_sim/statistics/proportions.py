"""Proportions and quantiles of clustered runs, by their effective sample size."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dva_sim.statistics.persons import LEVEL, Floats, Interval, students_t


def share_interval(flags: ArrayLike, person: ArrayLike) -> Interval:
    """Return the share of flags that are set, with Korn and Graubard's interval.

    Runs of the same person carry less information than runs of different persons: the number of
    runs is divided by the ratio of the variance, estimated from persons, to that of independent
    runs. If all runs agree, the ratio cannot be estimated, and each person counts as one run.

    Args:
        flags: True or False per run `(n,)`; nan or None where the run is missing.
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
    """Return Clopper and Pearson's interval for the number of independent runs with this variance.

    Args:
        share: The estimate.
        variance: Variance of the estimate, from the differences between persons.
        persons: Number of persons, the minimum effective number of runs; the ends are nan for one.
        runs: Number of runs, the maximum effective number.
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
    """Return a quantile of all runs, with the interval by Woodruff.

    The interval holds the values for which `q` lies in the interval of the share of runs below.
    Few persons may not bound a high quantile: if all of them can lie below it by chance, the upper
    end is infinite. With 24 persons of 5 trials the 95th percentile usually has a finite upper end
    if runs hardly cluster, and usually none if the trials of each person are much alike.

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
    """Return the present values `(n,)`, the person's index of each `(n,)`, and their number."""
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
    """Return the effective number of runs, reduced because the variance is an estimate."""
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
