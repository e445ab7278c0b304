"""The simulated person as the cluster on which every interval is based."""

from __future__ import annotations

import functools
import math
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
        high: Upper end; nan where there are too few persons.
        n_persons: Number of persons.
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
    """Return each person's mean over the trials with a value.

    Args:
        values: One value per run `(n,)`, nan where missing.
        person: Person of each run `(n,)`.

    Returns:
        The persons with a value `(m,)`, sorted, and their means `(m,)`.
    """
    numbers = np.asarray(values, dtype=float)
    person_of_row = np.asarray(person)
    is_finite = np.isfinite(numbers)
    persons, code = np.unique(person_of_row[is_finite], return_inverse=True)
    totals = np.bincount(code, weights=numbers[is_finite], minlength=len(persons))
    return persons, totals / np.bincount(code, minlength=len(persons))


def paired_means(a: ArrayLike, b: ArrayLike, person: ArrayLike) -> tuple[Floats, Floats]:
    """Return each person's means of two treatments, over the trials with both values.

    Returns:
        Means of `a` `(m,)` and of `b` `(m,)`, person by person.
    """
    first = np.asarray(a, dtype=float)
    second = np.asarray(b, dtype=float)
    both = np.isfinite(first) & np.isfinite(second)
    means = person_means(np.where(both, first, np.nan), person)[1]
    return means, person_means(np.where(both, second, np.nan), person)[1]


def students_t(level: float, n: int) -> float:
    """Return Student's two-sided quantile for `n` persons; nan with fewer than two."""
    from scipy import special

    return float(special.stdtrit(n - 1, (1 + level) / 2)) if n > 1 else math.nan


@functools.lru_cache(maxsize=8)
def draws(persons: int, resamples: int, seed: int = 1) -> Floats:
    """Return the number of times that each resample draws each person, `(resamples, persons)`."""
    rng = np.random.Generator(np.random.PCG64(seed))
    chances = np.full(persons, 1 / persons)
    weights = rng.multinomial(persons, chances, size=resamples).astype(float)
    weights.flags.writeable = False
    return weights
