"""Are two treatments the same for all that matters: two one-sided tests."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from dva_sim.experiments.statistics.persons import Interval, person_means, students_t

ALPHA = 0.05


@dataclass(frozen=True)
class Equivalence:
    """Whether a difference lies within a margin.

    Attributes:
        difference: Mean over persons of `a - b` with its interval of level `1 - 2 alpha`.
        margin: Largest difference that does not matter, either way.
        p: The larger of the two one-sided p-values; nan with fewer than two persons.
        is_equivalent: Whether `p` is not above `alpha`: the interval lies within the margin.
    """

    difference: Interval
    margin: float
    p: float
    is_equivalent: bool


def equivalence(
    a: ArrayLike, b: ArrayLike, person: ArrayLike, margin: float, alpha: float = ALPHA
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

    Raises:
        ValueError: the margin is not above zero.

    References:
        Schuirmann, J. Pharmacokinet. Biopharm. 15 (1987) 657-680.
    """
    if not margin > 0:
        raise ValueError(f"the margin of an equivalence test must be above zero, not {margin}")
    means = person_means(np.asarray(a, dtype=float) - np.asarray(b, dtype=float), person)[1]
    n = len(means)
    mean = float(means.mean()) if n else math.nan
    error = float(means.std(ddof=1)) / math.sqrt(n) if n > 1 else math.nan
    half = students_t(1 - 2 * alpha, n) * error
    p = _p(margin - abs(mean), error, n)
    return Equivalence(Interval(mean, mean - half, mean + half, n), margin, p, p <= alpha)


def _p(room: float, error: float, n: int) -> float:
    """One-sided p-value of the mean being so far inside the nearer edge of the margin."""
    from scipy import special

    if n < 2:
        return math.nan
    if error == 0:
        return 0.0 if room > 0 else 1.0
    return float(special.stdtr(n - 1, -room / error))
