"""How an office block is cut up: corridors, cross corridors, a lobby, and cells along them."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

STOREY = 14.5  # wanted depth of a corridor with the rooms on both its sides [m]
CORRIDOR = (2.0, 2.6)  # width [m]
LOBBY = (6.0, 8.0)  # width [m]
CROSSING_EVERY = 40.0  # along the corridors [m]
LEAST_CELL = 2.8  # width of the narrowest room [m]
WISHES = ((3.0, 3.9), (4.8, 6.5), (7.0, 9.5))  # widths that rooms would like to have [m]
ODDS = (0.55, 0.30, 0.15)  # of these


class Cell(NamedTuple):
    """A rectangle [m] that becomes a room.

    Attributes:
        x1: West [m].
        y1: South [m].
        x2: East [m].
        y2: North [m].
        wing: Number of its corridor, from 0 in the south.
        door_north: The corridor lies north of it, else south.
        facade: The wall opposite to the door is an outer wall.
    """

    x1: float
    y1: float
    x2: float
    y2: float
    wing: int
    door_north: bool
    facade: bool

    @property
    def width(self) -> float:
        """Along the corridor [m]."""
        return self.x2 - self.x1

    @property
    def depth(self) -> float:
        """Away from the corridor [m]."""
        return self.y2 - self.y1

    @property
    def area(self) -> float:
        """Of its floor [m^2]."""
        return self.width * self.depth

    @property
    def door_y(self) -> float:
        """Of the wall at the corridor [m]."""
        return self.y2 if self.door_north else self.y1

    def box(self, left: float, right: float, near: float, far: float) -> Box:
        """A rectangle in it, by its gaps [m] to the sides, to the corridor and opposite."""
        south, north = (far, near) if self.door_north else (near, far)
        ends = self.x1 + left, self.y1 + south, self.x2 - right, self.y2 - north
        return tenths(ends[0]), tenths(ends[1]), tenths(ends[2]), tenths(ends[3])


Box = tuple[float, float, float, float]  # x1, y1, x2, y2 [m]


@dataclass(frozen=True)
class Layout:
    """An office block before its rooms have names.

    Attributes:
        width: West to east [m].
        depth: South to north [m].
        corridors: From facade to facade, one for each wing.
        crossings: Pieces of cross corridors between two wings, south to north in each.
        lobby: Between the southern facade and the first corridor.
        cells: All other rooms.
    """

    width: float
    depth: float
    corridors: tuple[Box, ...]
    crossings: tuple[tuple[Box, ...], ...]
    lobby: Box
    cells: tuple[Cell, ...]


def tenths(value: float) -> float:
    """Walls lie on a lattice of 0.1 m."""
    return round(float(value), 1)


def lay_out(width: float, depth: float, rng: np.random.Generator) -> Layout:
    """Cut up a rectangle.

    Args:
        width: West to east [m], at least 24.
        depth: South to north [m], at least 12.
        rng: Source of luck.
    """
    width, depth = tenths(width), tenths(depth)
    wings = max(1, int(depth / STOREY + 0.65))
    edges = [tenths(depth * wing / wings) for wing in range(wings + 1)]
    corridors = []
    for south, north in itertools.pairwise(edges):
        wide = tenths(rng.uniform(*CORRIDOR))
        low = tenths((south + north - wide) / 2)
        corridors.append((0.0, low, width, tenths(low + wide)))
    crossings = _crossings(corridors, width, rng) if wings > 1 else ()
    lobby = _lobby(corridors[0], width, rng)
    cells = tuple(_cells(edges, corridors, crossings, lobby, rng))
    return Layout(width, depth, tuple(corridors), crossings, lobby, cells)


def _crossings(
    corridors: list[Box], width: float, rng: np.random.Generator
) -> tuple[tuple[Box, ...], ...]:
    """Cross corridors evenly along the others, each a few metres off."""
    count = max(1, round(width / CROSSING_EVERY))
    found = []
    for number in range(count):
        wide = tenths(rng.uniform(*CORRIDOR))
        middle = width * (number + 0.5) / count + rng.uniform(-0.1, 0.1) * width / count
        x1 = tenths(middle - wide / 2)
        found.append(
            tuple(
                (x1, south[3], tenths(x1 + wide), north[1])
                for south, north in itertools.pairwise(corridors)
            )
        )
    return tuple(found)


def _lobby(corridor: Box, width: float, rng: np.random.Generator) -> Box:
    wide = tenths(rng.uniform(*LOBBY))
    x1 = tenths(rng.uniform(0.4, 0.6) * width - wide / 2)
    return x1, 0.0, tenths(x1 + wide), corridor[1]


def _cells(
    edges: list[float],
    corridors: list[Box],
    crossings: tuple[tuple[Box, ...], ...],
    lobby: Box,
    rng: np.random.Generator,
) -> Iterator[Cell]:
    """Rooms south and north of each corridor, from west to east."""
    last = len(corridors) - 1
    across = [(pieces[0][0], pieces[0][2]) for pieces in crossings]
    for wing, (_, low, width, high) in enumerate(corridors):
        for y1, y2, door_north in ((edges[wing], low, True), (high, edges[wing + 1], False)):
            facade = wing == (0 if door_north else last)
            gaps = across if not facade else [(lobby[0], lobby[2])] if door_north else []
            bounds = [0.0, *(x for gap in gaps for x in gap), width]
            for start, end in zip(bounds[::2], bounds[1::2], strict=True):
                cuts = _cuts(start, end, rng)
                for x1, x2 in itertools.pairwise(cuts):
                    yield Cell(x1, y1, x2, y2, wing, door_north, facade)


def _cuts(start: float, end: float, rng: np.random.Generator) -> list[float]:
    """Where partitions stand: rooms as wide as drawn from `WISHES`, made to fit."""
    length, wishes = end - start, list[float]()
    while sum(wishes) < length:
        wishes.append(rng.uniform(*WISHES[rng.choice(len(WISHES), p=ODDS)]))
    if sum(wishes) - length > wishes[-1] / 2 or len(wishes) * (LEAST_CELL + 0.1) > length:
        wishes = wishes[:-1] or wishes
    spare = np.array(wishes) - LEAST_CELL
    widths = LEAST_CELL + 0.1 + (length - (LEAST_CELL + 0.1) * len(spare)) * spare / spare.sum()
    return [tenths(start + reach) for reach in (0.0, *np.cumsum(widths))]
