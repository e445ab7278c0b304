"""Quantiles of runs, and how often something happened."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from dva_sim.experiments.statistics.persons import (
    LEVEL,
    RESAMPLES,
    Floats,
    Interval,
    draws,
    students_t,
)
from dva_sim.experiments.statistics.resampling import tails


def quantile_interval(
    values: ArrayLike,
    person: ArrayLike,
    q: float = 0.5,
    level: float = LEVEL,
    seed: int = 1,
    resamples: int = RESAMPLES,
) -> Interval:
    """A quantile of all runs, with the percentile interval of drawing persons anew.

    The 95 % interval of a median over 24 persons with 5 trials covers in 95 %. High quantiles
    are beyond so few persons: that of the 95th percentile covers in 93 % where persons hardly
    differ, but in 76 % where the trials of each are much alike.

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
    weights = draws(len(persons), seed, resamples)[:, owner]
    drawn = _weighted_quantiles(ranked, weights, q)
    low, high = np.quantile(drawn, tails(level, len(persons)))
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
    n, runs = len(persons), int(there.sum())
    between = n / (n - 1) * float((surplus**2).sum()) / runs**2
    return wilson_interval(share, between, n, runs, level)


def wilson_interval(
    share: float, variance: float, persons: int, runs: int, level: float = LEVEL
) -> Interval:
    """Wilson's interval of a share on as many independent runs as would have its variance.

    Args:
        share: The estimate.
        variance: Of the estimate, from how persons differ.
        persons: The least number of runs that it counts as.
        runs: The greatest.
        level: Confidence level.
    """
    n = _effective_runs(share, variance, persons, runs)
    low, high = _wilson(share, n, students_t(level, persons))
    return Interval(share, low, high, persons)


def _effective_runs(share: float, variance: float, persons: int, runs: int) -> float:
    """Independent runs worth as much as these; between the persons and the runs."""
    if not 0 < share < 1:
        return persons
    return min(max(share * (1 - share) / variance, persons), runs) if variance > 0 else runs


def _wilson(share: float, n: float, t: float) -> tuple[float, float]:
    centre = (share + t**2 / (2 * n)) / (1 + t**2 / n)
    half = t / (1 + t**2 / n) * math.sqrt(share * (1 - share) / n + t**2 / (4 * n**2))
    return max(0.0, centre - half), min(1.0, centre + half)
