"""Does a difference lie beyond a bound, or within a margin: one-sided tests."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from dva_sim.experiments.statistics.means import paired_difference
from dva_sim.experiments.statistics.persons import RESAMPLES, Interval, person_means
from dva_sim.experiments.statistics.studentised import chance_above

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
