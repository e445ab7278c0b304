"""How many persons a study needs, from a pilot or an earlier one: one law for every number told.

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

from dva_sim.experiments.analysis.statistics.persons import LEVEL, person_means, students_t

MOST_PERSONS = 10_000


@dataclass(frozen=True)
class Law:
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
) -> Law | None:
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
    plain = Law(float(means.std(ddof=1)), len(means), level)
    if reach is None:
        return plain
    return Law(plain.spread, plain.persons, level, reach / plain.reach(len(means)))
