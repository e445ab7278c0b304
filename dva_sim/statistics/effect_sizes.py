"""How large a difference is beside how much persons differ: sizes without a unit.

How many persons a study needs, from a pilot or an earlier one: one law for every number told.

What is shown is shown by an interval that leaves zero (or a margin) out. An interval of `n`
persons reaches `stretch * t(n - 1) * spread / sqrt(n)` from its mean, where `t` is Student's
quantile at the interval's level. How persons spread and how much farther than Student's their
interval reaches, because they are skewed or because a band covers several levels at once, are
taken from the study at hand: with as many persons as it has, the law gives the very interval that
its report shows.

References:
    Cohen, Statistical Power Analysis for the Behavioral Sciences (1988), chapter 2 (noncentral t).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from dva_sim.statistics.persons import (
    LEVEL,
    Floats,
    Interval,
    paired_means,
    person_means,
    students_t,
)
from dva_sim.statistics.proportions import share_interval
from dva_sim.statistics.variance_reduction import RESAMPLES, Pairs, studentised_intervals


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


MOST_PERSONS = 10_000


@dataclass(frozen=True)
class IntervalLaw:
    """How far an interval reaches from its mean, by the number of persons.

    Attributes:
        spread: Standard deviation of persons' means.
        persons: From how many it is known.
        level: Two-sided confidence level whose quantile of Student's shrinks with more persons.
        stretch: How many times as far as Student's the interval reaches.
    """

    spread: float
    persons: int
    level: float = LEVEL
    stretch: float = 1.0

    def reach(self, persons: int) -> float:
        """Distance from the mean to the end of the interval."""
        return self._critical(persons) * self.spread / math.sqrt(persons)

    def power(self, effect: float, persons: int) -> float:
        """The chance that the interval of so many lies beyond zero if the true mean is `effect`.

        Beyond zero means on the side of the effect; the other side is no success.

        Raises:
            ValueError: fewer than two persons.
        """
        from scipy import special

        if persons < 2:
            raise ValueError(f"a study needs at least 2 persons, not {persons}")
        shift, critical = abs(effect) / self.spread * math.sqrt(persons), self._critical(persons)
        below = float(special.nctdtr(persons - 1, shift, critical))
        # Far from all doubt the series does not converge; so many persons are as good as normal.
        return float(special.ndtr(shift - critical)) if math.isnan(below) else 1 - below

    def _critical(self, persons: int) -> float:
        return self.stretch * students_t(self.level, persons)


def law_of(
    values: ArrayLike, person: ArrayLike, reach: float | None = None, level: float = LEVEL
) -> IntervalLaw | None:
    """The law that a study's own interval follows; None where its persons are all alike.

    Args:
        values: One value per run `(n,)`, nan where missing: of a comparison, the difference of
            the pair of runs.
        person: Whose run it was `(n,)`.
        reach: How far the study's interval or band reaches from its mean, towards the side that
            counts; as far as Student's if left out.
        level: Of that interval; of a band, that of each of its levels alone (Bonferroni).
    """
    means = person_means(values, person)[1]
    if len(means) < 2 or not np.ptp(means) > 0:
        return None
    plain = IntervalLaw(float(means.std(ddof=1)), len(means), level)
    if reach is None:
        return plain
    return IntervalLaw(plain.spread, plain.persons, level, reach / plain.reach(len(means)))
