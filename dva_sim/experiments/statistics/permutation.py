"""Is there a difference at all: the test that assumes nothing but that labels could be swapped."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dva_sim.experiments.statistics.persons import Floats, person_means

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
