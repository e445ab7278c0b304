"""Statistics of persons' pairs of means, and how far they would scatter with other persons.

Everything rests on sums over persons, so that leaving one out is a subtraction.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from dva_sim.experiments.statistics.persons import Floats, Interval, draws
from dva_sim.experiments.statistics.studentised import LEAST_ERROR, reach

RESAMPLES = 1000  # each takes as many jackknife steps as there are persons


class Pairs(NamedTuple):
    """What is known of the pairs of means of some persons, each entry of the same shape.

    Attributes:
        persons: How many.
        difference: Mean of first minus second.
        first: Variance of the first means, divided by the number of persons.
        second: Of the second.
        apart: Of the differences.
    """

    persons: Floats
    difference: Floats
    first: Floats
    second: Floats
    apart: Floats


Statistic = Callable[[Pairs], Floats]


def studentised_intervals(
    statistics: Sequence[Statistic],
    first: Floats,
    second: Floats,
    level: float,
    seed: int,
    resamples: int,
) -> list[Interval]:
    """The bootstrap-t of smooth statistics, with the jackknife for their standard errors.

    Args:
        statistics: Each on a scale without bounds.
        first: Persons' means under one treatment `(n,)`, at least 3.
        second: Under the other.
        level: Confidence level.
        seed: Of the resampling.
        resamples: How many times persons are drawn.

    References:
        Efron & Tibshirani, An Introduction to the Bootstrap (1993), chapters 11 and 12.
    """
    n, rows, shift = len(first), _rows(first, second), float((first - second).mean())
    whole, drawn = (
        _Drawn(weights, rows, shift) for weights in (np.ones((1, n)), draws(n, seed, resamples))
    )
    return [_interval(statistic, whole, drawn, level, n) for statistic in statistics]


class _Drawn:
    """Draws of persons, each also without each of its persons.

    Args:
        weights: How often each person is drawn `(b, n)`.
        rows: What each adds to the sums `(6, n)`.
        shift: Mean difference of all.
    """

    def __init__(self, weights: Floats, rows: Floats, shift: float) -> None:
        self.weights = weights
        sums = rows @ weights.T
        self.whole = _pairs(sums, shift)
        self.left_out = _pairs(sums[:, :, np.newaxis] - rows[:, np.newaxis, :], shift)

    def of(self, statistic: Statistic) -> tuple[Floats, Floats]:
        """A statistic of each draw and its jackknife standard error, each `(b,)`."""
        left_out, n = statistic(self.left_out), self.weights.shape[1]
        weights = np.where(np.isfinite(left_out), self.weights, 0.0)
        left_out = np.where(weights > 0, left_out, 0.0)
        total = weights.sum(axis=1)
        centre = (weights * left_out).sum(axis=1) / np.maximum(total, 1)
        square = (weights * (left_out - centre[:, np.newaxis]) ** 2).sum(axis=1)
        error = np.where(total > 1, np.sqrt((n - 1) / n * square), np.nan)
        return statistic(self.whole), error


def _interval(statistic: Statistic, whole: _Drawn, drawn: _Drawn, level: float, n: int) -> Interval:
    estimate, error = (float(x[0]) for x in whole.of(statistic))
    if not error > 0:
        width = 0.0 if error == 0 else np.nan
        return Interval(estimate, estimate - width, estimate + width, n)
    values, errors = drawn.of(statistic)
    ratio = (values - estimate) / np.maximum(errors, LEAST_ERROR * error)
    ratio = ratio[np.isfinite(ratio), np.newaxis]
    (down,), (up,) = reach(ratio, np.array([n]), level)
    return Interval(estimate, float(estimate - down * error), float(estimate + up * error), n)


def _rows(first: Floats, second: Floats) -> Floats:
    """What each person adds to the sums `(6, n)`, centred so that squares keep their digits."""
    one, two, off = (x - x.mean() for x in (first, second, first - second))
    return np.stack([np.ones(len(first)), one, two, one**2, two**2, off**2])


def _pairs(sums: Floats, shift: float) -> Pairs:
    """From sums over persons `(6, ...)`."""
    count = sums[0]
    one, two, *squares = sums[1:] / np.maximum(count, 1)
    means = one, two, one - two
    variances = (np.maximum(s - m**2, 0) for s, m in zip(squares, means, strict=True))
    return Pairs(count, one - two + shift, *variances)
