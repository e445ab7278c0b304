"""How large a difference is beside how much persons differ: sizes without a unit."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from dva_sim.experiments.statistics.persons import (
    LEVEL,
    Floats,
    Interval,
    paired_means,
)
from dva_sim.experiments.statistics.resampling import studentised_interval
from dva_sim.experiments.statistics.shares import share_interval

RESAMPLES = 1000  # each takes as many jackknife steps as there are persons

_Scale = Callable[[Floats, Floats, Floats], Floats]


@dataclass(frozen=True)
class EffectSize:
    """A paired difference, three times without its unit.

    Attributes:
        paired: Mean difference over the standard deviation of persons' differences
            (`d_z`, with Hedges' correction): what decides how many persons a study needs.
        average: Mean difference over the average standard deviation of persons under the two
            treatments (`d_av`, with Hedges' correction): how large it is beside how much
            persons differ.
        superiority: Share of persons for whom the first lies above the second; ties half.
    """

    paired: Interval
    average: Interval
    superiority: Interval


def effect_size(
    a: ArrayLike,
    b: ArrayLike,
    person: ArrayLike,
    level: float = LEVEL,
    seed: int = 1,
    resamples: int = RESAMPLES,
) -> EffectSize:
    """Standardised sizes of `a - b`, over persons' means.

    Args:
        a: One treatment `(n,)`, nan where missing.
        b: The other `(n,)`, row by row the same person and trial.
        person: Whose run it was `(n,)`.
        level: Confidence level.
        seed: Of the resampling.
        resamples: How many times persons are drawn.

    References:
        Lakens, Front. Psychol. 4 (2013) 863; Hedges, J. Educ. Stat. 6 (1981) 107-128.
    """
    first, second = paired_means(a, b, person)
    n = len(first)
    above = np.where(first > second, 1.0, np.where(first < second, 0.0, 0.5))
    superiority = share_interval(above, np.arange(n), level)
    if n < 3:
        nothing = Interval(math.nan, math.nan, math.nan, n)
        return EffectSize(nothing, nothing, superiority)
    paired, average = (
        studentised_interval(partial(_size, first, second, scale), n, level, seed, resamples)
        for scale in (_of_differences, _of_persons)
    )
    return EffectSize(paired, average, superiority)


def _size(first: Floats, second: Floats, scale: _Scale, weights: Floats) -> Floats:
    """Mean difference `(b,)` of persons weighted `(b, n)`, on a scale; nan without spread."""
    mean = weights @ (first - second) / weights.sum(axis=1)
    spread = scale(first, second, weights)
    size = _hedges(len(first)) * mean / np.where(spread > 0, spread, 1)
    return np.where(spread > 0, size, np.nan)


def _of_differences(first: Floats, second: Floats, weights: Floats) -> Floats:
    return np.sqrt(_variance(first - second, weights))


def _of_persons(first: Floats, second: Floats, weights: Floats) -> Floats:
    return (np.sqrt(_variance(first, weights)) + np.sqrt(_variance(second, weights))) / 2


def _variance(values: Floats, weights: Floats) -> Floats:
    off, total = values - values.mean(), weights.sum(axis=1)
    mean = weights @ off / total
    square = weights @ off**2 / total - mean**2
    return np.asarray(np.maximum(square, 0) * total / np.maximum(total - 1, 1))


def _hedges(n: int) -> float:
    """What a standardised mean of `n` persons is too large by, inverted."""
    half = (n - 1) / 2
    return math.exp(math.lgamma(half) - math.lgamma(half - 0.5)) / math.sqrt(half)
