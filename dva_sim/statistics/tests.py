"""Does a difference lie beyond a bound, or within a margin: one-sided tests.

Is there a difference at all: the test that assumes nothing but that labels could be swapped.

Several tests of one family: the chance of any false alarm is kept.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dva_sim.statistics.bands import chance_above
from dva_sim.statistics.differences import paired_difference
from dva_sim.statistics.persons import RESAMPLES, Floats, Interval, person_means

ALPHA = 0.05


@dataclass(frozen=True)
class Equivalence:
    """Whether a difference lies within a margin.

    Attributes:
        difference: Mean over persons of `a - b` with its interval of level `1 - 2 alpha`.
        margin: Largest difference that does not matter, either way.
        p: The larger of the two one-sided p-values; nan with fewer than two persons.
        is_equivalent: Whether `p` is below `alpha`: the interval lies within the margin.
    """

    difference: Interval
    margin: float
    p: float
    is_equivalent: bool


def one_sided_test(
    a: ArrayLike,
    b: ArrayLike,
    person: ArrayLike,
    bound: float,
    side: Literal["above", "below"],
    seed: int = 1,
    resamples: int = RESAMPLES,
) -> float:
    """The p-value of the mean of `a - b` being above, or below, a bound.

    By the same resampling as the interval of the difference, so that the two agree: p is
    below 0.025 where the interval of 95 % lies beyond the bound.

    Args:
        a: One treatment `(n,)`, nan where missing.
        b: The other `(n,)`, row by row the same person and trial.
        person: Whose run it was `(n,)`.
        bound: In the measure's unit.
        side: On which side of it the difference is claimed to lie.
        seed: Of the resampling.
        resamples: How many times persons are drawn.

    Returns:
        Nan with fewer than two persons.
    """
    off = person_means(np.asarray(a, dtype=float) - np.asarray(b, dtype=float) - bound, person)[1]
    return chance_above(off if side == "above" else -off, seed, resamples)


def equivalence(
    a: ArrayLike,
    b: ArrayLike,
    person: ArrayLike,
    margin: float,
    alpha: float = ALPHA,
    seed: int = 1,
    resamples: int = RESAMPLES,
) -> Equivalence:
    """Two one-sided tests that the mean of `a - b` lies between `-margin` and `margin`.

    Failing to find a difference is no evidence that there is none: here the burden of proof is
    on sameness.

    Args:
        a: One treatment `(n,)`, nan where missing.
        b: The other `(n,)`, row by row the same person and trial.
        person: Whose run it was `(n,)`.
        margin: Above zero, in the measure's unit.
        alpha: Level of each of the tests.
        seed: Of the resampling.
        resamples: How many times persons are drawn.

    Raises:
        ValueError: the margin is not above zero.

    References:
        Schuirmann, J. Pharmacokinet. Biopharm. 15 (1987) 657-680.
    """
    if not margin > 0:
        raise ValueError(f"the margin of an equivalence test must be above zero, not {margin}")
    difference = paired_difference(a, b, person, 1 - 2 * alpha, seed, resamples)
    above = one_sided_test(a, b, person, -margin, "above", seed, resamples)
    below = one_sided_test(a, b, person, margin, "below", seed, resamples)
    p = float(np.maximum(above, below))
    return Equivalence(difference, margin, p, p < alpha)


Side = Literal["two-sided", "above", "below"]

PERMUTATIONS = 10_000
_MOST_EXACT = 14  # persons: 2 ** 14 sign flips are about as many as are drawn otherwise
_SAME = 1e-12  # sums this close, relative to their size, differ by rounding only


@dataclass(frozen=True)
class PermutationTest:
    """A test of paired treatments.

    Attributes:
        difference: Mean over persons of `a - b`.
        p: Chance of a difference at least as large if the labels were swapped by luck.
        n_persons: How many persons it rests on.
        is_exact: Whether all sign flips were tried, not a sample of them.
    """

    difference: float
    p: float
    n_persons: int
    is_exact: bool


def permutation_test(
    a: ArrayLike,
    b: ArrayLike,
    person: ArrayLike,
    side: Side = "two-sided",
    seed: int = 1,
    permutations: int = PERMUTATIONS,
) -> PermutationTest:
    """Swap the labels of the treatments, person by person, and see how rare the outcome is.

    If the treatments did the same to a person, his difference could as well have had the other
    sign. All trials of a person flip together. With up to 14 persons every combination of signs
    is tried; else a random sample, with the outcome itself counted among it so that p is
    never zero and never too small. With fewer than 6 persons p cannot be below 0.05 two-sided.
    Whether a difference is beyond some bound is for `one_sided_test`.

    Args:
        a: One treatment `(n,)`, nan where missing.
        b: The other `(n,)`, row by row the same person and trial.
        person: Whose run it was `(n,)`.
        side: `above` asks whether `a` exceeds `b`, `below` whether it falls short of it.
        seed: Of the random signs.
        permutations: How many of them.

    References:
        Fisher, The Design of Experiments (1935), section 21; Phipson & Smyth, Stat. Appl. Genet.
        Mol. Biol. 9 (2010) 39.
    """
    off = person_means(np.asarray(a, dtype=float) - np.asarray(b, dtype=float), person)[1]
    if not len(off):
        return PermutationTest(math.nan, math.nan, 0, True)
    is_exact = len(off) <= _MOST_EXACT
    signs = _all_signs(len(off)) if is_exact else _random_signs(len(off), seed, permutations)
    chance = _as_extreme(signs @ off, float(off.sum()), side, float(abs(off).sum()))
    p = chance.mean() if is_exact else (chance.sum() + 1) / (len(chance) + 1)
    return PermutationTest(float(off.mean()), float(p), len(off), is_exact)


def _as_extreme(sums: Floats, seen: float, side: Side, size: float) -> NDArray[np.bool_]:
    slack = _SAME * size
    if side == "above":
        return sums >= seen - slack
    if side == "below":
        return sums <= seen + slack
    return abs(sums) >= abs(seen) - slack


def _all_signs(n: int) -> Floats:
    bits = np.arange(2**n)[:, np.newaxis] >> np.arange(n) & 1
    return (1 - 2 * bits).astype(np.float64)


def _random_signs(n: int, seed: int, permutations: int) -> Floats:
    rng = np.random.Generator(np.random.PCG64(seed))
    return (1 - 2 * rng.integers(0, 2, (permutations, n))).astype(np.float64)


def holm(p_values: ArrayLike, family: ArrayLike | None = None) -> Floats:
    """P-values adjusted for their number by Holm's step-down procedure.

    A test is significant at a level, together with all others of its family, where its
    adjusted value is not above that level.

    Args:
        p_values: Of each test `(m,)`; nan where a test could not be made, which counts not.
        family: Which declared family each test is of `(m,)`; all of one if left out.

    Returns:
        Adjusted p-values `(m,)`, at most 1; nan stays nan.

    References:
        Holm, Scand. J. Stat. 6 (1979) 65-70.
    """
    values = np.asarray(p_values, dtype=float)
    families = np.zeros(len(values)) if family is None else np.asarray(family)
    adjusted = np.full(len(values), np.nan)
    for name in np.unique(families):
        ours = (families == name) & ~np.isnan(values)
        adjusted[ours] = _adjusted(values[ours])
    return adjusted


def _adjusted(values: Floats) -> Floats:
    order = np.argsort(values, kind="stable")
    stepped = np.arange(len(values), 0, -1) * values[order]
    found = np.empty(len(values))
    found[order] = np.minimum(1.0, np.maximum.accumulate(stepped))
    return found
