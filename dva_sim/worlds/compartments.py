"""Bodies of air and what joins them: the rooms of a drawn site, blocks of floor on a bare map."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from dva_sim.kernel.errors import ConfigError
from dva_sim.worlds.maps import OccupancyGrid, cells_inside, segments
from dva_sim.worlds.site_parts import CEILING, Compartment, Lookup, Opening, Room, beyond

Floats = NDArray[np.float64]
Labels = NDArray[np.int16]

NO_COMPARTMENT = -1  # label of cells in no compartment
BLOCK = 8.0  # side of a block of a bare map's floor [m]
MAX_BLOCKS = 2000  # maximum blocks; a larger floor has larger ones
MAX_PIECES = 4000  # maximum pieces of a floor: each is compared with each
MIN_BLOCK = 4.0  # area below which a piece joins its neighbour [m^2]
MIN_BORDER = 0.3  # shorter openings without a wall are drawing errors [m]
TOUCHING_M = 0.05  # rooms this near each other count as touching [m]


class FloorPartition(NamedTuple):
    """Compartments, what joins them, and the compartment of each cell, or `NO_COMPARTMENT`."""

    compartments: tuple[Compartment, ...]
    openings: tuple[Opening, ...]
    labels: Labels


# --- drawn sites -----------------------------------------------------------------------
def of_rooms(
    grid: OccupancyGrid,
    rooms: Sequence[Room],
    walls: Floats,
    ways: Sequence[tuple[Sequence[float], float, str]],
) -> FloorPartition:
    """Return one compartment for each room that is not outdoors.

    Args:
        grid: Grid of the cells.
        rooms: All rooms; where two overlap, the first counts.
        walls: Segments `(n, 4)` [m].
        ways: Doors and exits: ends x1, y1, x2, y2 [m], height [m], kind.
    """
    indoor = [room for room in rooms if not room.outdoor]
    compartments = [Compartment(r.name, _area(r), r.ceiling, r.polygon) for r in indoor]
    lookup = Lookup(rooms)
    doors = [opening for passage in ways for opening in _passage(lookup, *passage)]
    borders = _borders(indoor, walls, [ends for ends, _, _ in ways])
    return FloorPartition(tuple(compartments), (*doors, *borders), _labels(grid, indoor))


def _area(room: Room) -> float:
    return _enclosed(room.polygon) - sum(map(_enclosed, room.holes))


def _enclosed(ring: Floats) -> float:
    x, y = ring.T
    return float(abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2)


def _passage(
    rooms: Lookup[Room], ends: Sequence[float], height: float, kind: str
) -> Iterator[Opening]:
    """Yield a door with the rooms on both sides; none if it joins a room to itself."""
    x1, y1, x2, y2 = ends
    width = math.hypot(x2 - x1, y2 - y1)
    x = (x1 + x2) / 2
    y = (y1 + y2) / 2
    left = math.atan2(x2 - x1, y1 - y2)
    sides = [beyond(rooms, x, y, heading) for heading in (left, left + math.pi)]
    a, b = (None if room is None or room.outdoor else room.name for room in sides)
    if a is None:
        a = b
        b = None
    if a is not None and a != b:
        yield Opening(
            room_a=a, room_b=b, x1=x1, y1=y1, x2=x2, y2=y2, width=width, height=height, kind=kind
        )


def _borders(
    rooms: Sequence[Room], walls: Floats, doors: Sequence[Sequence[float]]
) -> Iterator[Opening]:
    """Yield straight pieces of border between two rooms without a wall or a door."""
    areas = [room.area for room in rooms]
    lines = np.vstack([walls, np.reshape(doors, (-1, 4))]).reshape(-1, 2, 2)
    barriers = [shapely.LineString(line).buffer(TOUCHING_M) for line in lines]
    near = shapely.STRtree(barriers)
    wide = [area.buffer(TOUCHING_M, join_style="mitre") for area in areas]
    first, second = shapely.STRtree(areas).query(wide, predicate="intersects")
    for a, b in sorted((int(a), int(b)) for a, b in zip(first, second, strict=True) if a < b):
        shared = areas[a].boundary & wide[b]
        closed: Any = shapely.union_all(near.geometries[near.query(shared)])
        for ends in _straight(shared - closed).tolist():
            x1, y1, x2, y2 = _up_to(closed, ends)
            width = math.hypot(x2 - x1, y2 - y1)
            if width >= MIN_BORDER:
                height = min(rooms[a].ceiling, rooms[b].ceiling)
                names = rooms[a].name, rooms[b].name
                yield Opening(
                    *names, x1=x1, y1=y1, x2=x2, y2=y2, width=width, height=height, kind="border"
                )


def _straight(lines: Any) -> Floats:
    """Return the straight pieces of some lines, `(n, 4)` [m]."""
    parts = [part for part in shapely.get_parts(lines) if part.geom_type == "LineString"]
    if not parts:
        return np.empty((0, 4))
    merged: Any = shapely.line_merge(shapely.multilinestrings(parts))
    return segments(merged.simplify(TOUCHING_M / 5))


def _up_to(closed: Any, ends: Sequence[float]) -> tuple[float, float, float, float]:
    """Return an opening lengthened where it was cut `TOUCHING_M` a wall."""
    a = np.array(ends[:2])
    b = np.array(ends[2:])
    along = (b - a) / np.hypot(*(b - a)) * TOUCHING_M
    a, b = (
        end + step if closed.distance(shapely.Point(end)) < 1e-6 else end
        for end, step in ((a, -along), (b, along))
    )
    return float(a[0]), float(a[1]), float(b[0]), float(b[1])


def _labels(grid: OccupancyGrid, rooms: Sequence[Room]) -> Labels:
    """Return the compartment of each cell."""
    labels = np.full(grid.cells.shape, NO_COMPARTMENT, np.int16)
    for number, room in reversed(list(enumerate(rooms))):
        window = grid.window(room.polygon)
        labels[window][cells_inside(grid, segments(room.area), window)] = number
    return labels


# --- bare maps -------------------------------------------------------------------------
def of_floor(grid: OccupancyGrid, floor: NDArray[np.bool_]) -> FloorPartition:
    """Return blocks of a floor without rooms, about `BLOCK` wide, parted where a wall parts them.

    Args:
        grid: Grid of the cells.
        floor: Cells of the floor, shape `(rows, columns)`.
    """
    labels = _joined(_pieces(floor, grid.resolution), grid.resolution)
    sizes = np.bincount(labels[labels >= 0], minlength=labels.max() + 1) * grid.resolution**2
    blocks = tuple(
        Compartment(f"block {number}", float(size), CEILING, None)
        for number, size in enumerate(sizes, 1)
    )
    return FloorPartition(blocks, tuple(_seams(grid, labels, blocks)), labels)


def _pieces(floor: NDArray[np.bool_], resolution: float) -> Labels:
    """Return the connected parts of the floor within each block of a lattice."""
    from scipy.ndimage import label  # late: start-up

    labels = np.full(floor.shape, NO_COMPARTMENT, np.int16)
    total = 0
    across = max(BLOCK / resolution, math.sqrt(np.count_nonzero(floor) / MAX_BLOCKS))
    rows, columns = (_cuts(length, across) for length in floor.shape)
    for top, bottom in itertools.pairwise(rows):
        for left, right in itertools.pairwise(columns):
            part, count = label(floor[top:bottom, left:right])
            labels[top:bottom, left:right][part > 0] = part[part > 0] + (total - 1)
            total += count
            if total > MAX_PIECES:
                raise ConfigError(f"the floor of a map has more than {MAX_PIECES:,} pieces")
    return labels


def _cuts(length: int, across: float) -> list[int]:
    """Return where `length` cells are cut into blocks of equal length, about `across`."""
    blocks = max(1, round(length / across))
    return [round(length * number / blocks) for number in range(blocks + 1)]


def _joined(labels: Labels, resolution: float) -> Labels:
    """Merge pieces that are too small into the neighbour with the longest shared border."""
    sizes = np.bincount(labels[labels >= 0]) * resolution**2
    borders = _borders_between(labels, len(sizes))
    owner = np.arange(len(sizes))
    while len(small := np.flatnonzero((sizes < MIN_BLOCK) & borders.any(axis=1))):
        piece = small[np.argmin(sizes[small])]
        taker = int(np.argmax(borders[piece]))
        sizes[taker] += sizes[piece]
        borders[taker] += borders[piece]
        borders[:, taker] += borders[:, piece]
        borders[piece] = 0
        borders[:, piece] = 0
        borders[taker, taker] = 0
        owner[owner == piece] = taker
    _, number = np.unique(owner, return_inverse=True)
    return np.where(labels >= 0, number[labels], NO_COMPARTMENT).astype(np.int16)


def _borders_between(labels: Labels, count: int) -> NDArray[np.int64]:
    """Count the cell edges that two pieces share, shape `(count, count)`."""
    borders = np.zeros((count, count), np.int64)
    for a, b in ((labels[1:], labels[:-1]), (labels[:, 1:], labels[:, :-1])):
        touch = (a >= 0) & (b >= 0) & (a != b)
        np.add.at(borders, (a[touch], b[touch]), 1)
    return borders + borders.T


def _seams(grid: OccupancyGrid, labels: Labels, blocks: Sequence[Compartment]) -> Iterator[Opening]:
    """Yield each straight run of cell edges between the same two blocks."""
    for turned, cells in ((False, labels), (True, labels.T)):
        low = cells[:-1].astype(np.int64)
        high = cells[1:].astype(np.int64)
        code = np.where((low >= 0) & (high >= 0) & (low != high), low * len(blocks) + high, -1)
        starts = np.diff(code, axis=1, prepend=-1) != 0
        for row, left in zip(*np.nonzero(starts & (code >= 0)), strict=True):
            run = np.flatnonzero(code[row, left:] != code[row, left])
            right = left + (run[0] if len(run) else code.shape[1] - left)
            width = float(right - left) * grid.resolution
            if width < MIN_BORDER:
                continue
            ends = ((row + 1, left), (row + 1, right))
            (x1, y1), (x2, y2) = (grid.to_xy(*(e[::-1] if turned else e)).tolist() for e in ends)
            a, b = divmod(int(code[row, left]), len(blocks))
            names = blocks[min(a, b)].name, blocks[max(a, b)].name
            yield Opening(
                *names, x1=x1, y1=y1, x2=x2, y2=y2, width=width, height=CEILING, kind="border"
            )
