"""Any statistic of the runs, with persons drawn anew together with all their trials."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dva_sim.experiments.statistics.persons import (
    LEVEL,
    RESAMPLES,
    Floats,
    Interval,
    draws,
    students_t,
)

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
    better ones.

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
    rows, who = rows[there], who[there]
    own = [rows[who == each] for each in np.unique(who)]
    if not own:
        return Interval(math.nan, math.nan, math.nan, 0)
    estimate = float(statistic(rows))
    if len(own) < 2:
        return Interval(estimate, math.nan, math.nan, 1)
    counts = draws(len(own), seed, resamples).astype(int)
    drawn = np.array([statistic(_together(own, count)) for count in counts])
    left_out = [statistic(_together(own, count)) for count in 1 - np.eye(len(own), dtype=int)]
    low, high = _bca(estimate, drawn, np.array(left_out), level)
    return Interval(estimate, low, high, len(own))


def _together(own: list[Floats], counts: NDArray[np.int_]) -> Floats:
    """The runs of persons, each repeated as often as drawn."""
    return np.concatenate([rows for rows, n in zip(own, counts, strict=True) for _ in range(n)])


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
