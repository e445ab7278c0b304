"""How large a difference is beside how much persons differ: sizes without a unit."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from dva_sim.experiments.statistics.persons import (
    LEVEL,
    RESAMPLES,
    Floats,
    Interval,
    draws,
    paired_means,
)
from dva_sim.experiments.statistics.resampling import bca
from dva_sim.experiments.statistics.shares import share_interval


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
    whole = _weighted(first, second, np.ones((1, n)))
    drawn = _weighted(first, second, draws(n, seed, resamples))
    left_out = _weighted(first, second, 1 - np.eye(n))
    paired, average = (
        Interval(float(whole[i, 0]), *bca(float(whole[i, 0]), drawn[i], left_out[i], level), n)
        for i in range(2)
    )
    return EffectSize(paired, average, superiority)


def _weighted(first: Floats, second: Floats, weights: Floats) -> Floats:
    """`d_z` and `d_av` `(2, b)` of persons weighted `(b, n)`; nan without spread."""
    total = weights.sum(axis=1)
    mean = weights @ (first - second) / total
    v = _variance(first, weights), _variance(second, weights)
    own, average = np.sqrt(_variance(first - second, weights)), (np.sqrt(v[0]) + np.sqrt(v[1])) / 2
    correction = _hedges(len(first))
    with np.errstate(divide="ignore", invalid="ignore"):
        sizes = correction * mean / np.array([own, average])
    return np.where(np.isfinite(sizes), sizes, np.nan)


def _variance(values: Floats, weights: Floats) -> Floats:
    off, total = values - values.mean(), weights.sum(axis=1)
    mean = weights @ off / total
    square = weights @ off**2 / total - mean**2
    return np.asarray(np.maximum(square, 0) * total / (total - 1))


def _hedges(n: int) -> float:
    """What a standardised mean of `n` persons is too large by, inverted."""
    half = (n - 1) / 2
    return math.exp(math.lgamma(half) - math.lgamma(half - 0.5)) / math.sqrt(half)
