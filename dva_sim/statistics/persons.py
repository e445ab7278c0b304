"""The simulated person as the cluster: what every interval here rests on.

Any statistic of the runs, with persons drawn anew together with all their trials.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]

LEVEL = 0.95
RESAMPLES = 4000


@dataclass(frozen=True)
class Interval:
    """An estimate with its interval.

    Attributes:
        mean: The estimate (a mean, a quantile, a share, a ratio ...).
        low: Lower end; nan where there are too few persons.
        high: Upper end.
        n_persons: How many persons it rests on.
    """

    mean: float
    low: float
    high: float
    n_persons: int

    @property
    def half_width(self) -> float:
        """Half the distance between the ends; nan where there are none."""
        return (self.high - self.low) / 2


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


def paired_means(a: ArrayLike, b: ArrayLike, person: ArrayLike) -> tuple[Floats, Floats]:
    """Each person's means of two treatments, over the trials that gave both.

    Returns:
        Means of `a` `(m,)` and of `b` `(m,)`, person by person.
    """
    first, second = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    both = np.isfinite(first) & np.isfinite(second)
    one = person_means(np.where(both, first, np.nan), person)[1]
    return one, person_means(np.where(both, second, np.nan), person)[1]


def students_t(level: float, n: int) -> float:
    """Student's two-sided quantile for `n` persons; nan with fewer than two."""
    from scipy import special

    return float(special.stdtrit(n - 1, (1 + level) / 2)) if n > 1 else math.nan


@functools.lru_cache(maxsize=8)
def draws(persons: int, seed: int, resamples: int) -> Floats:
    """How often each person is drawn when as many are drawn anew, `(resamples, persons)`."""
    rng = np.random.Generator(np.random.PCG64(seed))
    chances = np.full(persons, 1 / persons)
    weights = rng.multinomial(persons, chances, size=resamples).astype(float)
    weights.flags.writeable = False
    return weights


_EDGE = 1e-4  # nearest to 0 and 1 that a share of draws is taken for


def bootstrap_interval(
    values: ArrayLike,
    person: ArrayLike,
    statistic: Callable[[Floats], float],
    level: float = LEVEL,
    seed: int = 1,
    resamples: int = RESAMPLES,
) -> Interval:
    """The cluster bootstrap: bias-corrected and accelerated, over persons.

    For statistics without an interval of their own here; means, shares and quantiles have
    better ones. How well it holds depends on the statistic: of 24, 12 and 6 persons with 5 skewed
    trials, 95 % intervals of a ratio of sums hold in 94, 93 and 94 of 100 studies, of a correlation
    of runs in 91, 91 and 92, of a standard deviation of runs only in 86, 78 and 70 (500 studies
    each, seed 4).

    Args:
        values: One row per run, `(n,)` or `(n, columns)`; runs with a nan are left out.
        person: Whose run it was `(n,)`.
        statistic: Of the rows of the runs drawn.
        level: Confidence level.
        seed: Of the resampling.
        resamples: How many times persons are drawn.

    References:
        Efron, JASA 82 (1987) 171-185; Davison & Hinkley, Bootstrap Methods and their
        Application (1997), section 3.8 (drawing clusters whole).
    """
    rows, who = np.asarray(values, dtype=float), np.asarray(person)
    there = np.isfinite(rows.reshape(len(rows), -1)).all(axis=1)
    rows, (persons, code) = rows[there], np.unique(who[there], return_inverse=True)
    if not len(persons):
        return Interval(math.nan, math.nan, math.nan, 0)
    estimate = float(statistic(rows))
    if len(persons) < 2:
        return Interval(estimate, math.nan, math.nan, 1)

    def of(counts: NDArray[np.int_]) -> Floats:
        """The statistic of each draw of persons `(b, persons)`, with all the runs of each."""
        return np.array([statistic(np.repeat(rows, count[code], axis=0)) for count in counts])

    drawn = of(draws(len(persons), seed, resamples).astype(int))
    left_out = of(1 - np.eye(len(persons), dtype=int))
    low, high = _bca(estimate, drawn, left_out, level)
    return Interval(estimate, low, high, len(persons))


def _bca(estimate: float, drawn: Floats, left_out: Floats, level: float) -> tuple[float, float]:
    """Ends of the bias-corrected and accelerated interval; nan draws are left out.

    Args:
        estimate: Of all persons.
        drawn: Of persons drawn anew `(b,)`.
        left_out: Of all persons but one `(m,)`.
        level: Confidence level.
    """
    from scipy import special

    drawn = drawn[np.isfinite(drawn)]
    if not len(drawn):
        return math.nan, math.nan
    below = (drawn < estimate).mean() + (drawn == estimate).mean() / 2
    bias = special.ndtri(np.clip(below, _EDGE, 1 - _EDGE))
    off = np.nanmean(left_out) - left_out[np.isfinite(left_out)]
    spread = float((off**2).sum()) ** 1.5
    lean = float((off**3).sum()) / (6 * spread) if spread > 0 else 0.0
    z = bias + special.ndtri(tails(level, len(left_out)))
    low, high = np.quantile(drawn, special.ndtr(bias + z / (1 - lean * z)))
    return float(low), float(high)


def tails(level: float, persons: int) -> list[float]:
    """Shares of draws beyond either end, wide enough for so few persons.

    Persons drawn anew differ less than persons, by the factor that divides their variance by
    one less than their number; and the spread itself is uncertain, as in Student's law.

    References:
        Hesterberg, The American Statistician 69 (2015) 371-386 (expanded percentiles).
    """
    from scipy import special

    z = students_t(level, persons) * math.sqrt(persons / (persons - 1))
    return [float(special.ndtr(-z)), float(special.ndtr(z))]
