"""Ways through a site: short, and away from walls where there is room."""

from __future__ import annotations

import math
import weakref
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from dva_sim.worlds.line_of_sight import Sight
from dva_sim.worlds.maps import OccupancyGrid
from dva_sim.worlds.site import Site

CELL = 0.2  # side of a planning cell [m]
COMFORT = 1.0  # distance to walls below which a path costs more [m]
SHYNESS = 4.0  # factor of that cost right at a wall
STEP = 0.25  # distance between the points of a finished path [m]
SNAP = 1.5  # distance within which a planning cell is looked for around a start or goal [m]
ROUNDS = 20  # rounds of smoothing
SPARE = 0.30  # minimum distance of a rounded corner to a wall on top of the clearance [m]
KEPT_FIELDS = 256
KEPT_PATHS = 2048
KEPT_MAPS = 4
KEPT_NODES = 2**24  # maximum nodes of all cached fields of a map together, 12 bytes each
KEPT_AROUND = 2**20  # likewise of a map with obstacles, which is soon another one

Point = tuple[float, float]
Floats = NDArray[np.float64]


class Disc(NamedTuple):
    """A round thing that stands in the way: its middle and radius [m]."""

    x: float
    y: float
    radius: float


class Planner:
    """Plans ways on a site and says what can be seen.

    Planners of one site and clearance share what they have worked out: the field of a goal
    is solved once per process.

    Args:
        clearance: Radius that must fit [m].
    """

    def __init__(self, site: Site, clearance: float) -> None:
        self._roadmap = site.kept(
            ("roadmap", clearance), lambda: Roadmap(site.grid, clearance, Sight(site.walls))
        )

    def path(self, start: Point, goal: Point, avoid: Sequence[Disc] = ()) -> Floats | None:
        """Return a way from `start` to `goal` [m].

        It keeps the clearance except near ends that are closer to a wall, and runs in the
        middle of doors and corridors.

        Args:
            start: From where.
            goal: Destination [m].
            avoid: Obstacles that the plan of the site does not show. A path around them needs a new
                map, some hundredths of a second: ask only when blocked.

        Returns:
            Points about `STEP` apart, shape `(n, 2)`, or None if no path exists.
        """
        roadmap = self._roadmap.around(tuple(avoid)) if avoid else self._roadmap
        path = roadmap.way(_plain(start), _plain(goal))
        return None if path is None else path.copy()

    def room_at(self, points: Floats) -> Floats:
        """Return the distance from each of many points `(n, 2)` to the nearest wall [m]."""
        return self._roadmap.room_at(points)

    def distance(self, start: Point, goal: Point) -> float:
        """Return the length of that way [m]; infinite if there is none."""
        return self._roadmap.length(_plain(start), _plain(goal))

    def cost(self, start: Point, goal: Point) -> float:
        """Return the length of a way before it is smoothed, a metre near a wall counting more [m].

        Infinite if there is none. Of many goals of one start it is found at once.
        """
        return self._roadmap.cost(_plain(start), _plain(goal))

    def line_of_sight(self, a: Point, b: Point) -> bool:
        """Return True if no wall stands between two places [m]."""
        return self._roadmap.sight.between(a, b)


def _plain(point: Point) -> Point:
    return float(point[0]), float(point[1])


