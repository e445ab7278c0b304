"""Sobol's indices: the share of the outcome's variance that each continuous factor explains."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dva_sim.statistics.persons import LEVEL, Floats, Interval, draws, person_means

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
    and the point `B`. The interval comes from resampling blocks and persons at once.

    Args:
        levels: For each factor, its value in each run `(n,)`.
        values: One value per run `(n,)`, nan where missing.
        person: Person of each run `(n,)`.
        cell: Cell of each run `(n,)`, ascending in the order of the design.
        resamples: Number of bootstrap resamples over blocks and persons.

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
