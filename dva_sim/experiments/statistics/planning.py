"""How many persons a study needs, from a pilot or an earlier one."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from dva_sim.experiments.statistics.components import components
from dva_sim.experiments.statistics.persons import LEVEL, Floats, person_means, students_t

MOST_PERSONS = 1_000_000


def needed_persons(
    values: ArrayLike,
    person: ArrayLike,
    half_width: float,
    trials: int | None = None,
    level: float = LEVEL,
) -> int:
    """The fewest persons whose interval of the mean can be expected to be narrow enough.

    Student's quantile falls as persons are added, so the number is sought step by step. About
    every second study of that size will come out a little wider: take a reserve.

    Args:
        values: One value per run of the pilot `(n,)`, nan where missing: of a comparison, the
            difference of the pair of runs.
        person: Whose run it was `(n,)`.
        half_width: Of the interval wanted, in the unit of the values.
        trials: How many each person is to make; as many as in the pilot if left out.
        level: Confidence level.

    Returns:
        At least 2.

    Raises:
        ValueError: the width is not above zero, the pilot is too small to tell, or more than a
            million persons are needed.
    """
    if not half_width > 0:
        raise ValueError(f"the half-width wanted must be above zero, not {half_width}")
    spread = _spread(values, person, trials)
    at_least = (students_t(level, MOST_PERSONS) * spread / half_width) ** 2
    if at_least > MOST_PERSONS:
        raise ValueError(f"more than {MOST_PERSONS} persons would be needed")
    n = max(2, math.floor(at_least))
    while students_t(level, n) * spread > half_width * math.sqrt(n):
        n += 1
    return n


def power(
    values: ArrayLike,
    person: ArrayLike,
    effect: float,
    persons: int,
    trials: int | None = None,
    level: float = LEVEL,
) -> float:
    """The chance that a study tells a true effect of this size from zero.

    Args:
        values: One value per run of the pilot `(n,)`, nan where missing: of a comparison, the
            difference of the pair of runs. Only their spread counts.
        person: Whose run it was `(n,)`.
        effect: True mean, in the unit of the values.
        persons: How many the study is to have, at least 2.
        trials: How many each person is to make; as many as in the pilot if left out.
        level: Confidence level of the study's interval.

    Raises:
        ValueError: fewer than two persons, or the pilot is too small to tell.

    References:
        Cohen, Statistical Power Analysis for the Behavioral Sciences (1988), chapter 2.
    """
    from scipy import special

    if persons < 2:
        raise ValueError(f"a study needs at least 2 persons, not {persons}")
    spread = _spread(values, person, trials)
    if spread == 0:
        return float(effect != 0)
    shift, t = abs(effect) / spread * math.sqrt(persons), students_t(level, persons)
    too_far, other_way = special.nctdtr(persons - 1, shift, [t, -t])
    return float(1 - too_far + other_way)


def _spread(values: ArrayLike, person: ArrayLike, trials: int | None) -> float:
    """Standard deviation of persons' means, if each makes so many trials."""
    persons, means = person_means(values, person)
    if len(persons) < 2:
        raise ValueError("the spread of persons takes a pilot of at least two")
    if trials is None:
        return float(means.std(ddof=1))
    parts = components(_table(values, person))
    if math.isnan(parts.within):
        raise ValueError("what more trials do takes a pilot with at least two for a person")
    return math.sqrt(parts.between + parts.within / trials)


def _table(values: ArrayLike, person: ArrayLike) -> Floats:
    """Runs by person `(persons, trials)`, nan where there are fewer."""
    numbers, owner = np.asarray(values, dtype=float), np.unique(person, return_inverse=True)[1]
    counts = np.bincount(owner)
    table = np.full((len(counts), int(counts.max())), np.nan)
    order = np.argsort(owner, kind="stable")
    place = np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)
    table[owner[order], place] = numbers[order]
    return table