class Roadmap:
    """The free floor as a graph: one node per planning cell, at the roomiest point of it.

    So a door stays passable, and is passed in its middle, wherever it lies on the lattice.

    Args:
        grid: Grid of the cells.
        clearance: Radius that must fit [m].
        sight: From where it can be walked straight to a node.
        room: Clearance of each cell, if obstacles make it other than the grid's [m].
    """

    def __init__(
        self, grid: OccupancyGrid, clearance: float, sight: Sight, room: Floats | None = None
    ) -> None:
        kept_nodes = KEPT_NODES if room is None else KEPT_AROUND
        self._grid = grid
        self._clearance = clearance
        self.sight = sight
        room = grid.clearance if room is None else room
        block = max(1, round(CELL / grid.resolution))
        shape = -(-np.array(grid.cells.shape) // block)
        padding = [(0, int(n * block - k)) for n, k in zip(shape, grid.cells.shape, strict=True)]
        split = np.pad(room, padding).reshape(shape[0], block, shape[1], block)
        blocks = split.swapaxes(1, 2).reshape(shape[0], shape[1], block * block)
        best = blocks.argmax(axis=2)
        rows = np.arange(shape[0])[:, None] * block + best // block
        columns = np.arange(shape[1])[None, :] * block + best % block
        self._room = blocks.max(axis=2)
        self._at = grid.to_xy(rows + 0.5, columns + 0.5)
        self._block = block
        self._graph = self._connect()
        cos = math.cos(grid.origin.heading)
        sin = math.sin(grid.origin.heading)
        self._corner = np.array([grid.origin.x, grid.origin.y])
        self._turn = np.array([[cos, -sin], [sin, cos]]) / grid.resolution
        self._clearances = room.ravel()
        # What is asked for again is kept; ways and lengths by start and goal [m].
        self.around = _cached(self, Roadmap._around, KEPT_MAPS)
        self.way = _cached(self, Roadmap._way, KEPT_PATHS)
        self.length = _cached(self, Roadmap._length, KEPT_PATHS)
        kept = min(KEPT_FIELDS, max(1, kept_nodes // self._room.size))
        self._field_of = _cached(self, Roadmap._field, kept)

    def _around(self, discs: tuple[Disc, ...]) -> Roadmap:
        """Return the roadmap of the floor with some obstacles on it."""
        room = self._grid.clearance.copy()
        rows, columns = room.shape
        for x, y, radius in discs:
            row, column = self._grid.to_cell(x, y)
            reach = math.ceil((radius + COMFORT) / self._grid.resolution)
            top, bottom = np.clip([row - reach, row + reach], 0, rows)
            left, right = np.clip([column - reach, column + reach], 0, columns)
            near = np.mgrid[top:bottom, left:right] + 0.5
            gaps = np.hypot(*np.moveaxis(self._grid.to_xy(*near) - (x, y), -1, 0)) - radius
            here = room[top:bottom, left:right]
            np.minimum(here, np.maximum(gaps, 0.0), out=here)
        return Roadmap(self._grid, self._clearance, self.sight, room)

    def _connect(self) -> Any:
        """Eight neighbours, where their free discs overlap: then nothing is between them."""
        from scipy.sparse import csr_array  # late: start-up

        number = np.arange(self._room.size).reshape(self._room.shape)
        free = self._room >= self._clearance
        pairs = []
        costs = []
        for down, right in ((0, 1), (1, 0), (1, 1), (1, -1)):
            here = np.s_[: len(free) - down, max(0, -right) : free.shape[1] - max(0, right)]
            there = np.s_[down:, max(0, right) : free.shape[1] + min(0, right)]
            length = np.hypot(*np.moveaxis(self._at[there] - self._at[here], -1, 0))
            joined = free[here] & free[there] & (length < self._room[here] + self._room[there])
            price = 0.5 * (_price(self._room[here]) + _price(self._room[there]))
            pairs.append(np.stack([number[here][joined], number[there][joined]]))
            costs.append((length * price)[joined])
        a, b = np.concatenate(pairs, axis=1)
        cost = np.concatenate(costs)
        return _both_ways(csr_array((cost, (a, b)), shape=(free.size, free.size)))

    def _length(self, start: Point, goal: Point) -> float:
        """Return the length of the path [m]; infinite if there is none."""
        path = self.way(start, goal)
        return math.inf if path is None else float(np.hypot(*np.diff(path, axis=0).T).sum())

    def cost(self, start: Point, goal: Point) -> float:
        """Return the cost of the path in the graph: the same in both directions."""
        first = self._node_at(start)
        last = self._node_at(goal)
        if first is None or last is None:
            return math.inf
        return float(self._field_of(first)[0][last])

    def _way(self, start: Point, goal: Point) -> Floats | None:
        first = self._node_at(start)
        last = self._node_at(goal)
        if first is None or last is None:
            return None
        costs, towards = self._field_of(last)
        if math.isinf(costs[first]):
            return None
        chain = [first]
        while chain[-1] != last:
            chain.append(int(towards[chain[-1]]))
        points = np.vstack([start, self._at.reshape(-1, 2)[chain], goal])
        return self._relax(_resample(self._shorten(points)))

    def _field(self, goal: int) -> tuple[Floats, NDArray[np.int32]]:
        """Return the cost from every node to `goal`, and each node's next one on the way there."""
        from scipy.sparse.csgraph import dijkstra  # late: start-up

        costs, towards = dijkstra(self._graph, indices=goal, return_predecessors=True)
        return costs, towards

    def _node_at(self, point: Point) -> int | None:
        """Return the nearest node in sight of a point."""
        # Planning cells whose nodes may be within `SNAP` of the point.
        reach = math.ceil(SNAP / (self._block * self._grid.resolution)) + 1
        here = (at // self._block for at in self._grid.to_cell(*point))
        rows, columns = (
            slice(max(0, min(at - reach, most)), max(0, min(at + reach + 1, most)))
            for at, most in zip(here, self._room.shape, strict=True)
        )
        spots = self._at[rows, columns].reshape(-1, 2)
        gaps = np.hypot(*(spots - point).T)
        free = self._room[rows, columns].ravel() >= self._clearance
        near = np.flatnonzero(free & (gaps <= SNAP))
        for index in near[np.argsort(gaps[near], kind="stable")]:
            if self.sight.between(point, tuple(spots[index].tolist())):
                row, column = divmod(int(index), columns.stop - columns.start)
                return int((rows.start + row) * self._room.shape[1] + columns.start + column)
        return None

    def room_at(self, points: Floats) -> Floats:
        """Return the room at many points `(n, 2)` [m]."""
        column, row = ((points - self._corner) @ self._turn).T.astype(np.intp)
        cells = row * self._grid.cells.shape[1] + column
        return np.asarray(self._clearances.take(cells, mode="clip"))

    def _cost(self, a: Floats, b: Floats) -> float:
        """Cost of the straight line a-b; infinite where it does not keep the clearance."""
        length = math.hypot(b[0] - a[0], b[1] - a[1])
        samples = _points_between(a, b, 2 + int(length / self._grid.resolution))
        room = self.room_at(samples)
        if room[1:-1].min(initial=math.inf) < self._clearance:
            return math.inf
        return length * float(_price(room).sum() / len(room))

    def _shorten(self, points: Floats) -> Floats:
        """Cut corners where the straight line costs no more than the way around."""
        price = _price(self.room_at(points))
        length = np.hypot(*np.diff(points, axis=0).T)
        total = np.r_[0.0, np.cumsum(0.5 * length * (price[1:] + price[:-1]))]
        kept = [0]
        i = 0
        while i < len(points) - 1:
            reach = i + 1
            step = 8
            while step:
                j = min(reach + step, len(points) - 1)
                good = j > reach and self._cost(points[i], points[j]) <= total[j] - total[i]
                reach, step = (j, step * 2) if good else (reach, step // 2)
            kept.append(reach)
            i = reach
        return points[kept]

    def _relax(self, points: Floats) -> Floats:
        """Round the corners: each point moves between its neighbours if room allows."""
        room = np.minimum(self.room_at(points), COMFORT)
        for half in range(2 * ROUNDS):
            these = np.arange(1 + half % 2, len(points) - 1, 2)
            moved = 0.5 * points[these] + 0.25 * (points[these - 1] + points[these + 1])
            new = np.minimum(self.room_at(moved), COMFORT)
            good = new >= np.minimum(0.9 * room[these], self._clearance + SPARE)
            points[these[good]] = moved[good]
        return points


R = TypeVar("R")


def _cached(roadmap: Roadmap, method: Callable[..., R], most: int) -> Callable[..., R]:
    """Return a method that caches its last results.

    A cache of the bound method would form a cycle with the roadmap, and 44 MB of a campus would
    stay until the next full collection of garbage, which a live run makes rarely.
    """
    owner = weakref.ref(roadmap)
    return lru_cache(most)(lambda *args: method(owner(), *args))


def _both_ways(graph: Any) -> Any:
    """Return a graph whose edges are given in one direction each, with both.

    Once for all searches, each of which would turn the graph around again otherwise. Edges of a
    node keep the order in which an undirected search looks at them, which decides between ways
    of the same cost: those that are given before those that are turned around.
    """
    from scipy.sparse import csr_array  # late: start-up

    back = graph.T.tocsr()
    sizes = np.diff(graph.indptr), np.diff(back.indptr)
    rows = [np.repeat(np.arange(graph.shape[0]), size) for size in sizes]
    order = np.argsort(np.concatenate(rows), kind="stable")
    to = np.concatenate([graph.indices, back.indices])[order].astype(np.int32)
    starts = np.r_[0, np.cumsum(sizes[0] + sizes[1])].astype(np.int32)
    costs = np.concatenate([graph.data, back.data])[order]
    return csr_array((costs, to, starts), shape=graph.shape)


def _points_between(a: Floats, b: Floats, count: int) -> Floats:
    """Interpolate between two points as `np.linspace` does, to the last bit, but faster."""
    span = b - a
    last = count - 1
    step = span / last
    numbers = np.arange(count, dtype=np.float64)[:, None]
    points: Floats = numbers * step if step.all() else numbers / last * span
    points += a
    points[-1] = b
    return points


def _price(room: Floats) -> Floats:
    """Return the cost of a metre at a clearance [m]: 1 in the open, more near walls."""
    lack: Floats = np.maximum(1.0 - room / COMFORT, 0.0)
    return 1.0 + SHYNESS * lack**2


def _resample(points: Floats) -> Floats:
    """Resample a line to points about `STEP` apart [m]."""
    along = np.r_[0.0, np.cumsum(np.hypot(*np.diff(points, axis=0).T))]
    at = np.linspace(0.0, along[-1], 2 + int(along[-1] / STEP))
    return np.stack([np.interp(at, along, points[:, 0]), np.interp(at, along, points[:, 1])], 1)
