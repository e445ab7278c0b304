"""Paired differences between two treatments of the same persons, with intervals.

Means over persons with their interval; tests of a difference beyond a bound or within a margin; a
permutation test of any difference, which assumes only exchangeable labels; and Holm's procedure,
which keeps the chance of any false alarm among several tests of a family.
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
_MAX_EXACT = 14  # maximum persons for all 2 ** n sign flips; beyond, as many are drawn
_SAME = 1e-12  # sums this close, relative to their size, differ by rounding only


def mean_interval(values: ArrayLike, person: ArrayLike, level: float = LEVEL) -> Interval:
    """Return the mean over persons, each counting the same.

    It is the pointwise interval of a band with one level.

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
        b: Values under the other `(n,)`, for the same person and trial in each row.
        person: Person of each run `(n,)`.
        level: Confidence level.
    """
    return mean_interval(_minus(a, b), person, level)


def one_sided_test(
    a: ArrayLike, b: ArrayLike, person: ArrayLike, bound: float, side: Literal["above", "below"]
) -> float:
    """Return the p-value of the mean of `a - b` being above, or below, a bound.

    It uses the same resampling as the interval of the difference, so that the two agree: p is
    below 0.025 where the 95 % interval lies beyond the bound.

    Args:
        a: Values under one treatment `(n,)`, nan where missing.
        b: Values under the other `(n,)`, for the same person and trial in each row.
        person: Person of each run `(n,)`.
        bound: Bound of the difference, in the measure's unit.
        side: Side of the bound on which the difference is claimed to lie.

    Returns:
        The p-value; nan with fewer than two persons.
    """
    excess = person_means(_minus(a, b) - bound, person)[1]
    return chance_above(excess if side == "above" else -excess)


def equivalence(a: ArrayLike, b: ArrayLike, person: ArrayLike, margin: float) -> float:
    """Return the p-value of two one-sided tests that the mean of `a - b` lies within a margin.

    A difference that is not significant is no evidence of equality; here equality has to be shown.
    The value is below 0.05 where the 90 % interval lies within the margin.

    Args:
        a: Values under one treatment `(n,)`, nan where missing.
        b: Values under the other `(n,)`, for the same person and trial in each row.
        person: Person of each run `(n,)`.
        margin: Largest irrelevant difference in either direction, in the measure's unit.

    Returns:
        The larger of the two; nan with fewer than two persons.

    References:
        Schuirmann, J. Pharmacokinet. Biopharm. 15 (1987) 657-680.
    """
    above = one_sided_test(a, b, person, -margin, "above")
    return float(np.maximum(above, one_sided_test(a, b, person, margin, "below")))


def permutation_test(a: ArrayLike, b: ArrayLike, person: ArrayLike) -> float:
    """Test for any difference by swapping the labels of the treatments, person by person.

    If the treatments have the same effect on a person, the sign of the person's difference is
    random. All trials of a person flip together. With up to 14 persons every combination of signs
    is tried; with more, a random sample, which includes the observed outcome so that p is never
    zero and never too small. With fewer than 6 persons p cannot be below 0.05. For differences
    beyond a bound use `one_sided_test`.

    Args:
        a: Values under one treatment `(n,)`, nan where missing.
        b: Values under the other `(n,)`, for the same person and trial in each row.
        person: Person of each run `(n,)`.

    Returns:
        Probability of a difference at least as large in either direction under random labels; nan
        without persons.

    References:
        Fisher, The Design of Experiments (1935), section 21; Phipson & Smyth, Stat. Appl. Genet.
        Mol. Biol. 9 (2010) 39.
    """
    means = person_means(_minus(a, b), person)[1]
    if not len(means):
        return math.nan
    is_exact = len(means) <= _MAX_EXACT
    signs = _all_signs(len(means)) if is_exact else _random_signs(len(means))
    extreme = abs(signs @ means) >= abs(float(means.sum())) - _SAME * float(abs(means).sum())
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

    A test is significant at a family-wise level where its adjusted value is not above that level.

    Args:
        p_values: p-value of each test `(m,)`; nan for tests that could not be made; these are
            ignored.
        family: Declared family of each test `(m,)`; by default all belong to one.

    Returns:
        Adjusted p-values `(m,)`, at most 1; nan where the input is nan.

    References:
        Holm, Scand. J. Stat. 6 (1979) 65-70.
    """
    values = np.asarray(p_values, dtype=float)
    adjusted = np.full(len(values), np.nan)
    for members in _by_family(values, family):
        stepped = np.arange(len(members), 0, -1) * values[members]
        adjusted[members] = np.minimum(1.0, np.maximum.accumulate(stepped))
    return adjusted


def holm_levels(
    p_values: ArrayLike, family: ArrayLike | None = None, alpha: float = 1 - LEVEL
) -> Floats:
    """Return the level at which Holm's procedure decides on each test, a fraction of `alpha`.

    A test is significant where its unadjusted p-value is not above this level, or equivalently,
    where its value by `holm` is not above `alpha`. An interval at this level agrees with the
    verdict.

    Args:
        p_values: As in `holm` `(m,)`.
        family: As in `holm` `(m,)`.
        alpha: Family-wise error rate.

    Returns:
        Levels `(m,)`; nan for tests that could not be made.
    """
    values = np.asarray(p_values, dtype=float)
    levels = np.full(len(values), np.nan)
    for members in _by_family(values, family):
        # Holm's divisors: m, m - 1 ...; after the first failure all tests fail at its level.
        count = np.arange(len(members), 0, -1)
        failing = np.flatnonzero(count * values[members] > alpha)
        count[failing[0] if len(failing) else len(count) :] = (
            count[failing[0]] if len(failing) else 1
        )
        levels[members] = alpha / count
    return levels


def _by_family(values: Floats, family: ArrayLike | None) -> Iterator[NDArray[np.intp]]:
    """Yield the indices of each family's tests by ascending p-value, without nan."""
    families = np.zeros(len(values)) if family is None else np.asarray(family)
    for name in np.unique(families):
        members = np.flatnonzero((families == name) & ~np.isnan(values))
        yield members[np.argsort(values[members], kind="stable")]
