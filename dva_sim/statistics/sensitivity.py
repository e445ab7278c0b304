"""What each factor does on average, and where one changes what another does.

Which of several continuous factors the outcome varies with: Sobol's indices.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dva_sim.statistics.bands import band
from dva_sim.statistics.persons import LEVEL, RESAMPLES, Floats, Interval, draws, person_means


@dataclass(frozen=True)
class Effect:
    """A main effect, or an interaction of two factors.

    Attributes:
        factors: The factor; or the two.
        levels: Which level of each is judged.
        baselines: Beside which, the first level of each.
        interval: Of a main effect, the difference of the level from the baseline, averaged
            over all settings of the other factors; of an interaction, by how much that
            difference grows as the second factor goes from its baseline to its level. Its
            ends hold for all effects at once.
    """

    factors: tuple[str, ...]
    levels: tuple[Any, ...]
    baselines: tuple[Any, ...]
    interval: Interval

    @property
    def is_interaction(self) -> bool:
        """Whether it is of two factors."""
        return len(self.factors) == 2

    @property
    def is_found(self) -> bool:
        """Whether it can be told from zero; False where nothing can be told."""
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
        person: Whose run it was `(n,)`.
        resamples: How many times persons are drawn.

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


SOBOL_RESAMPLES = 1000


@dataclass(frozen=True)
class SobolIndex:
    """One factor's part in the variance of the outcome over the design's ranges.

    Attributes:
        factor: Its name.
        first: Share of the variance that goes if the factor alone is fixed.
        total: Share that stays if all others are fixed: with all its interactions.
    """

    factor: str
    first: Interval
    total: Interval


def sobol_indices(
    levels: Mapping[str, ArrayLike],
    values: ArrayLike,
    person: ArrayLike,
    cell: ArrayLike,
    resamples: int = SOBOL_RESAMPLES,
) -> tuple[SobolIndex, ...]:
    """First-order and total indices from the runs of a design `{saltelli: N}`.

    The outcome of a cell is the mean over persons. The design has `N` blocks of `d + 2`
    cells for `d` factors: a point `A`, for each factor `A` with that factor taken from `B`,
    and the point `B`. The interval comes from drawing blocks and persons anew, both at once.

    Args:
        levels: For each factor, its value in each run `(n,)`.
        values: One value per run `(n,)`, nan where missing.
        person: Whose run it was `(n,)`.
        cell: Which cell the run is of `(n,)`, ascending in the order of the design.
        resamples: How many times blocks and persons are drawn.

    Raises:
        ValueError: the cells are not such a design.

    References:
        Saltelli et al., Comput. Phys. Commun. 181 (2010) 259-270 (design, first order); Jansen,
        Comput. Phys. Commun. 117 (1999) 35-43 (total); Owen, Ann. Appl. Stat. 1 (2007) 386-411
        (drawing rows and columns).
    """
    table = _table(_blocks(levels, np.asarray(cell)), values, person, cell)
    blocks, persons = len(table), table.shape[2]
    there = np.isfinite(table).astype(float)
    filled = np.where(there, table, 0.0)
    whole = _indices(filled, there, np.ones(blocks), np.ones(persons))
    chosen = zip(draws(blocks, resamples), draws(persons, resamples, seed=2), strict=True)
    drawn = np.array([_indices(filled, there, rows, columns) for rows, columns in chosen])
    low, high = np.nanquantile(drawn, [(1 - LEVEL) / 2, (1 + LEVEL) / 2], axis=0)
    first, total = (
        [Interval(float(x), float(lo), float(hi), persons) for x, lo, hi in zip(*part, strict=True)]
        for part in np.stack([whole, low, high], axis=1)
    )
    return tuple(SobolIndex(*each) for each in zip(levels, first, total, strict=True))


def _table(blocks: NDArray[Any], values: ArrayLike, person: ArrayLike, cell: ArrayLike) -> Floats:
    """Each person's mean in each cell `(N, d + 2, persons)`, without blocks nobody completed."""
    persons, who = np.unique(person, return_inverse=True)
    place = np.searchsorted(blocks.ravel(), np.asarray(cell)) * len(persons) + who
    known, means = person_means(values, place)
    table = np.full(blocks.size * len(persons), np.nan)
    table[known] = means
    table = table.reshape(*blocks.shape, len(persons))
    complete = np.isfinite(table).any(axis=2)
    return np.asarray(table[np.all(complete, axis=1)])


def _blocks(levels: Mapping[str, ArrayLike], cell: NDArray[Any]) -> NDArray[Any]:
    """Cells by block `(N, d + 2)`.

    Raises:
        ValueError: they are not a point, its neighbours, and another point.
    """
    cells, first = np.unique(cell, return_index=True)
    factors = len(levels)
    wrong = "Sobol's indices need a design `{saltelli: N}`, cells in its order"
    if factors == 0 or len(cells) % (factors + 2):
        raise ValueError(wrong)
    points = np.column_stack([np.asarray(of, dtype=float)[first] for of in levels.values()])
    points = points.reshape(-1, factors + 2, factors)
    a, mixed, b = points[:, :1], points[:, 1:-1], points[:, -1:]
    if not np.array_equal(mixed, np.where(np.eye(factors, dtype=bool), b, a)):
        raise ValueError(wrong)
    return cells.reshape(-1, factors + 2)


def _indices(filled: Floats, there: Floats, rows: Floats, columns: Floats) -> Floats:
    """First-order and total indices `(2, d)` of `(N, d + 2, persons)`, weighted.

    A block of which a cell is of nobody drawn is left out.
    """
    weight = there @ columns
    with np.errstate(divide="ignore", invalid="ignore"):
        rows = np.where((weight > 0).all(axis=1), rows, 0.0)
        y = np.where(weight > 0, filled @ columns / weight, 0.0)
        share = rows / rows.sum()
        centre = (share @ y[:, [0, -1]]).mean()
        a, mixed, b = y[:, :1] - centre, y[:, 1:-1] - centre, y[:, -1:] - centre
        variance = float(share @ (a**2 + b**2)[:, 0]) / 2
        first = share @ (b * (mixed - a)) / variance
        total = share @ (a - mixed) ** 2 / (2 * variance)
    return np.array([first, total])
