"""Paired differences between two treatments of the same persons, with intervals.

Means over persons with their interval; whether a difference lies beyond a bound or within a margin;
whether there is any, by a permutation test, which assumes only that labels could be swapped. Of
several tests of one family the chance of any false alarm is kept.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dva_sim.statistics.bands import band, chance_above
from dva_sim.statistics.persons import LEVEL, Floats, Interval, person_means

PERMUTATIONS = 10_000
_MAX_EXACT = 14  # persons: 2 ** 14 sign flips are about as many as are drawn otherwise
_SAME = 1e-12  # sums this close, relative to their size, differ by rounding only


def mean_interval(values: ArrayLike, person: ArrayLike, level: float = LEVEL) -> Interval:
    """Return the mean over persons, each counting the same.

    It is what a band gives for one level alone.

    Args:
        values: One value per run `(n,)`, nan where missing.
        person: Person of each run `(n,)`.
        level: Confidence level.
    """
    means = person_means(values, person)[1]
    bands = band(means[:, np.newaxis], level)
    low = float(bands.pointwise_low[0])
    high = float(bands.pointwise_high[0])
    return Interval(float(bands.mean[0]), low, high, len(means))


def paired_difference(
    a: ArrayLike, b: ArrayLike, person: ArrayLike, level: float = LEVEL
) -> Interval:
    """Return the mean over persons of `a - b`, run by run.

    Args:
        a: Values under one treatment `(n,)`.
        b: The other `(n,)`, row by row the same person and trial.
        person: Person of each run `(n,)`.
        level: Confidence level.
    """
    return mean_interval(_minus(a, b), person, level)


def one_sided_test(
    a: ArrayLike, b: ArrayLike, person: ArrayLike, bound: float, side: Literal["above", "below"]
) -> float:
    """Return the p-value of the mean of `a - b` being above, or below, a bound.

    By the same resampling as the interval of the difference, so that the two agree: p is
    below 0.025 where the interval of 95 % lies beyond the bound.

    Args:
        a: Values under one treatment `(n,)`, nan where missing.
        b: The other `(n,)`, row by row the same person and trial.
        person: Person of each run `(n,)`.
        bound: In the measure's unit.
        side: On which side of it the difference is claimed to lie.

    Returns:
        Nan with fewer than two persons.
    """
    off = person_means(_minus(a, b) - bound, person)[1]
    return chance_above(off if side == "above" else -off)


def equivalence(a: ArrayLike, b: ArrayLike, person: ArrayLike, margin: float) -> float:
    """Return the p-value of two one-sided tests that the mean of `a - b` lies within a margin.

    Failing to find a difference is no evidence that there is none: here the burden of proof is
    on sameness. It is below 0.05 where the interval of 90 % lies within the margin.

    Args:
        a: Values under one treatment `(n,)`, nan where missing.
        b: The other `(n,)`, row by row the same person and trial.
        person: Person of each run `(n,)`.
        margin: Largest difference that does not matter, either way; in the measure's unit.

    Returns:
        The larger of the two; nan with fewer than two persons.

    References:
        Schuirmann, J. Pharmacokinet. Biopharm. 15 (1987) 657-680.
    """
    above = one_sided_test(a, b, person, -margin, "above")
    return float(np.maximum(above, one_sided_test(a, b, person, margin, "below")))


def permutation_test(a: ArrayLike, b: ArrayLike, person: ArrayLike) -> float:
    """Swap the labels of the treatments, person by person, and see how rare the outcome is.

    If the treatments did the same to a person, his difference could as well have had the other
    sign. All trials of a person flip together. With up to 14 persons every combination of signs
    is tried; else a random sample, with the outcome itself counted among it so that p is
    never zero and never too small. With fewer than 6 persons p cannot be below 0.05.
    Whether a difference is beyond some bound is for `one_sided_test`.

    Args:
        a: Values under one treatment `(n,)`, nan where missing.
        b: The other `(n,)`, row by row the same person and trial.
        person: Person of each run `(n,)`.

    Returns:
        Chance of a difference at least as large, either way, if the labels were swapped at random;
        nan without persons.

    References:
        Fisher, The Design of Experiments (1935), section 21; Phipson & Smyth, Stat. Appl. Genet.
        Mol. Biol. 9 (2010) 39.
    """
    off = person_means(_minus(a, b), person)[1]
    if not len(off):
        return math.nan
    is_exact = len(off) <= _MAX_EXACT
    signs = _all_signs(len(off)) if is_exact else _random_signs(len(off))
    extreme = abs(signs @ off) >= abs(float(off.sum())) - _SAME * float(abs(off).sum())
    return float(extreme.mean() if is_exact else (extreme.sum() + 1) / (PERMUTATIONS + 1))


def _minus(a: ArrayLike, b: ArrayLike) -> Floats:
    return np.subtract(a, b, dtype=float)


def _all_signs(n: int) -> Floats:
    bits = np.arange(2**n)[:, np.newaxis] >> np.arange(n) & 1
    return (1 - 2 * bits).astype(np.float64)


def _random_signs(n: int) -> Floats:
    rng = np.random.Generator(np.random.PCG64(1))
    return (1 - 2 * rng.integers(0, 2, (PERMUTATIONS, n))).astype(np.float64)


def holm(p_values: ArrayLike, family: ArrayLike | None = None) -> Floats:
    """Return p-values adjusted for their number by Holm's step-down procedure.

    A test is significant at a level, together with all others of its family, where its
    adjusted value is not above that level.

    Args:
        p_values: p-value of each test `(m,)`; nan for tests that could not be made, which do not
            count.
        family: Declared family of each test `(m,)`; by default all belong to one.

    Returns:
        Adjusted p-values `(m,)`, at most 1; nan stays nan.

    References:
        Holm, Scand. J. Stat. 6 (1979) 65-70.
    """
    values = np.asarray(p_values, dtype=float)
    adjusted = np.full(len(values), np.nan)
    for ours in _by_family(values, family):
        stepped = np.arange(len(ours), 0, -1) * values[ours]
        adjusted[ours] = np.minimum(1.0, np.maximum.accumulate(stepped))
    return adjusted


def holm_levels(
    p_values: ArrayLike, family: ArrayLike | None = None, alpha: float = 1 - LEVEL
) -> Floats:
    """Return the level at which Holm's procedure decides on each test: a fraction of `alpha`.

    A test is significant where its own p-value is not above this level, which is when its value
    by `holm` is not above `alpha`. So an interval of this level agrees with the verdict.

    Args:
        p_values: See `holm` `(m,)`.
        family: See `holm` `(m,)`.
        alpha: Chance of any false alarm in a family.

    Returns:
        Levels `(m,)`; nan for tests that could not be made.
    """
    values = np.asarray(p_values, dtype=float)
    levels = np.full(len(values), np.nan)
    for ours in _by_family(values, family):
        left = np.arange(len(ours), 0, -1)
        fails = np.flatnonzero(left * values[ours] > alpha)
        left[fails[0] if len(fails) else len(left) :] = left[fails[0]] if len(fails) else 1
        levels[ours] = alpha / left
    return levels


def _by_family(values: Floats, family: ArrayLike | None) -> Iterator[NDArray[np.intp]]:
    """Yield the places of each family's tests, by rising p-value, without those not made."""
    families = np.zeros(len(values)) if family is None else np.asarray(family)
    for name in np.unique(families):
        ours = np.flatnonzero((families == name) & ~np.isnan(values))
        yield ours[np.argsort(values[ours], kind="stable")]
