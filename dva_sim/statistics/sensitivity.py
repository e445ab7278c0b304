"""Main effects of factors, and their two-way interactions."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dva_sim.statistics.bands import band
from dva_sim.statistics.persons import RESAMPLES, Floats, Interval, person_means


@dataclass(frozen=True)
class Effect:
    """A main effect, or an interaction of two factors.

    Attributes:
        factors: The factor; or the two.
        levels: Level of each factor that is judged.
        baselines: Beside which, the first level of each.
        interval: Interval of the effect. Main effect: difference of the level from the baseline,
            averaged over all settings of the other factors. Interaction: growth of that difference
            as the second factor goes from its baseline to its level. The ends hold for all effects
            at once.
    """

    factors: tuple[str, ...]
    levels: tuple[Any, ...]
    baselines: tuple[Any, ...]
    interval: Interval

    @property
    def is_interaction(self) -> bool:
        """True for an interaction of two factors."""
        return len(self.factors) == 2

    @property
    def is_found(self) -> bool:
        """True if the effect differs significantly from zero; False where nothing can be told."""
        return self.interval.low > 0 or self.interval.high < 0


def factorial_effects(
    levels: Mapping[str, ArrayLike],
    values: ArrayLike,
    person: ArrayLike,
    resamples: int = RESAMPLES,
) -> tuple[Effect, ...]:
    """Main effects and two-way interactions of a full factorial, with simultaneous intervals.

    Each effect is a contrast of a person's cell means, so that persons are compared with
    themselves. A person with an empty cell is left out of the contrasts that need it, and
    where nobody has all (the design is not a full factorial) an effect is nan.

    Args:
        levels: For each factor, the level of each run `(n,)`; the first to appear is the
            baseline.
        values: One value per run `(n,)`, nan where missing.
        person: Person of each run `(n,)`.
        resamples: Number of bootstrap resamples.

    Returns:
        Main effects in the order of the factors, then interactions.

    References:
        Montgomery, Design and Analysis of Experiments, chapter 5 (factorial designs).
    """
    known = {name: list(dict.fromkeys(np.asarray(of).tolist())) for name, of in levels.items()}
    grid = _grid(levels, known, np.asarray(values, dtype=float), np.asarray(person))
    contrasts = [*_main_effects(grid, known), *_interactions(grid, known)]
    if not contrasts:
        return ()
    matrix = np.column_stack([values for *_, values in contrasts])
    found = band(matrix, resamples=resamples)
    counts = np.isfinite(matrix).sum(axis=0)
    ends = zip(found.mean, found.low, found.high, counts, strict=True)
    return tuple(
        Effect(names, at, beside, Interval(float(mean), float(low), float(high), int(n)))
        for (names, at, beside, _), (mean, low, high, n) in zip(contrasts, ends, strict=True)
    )


_Contrast = tuple[tuple[str, ...], tuple[Any, ...], tuple[Any, ...], Floats]


def _grid(
    levels: Mapping[str, ArrayLike],
    known: Mapping[str, list[Any]],
    values: Floats,
    person: NDArray[Any],
) -> Floats:
    """Persons' cell means `(levels of factor 1, ..., persons)`; nan where no run is."""
    persons, owner = np.unique(person, return_inverse=True)
    codes = [[known[name].index(v) for v in np.asarray(levels[name]).tolist()] for name in known]
    grid = np.full((*(len(of) for of in known.values()), len(persons)), np.nan)
    at, means = person_means(values, np.ravel_multi_index((*codes, owner), grid.shape))
    grid.flat[at] = means
    return grid


def _main_effects(grid: Floats, known: Mapping[str, list[Any]]) -> Iterator[_Contrast]:
    for axis, (name, of) in enumerate(known.items()):
        means = _averaged(grid, (axis,))
        for i in range(1, len(of)):
            yield (name,), (of[i],), (of[0],), means[i] - means[0]


def _interactions(grid: Floats, known: Mapping[str, list[Any]]) -> Iterator[_Contrast]:
    for (one, first), (two, second) in itertools.combinations(enumerate(known), 2):
        means, a, b = _averaged(grid, (one, two)), known[first], known[second]
        for i, j in itertools.product(range(1, len(a)), range(1, len(b))):
            values = means[i, j] - means[0, j] - means[i, 0] + means[0, 0]
            yield (first, second), (a[i], b[j]), (a[0], b[0]), values


def _averaged(grid: Floats, keep: tuple[int, ...]) -> Floats:
    """Means over all factors but some; nan where a cell is missing."""
    others = tuple(axis for axis in range(grid.ndim - 1) if axis not in keep)
    return np.asarray(grid.mean(axis=others))
