"""A site for air and water: spaces, the openings between them, and the space of each place."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dva_sim.worlds.maps import OccupancyGrid
from dva_sim.worlds.site import Site

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

LONGEST = 12.0  # longer corridors are divided, as they do not fill evenly from end to end [m]
NO_SPACE = -1  # index of cells in no space
KEPT_PLACES = 64  # places whose position in the building is cached


@dataclass(frozen=True, eq=False)
class Spaces:
    """Bodies of air with a level floor, and the openings between them.

    Attributes:
        area: Area of the floors, shape `(n,)` [m^2].
        ceiling: Heights, shape `(n,)` [m].
        a: Index of the space on one side of each opening, shape `(k,)`.
        b: On the other side; `n` stands for outdoors.
        width: Width of the openings [m].
        top: Height of their lintels [m].
    """

    area: Floats
    ceiling: Floats
    a: Integers
    b: Integers
    width: Floats
    top: Floats

    @property
    def count(self) -> int:
        """Number of compartments."""
        return len(self.area)


@dataclass(frozen=True, eq=False)
class Building:
    """The spaces of a site, and where they are.

    Attributes:
        spaces: Its bodies of air; long ones are parted.
        grid: Grid of the cells.
        labels: The space of each cell, or `NO_SPACE`, shape `(rows, columns)`.
    """

    spaces: Spaces
    grid: OccupancyGrid
    labels: NDArray[np.int16]

    @cached_property
    def space_at(self) -> Callable[[float, float], int]:
        """Index of the space around a point [m], or `NO_SPACE`; all hazards ask of one in turn."""
        look_up = self.grid.look_up
        labels = self.labels
        return lru_cache(KEPT_PLACES)(lambda x, y: int(look_up(labels, x, y, NO_SPACE)))


class SitePoints:
    """Points of a picture, and their grid cells and spaces.

    Args:
        building: Building of the points.
        points: Shape `(..., 2)` [m].

    Attributes:
        spaces: Index of the space around each point, or `NO_SPACE`.
    """

    def __init__(self, building: Building, points: Floats) -> None:
        self.points = points
        origin = building.grid.origin
        resolution = building.grid.resolution
        cos = math.cos(origin.heading)
        sin = math.sin(origin.heading)
        dx = points[..., 0] - origin.x
        dy = points[..., 1] - origin.y
        columns = np.floor((cos * dx + sin * dy) / resolution).astype(np.int64)
        rows = np.floor((cos * dy - sin * dx) / resolution).astype(np.int64)
        height, width = building.labels.shape
        self._inside = (rows >= 0) & (rows < height) & (columns >= 0) & (columns < width)
        self._cells = rows * self._inside, columns * self._inside
        self.spaces = self.of(building.labels)

    def of(self, cells: NDArray[np.integer]) -> Integers:
        """Return the value of the building's grid at each point; -1 beyond it."""
        return np.where(self._inside, cells[self._cells], -1).astype(np.int64)


def building_of(site: Site) -> Building:
    """Return the building of a site; copies of a site share it."""
    return site.kept("building", lambda: _building(site))


def _building(site: Site) -> Building:
    parting = _Parting(site)
    openings = [o for o in site.openings if o.height > 0.0]
    ends = [
        parting.sides(o.room_a, o.room_b, (o.x1 + o.x2) / 2, (o.y1 + o.y2) / 2) for o in openings
    ]
    joints = np.array([*ends, *((a, b) for a, b, _ in parting.cuts)], np.int64).reshape(-1, 2)
    ceiling = np.array(parting.ceiling)
    tops = [ceiling[a] for a, _, _ in parting.cuts]
    spaces = Spaces(
        area=np.array(parting.area),
        ceiling=ceiling,
        a=joints[:, 0],
        b=np.where(joints[:, 1] == NO_SPACE, len(ceiling), joints[:, 1]),
        width=np.array([*(o.width for o in openings), *(width for _, _, width in parting.cuts)]),
        top=np.array([*(o.height for o in openings), *tops]),
    )
    return Building(spaces, site.grid, parting.labels)


class _Cut(NamedTuple):
    """Cut of a compartment.

    Attributes:
        first: Index of its first part.
        parts: Number of parts.
        axis: 0 if rows are cut, 1 for columns.
        low: Start of the cut [cells].
        length: Length of a part [cells].
    """

    first: int
    parts: int
    axis: int
    low: int
    length: float


class _Parting:
    """Compartments cut into parts no longer than `LONGEST`.

    Attributes:
        area: Area of the parts [m^2].
        ceiling: Ceiling height of the parts [m].
        cuts: Two parts and the width between them [m], for each cut.
        labels: The part of each cell.
    """

    def __init__(self, site: Site) -> None:
        self._site = site
        self._of: dict[str, _Cut] = {}
        self.area: list[float] = []
        self.ceiling: list[float] = []
        self.cuts: list[tuple[int, int, float]] = []
        whole = site.partition.labels
        self.labels = np.full(whole.shape, NO_SPACE, np.int16)
        cells = np.flatnonzero(whole != NO_SPACE)
        order = np.argsort(whole.ravel()[cells], kind="stable")
        numbers = np.arange(len(site.compartments) + 1)
        bounds = np.searchsorted(whole.ravel()[cells][order], numbers)
        for number, compartment in enumerate(site.compartments):
            members = cells[order[bounds[number] : bounds[number + 1]]]
            rows, columns = np.divmod(members, whole.shape[1])
            self._of[compartment.name] = self._cut(
                rows, columns, compartment.area, compartment.ceiling
            )

    def _cut(self, rows: Integers, columns: Integers, area: float, ceiling: float) -> _Cut:
        """Return one compartment cut across its longer side."""
        first = len(self.area)
        resolution = self._site.grid.resolution
        axis = 0 if _span(rows) > _span(columns) else 1
        along = columns if axis else rows
        count = max(1, math.ceil(_span(along) * resolution / LONGEST - 0.1))
        low = int(along.min()) if len(along) else 0
        cut = _Cut(first, parts=count, axis=axis, low=low, length=_span(along) / count)
        part = np.minimum((along - low) // cut.length, count - 1).astype(np.int64)
        self.labels[rows, columns] = first + part
        sizes = np.bincount(part, minlength=count)
        for number in range(count):
            self.area.append(area * max(1, int(sizes[number])) / max(1, len(along)))
            self.ceiling.append(ceiling)
            if number:
                across = int((along == low + math.ceil(number * cut.length)).sum())
                self.cuts.append((first + number - 1, first + number, across * resolution))
        return cut

    def sides(self, a: str, b: str | None, x: float, y: float) -> tuple[int, int]:
        """Return the parts that an opening at a point [m] joins."""
        return self._nearest(a, x, y), NO_SPACE if b is None else self._nearest(b, x, y)

    def _nearest(self, name: str, x: float, y: float) -> int:
        """Return the part of a compartment nearest to a point [m]."""
        cut = self._of[name]
        along = self._site.grid.to_cell(x, y)[cut.axis]
        return cut.first + min(max(0, int((along - cut.low) // cut.length)), cut.parts - 1)


def _span(cells: Integers) -> int:
    """Return the number of rows or columns that cells span."""
    return int(cells.max() - cells.min()) + 1 if len(cells) else 1
