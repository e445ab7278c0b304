"""How large a difference is beside how much persons differ: sizes without a unit."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from dva_sim.experiments.analysis.statistics.pairing import RESAMPLES, Pairs, studentised_intervals
from dva_sim.experiments.analysis.statistics.persons import LEVEL, Floats, Interval, paired_means
from dva_sim.experiments.analysis.statistics.shares import share_interval


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
    sizes = _beside_differences, _beside_persons
    found = studentised_intervals(sizes, first, second, level, seed, resamples)
    paired, average = (_times(each, _hedges(n)) for each in found)
    return EffectSize(paired, average, superiority)


def _beside_differences(pairs: Pairs) -> Floats:
    return _size(pairs, np.sqrt(pairs.apart))


def _beside_persons(pairs: Pairs) -> Floats:
    return _size(pairs, (np.sqrt(pairs.first) + np.sqrt(pairs.second)) / 2)


def _size(pairs: Pairs, spread: Floats) -> Floats:
    """Mean differences over a spread that is as if divided by one less; nan without any."""
    there = spread > 0
    size = pairs.difference / np.where(there, spread, 1)
    return np.where(there, size * np.sqrt(np.maximum(pairs.persons - 1, 0) / pairs.persons), np.nan)


def _times(found: Interval, factor: float) -> Interval:
    return Interval(found.mean * factor, found.low * factor, found.high * factor, found.n_persons)


def _hedges(n: int) -> float:
    """What a standardised mean of `n` persons is too large by, inverted."""
    half = (n - 1) / 2
    return math.exp(math.lgamma(half) - math.lgamma(half - 0.5)) / math.sqrt(half)
