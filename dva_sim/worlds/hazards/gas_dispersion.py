"""The floor as a mesh for gas: coarse cells that no wall runs through.

A coarse cell that a wall cuts becomes two nodes, one on each side; two nodes exchange air over
as much of their common border as is free. So walls are tight wherever they stand, and doors are
as wide as they are. Cells are 0.5 m wide; on more than 10 000 m^2 of floor, where they would be
more than 40 000, they are as much wider as it takes: a leak in a large house costs seconds.

Gas in a building: it spreads by eddies, drifts with a draught, and fresh air thins it.

The share of gas in the air, averaged from floor to ceiling, on a mesh of the floor: finite
volumes, implicit in time. What is set free is in the air or was carried out, to rounding.

Left out: rising and layering of light gas, the jet itself, exchange through outer doors.

References:
    S. V. Patankar, Numerical Heat Transfer and Fluid Flow, Hemisphere 1980: finite volumes,
    the exponential scheme.

Gas outdoors: Gaussian plumes over flat ground.

How wide they are follows from the distance and from how stable the air is, classes A (sunny,
calm) to F (clear night). Fitted from 0.1 km on; nearer it is extrapolated: across by the same
power, upwards in proportion to the distance, as the fit's constant f would leave metres of gas
(classes A and B), or less than none (D to F), at the leak itself.

References:
    D. O. Martin, J. Air Pollut. Control Assoc. 26 (1976) 145: sigma = a x^0.894 across, c x^d + f
    upwards, x in km.
    D. B. Turner, Workbook of Atmospheric Dispersion Estimates, US EPA AP-26, 1970.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dva_sim.kernel.errors import ConfigError
from dva_sim.worlds.hazards.building import KEPT_PLACES, NOWHERE, Building
from dva_sim.worlds.maps import FREE, OccupancyGrid

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

MIXED_HEIGHT = 3.0  # the jet of a leak mixes the air up to the ceiling [m]; assumed
CELL = 0.5  # side of a coarse cell [m]
MOST_CELLS = 40_000  # larger houses have larger cells


@dataclass(frozen=True, eq=False)
class Mesh:
    """Nodes and the borders between them.

    Attributes:
        area: Of each node, shape `(n,)` [m^2].
        a: Node on one side of each border, shape `(k,)`.
        b: Node on the other side.
        shape: Length of each border over the distance between its nodes.
        nodes: Node of each cell of the grid, or -1, shape `(rows, columns)`.
        grid: Gives the cells.
    """

    area: Floats
    a: Integers
    b: Integers
    shape: Floats
    nodes: NDArray[np.int32]
    grid: OccupancyGrid

    @cached_property
    def node_at(self) -> Callable[[float, float], int]:
        """The node around a point [m]; -1 in walls and outdoors."""
        look_up, nodes = self.grid.look_up, self.nodes
        return lru_cache(KEPT_PLACES)(lambda x, y: int(look_up(nodes, x, y, -1)))

    def nearest(self, x: float, y: float) -> int:
        """The node around a point [m], or the one nearest to it."""
        node = self.node_at(x, y)
        if node < 0:
            rows, columns = np.nonzero(self.nodes >= 0)
            row, column = self.grid.to_cell(x, y)
            nearest = int(np.argmin((rows - row) ** 2 + (columns - column) ** 2))
            node = int(self.nodes[rows[nearest], columns[nearest]])
        return node


@lru_cache(maxsize=8)
def mesh_in(building: Building) -> Mesh:
    """The mesh of all floor indoors, once per process."""
    inside = (building.grid.cells == FREE) & (building.labels != NOWHERE)
    return make_mesh(building.grid, inside, side_for(inside.sum() * building.grid.resolution**2))


def side_for(floor: float) -> float:
    """Side of a coarse cell [m] that makes no more than about `MOST_CELLS` of a floor [m^2]."""
    return max(CELL, math.sqrt(floor / MOST_CELLS))


def make_mesh(grid: OccupancyGrid, free: NDArray[np.bool_], cell: float = CELL) -> Mesh:
    """The mesh of some cells of a grid.

    Args:
        grid: Gives the cells.
        free: Which of them hold air, shape `(rows, columns)`.
        cell: Side of a coarse cell [m].
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    number = np.full(free.shape, -1, np.int32)
    rows, columns = (line.astype(np.int32) for line in np.nonzero(free))
    number[rows, columns] = np.arange(len(rows))
    block = max(1, round(cell / grid.resolution))
    coarse = (rows // block) * (free.shape[1] // block + 1) + columns // block
    pairs = [_edges(number, axis) for axis in (0, 1)]
    same = [coarse[p[0]] == coarse[p[1]] for p in pairs]
    joined = np.hstack([p[:, s] for p, s in zip(pairs, same, strict=True)])
    graph = coo_array((np.ones(joined.shape[1], bool), tuple(joined)), (len(rows), len(rows)))
    count, node = connected_components(graph, directed=False)
    node = node.astype(np.int64)  # pairs of nodes are numbered below: too many for 32 bits
    cells = np.bincount(node, minlength=count)
    middles = np.stack([np.bincount(node, line, count) / cells for line in (rows, columns)])
    borders = [
        _borders(node[p[:, ~s]], middles[axis], count, block)
        for axis, (p, s) in enumerate(zip(pairs, same, strict=True))
    ]
    a, b, shape = np.hstack(borders)
    nodes = np.full(free.shape, -1, np.int32)
    nodes[rows, columns] = node
    area = cells.astype(np.float64) * grid.resolution**2
    return Mesh(area, a.astype(np.int64), b.astype(np.int64), shape, nodes, grid)


def _edges(number: NDArray[np.int32], axis: int) -> NDArray[np.int32]:
    """Pairs of neighbouring cells along an axis, shape `(2, k)`."""
    low, high = (number[:-1], number[1:]) if axis == 0 else (number[:, :-1], number[:, 1:])
    both = (low >= 0) & (high >= 0)
    return np.stack([low[both], high[both]])


def _borders(pairs: Integers, middles: Floats, count: int, block: int) -> Floats:
    """Edges between cells put together to borders between nodes.

    Args:
        pairs: Nodes on both sides of each edge, shape `(2, k)`.
        middles: Of the nodes along the axis that the edges are crossed in [cells].
        count: How many nodes there are.
        block: Side of a coarse cell [cells].

    Returns:
        Rows a, b, length over distance.
    """
    code, edges = np.unique(pairs[0] * count + pairs[1], return_counts=True)
    a, b = code // count, code % count
    across = np.clip(middles[b] - middles[a], 1.0, block)
    return np.stack([a, b, edges / across])


class Draught(NamedTuple):
    """Air blown in at one node of a mesh and sucked off at another [m^3/s]."""

    supply: int
    exhaust: int
    rate: float


class Air:
    """How the air of a mesh moves.

    Args:
        mesh: Where.
        diffusivity: [m^2/s]
        loss: Fresh air, in volumes per second.
        draught: A steady flow through the rooms, if there is one.

    Raises:
        ConfigError: the draught is blown in where no way leads to where it is sucked off.
    """

    def __init__(
        self,
        mesh: Mesh,
        diffusivity: float,
        loss: float,
        draught: Draught | None = None,
    ) -> None:
        self.mesh = mesh
        self._spread = diffusivity * mesh.shape
        self.flow = _potential_flow(mesh, draught)
        self._out = loss * mesh.area  # air that leaves each node [m^2/s]
        if draught is not None:
            self._out[draught.exhaust] += draught.rate / MIXED_HEIGHT
        self._solvers: dict[float, Any] = {}

    def still(self) -> Floats:
        """Clean air: the share in every node and, last, what was carried out [m^3]."""
        return np.zeros(len(self.mesh.area) + 1)

    def step(self, state: Floats, node: int, rate: float, dt: float) -> Floats:
        """The state `dt` [s] later, with a source [m^3/s] in a node."""
        source = self.mesh.area / dt * state[:-1]
        source[node] += rate / MIXED_HEIGHT
        share = self._solver(dt).solve(source)
        out = float((self._out * share).sum())  # in one thread, whatever the machine
        return np.append(share, state[-1] + dt * MIXED_HEIGHT * out)

    def _solver(self, dt: float) -> Any:
        """The factors of a step's equations, once for each length of a step."""
        if dt not in self._solvers:
            from scipy.sparse.linalg import splu

            self._solvers[dt] = splu(self._equations(dt), permc_spec="MMD_AT_PLUS_A")
        return self._solvers[dt]

    def _equations(self, dt: float) -> Any:
        """The matrix of one implicit step."""
        from scipy.sparse import coo_array

        mesh = self.mesh
        forth, back = _carried(self._spread, self.flow), _carried(self._spread, -self.flow)
        own = mesh.area / dt + self._out
        own = own + np.bincount(mesh.a, forth, len(own)) + np.bincount(mesh.b, back, len(own))
        here = np.arange(len(own))
        rows, columns = np.r_[here, mesh.b, mesh.a], np.r_[here, mesh.a, mesh.b]
        return coo_array((np.r_[own, -forth, -back], (rows, columns))).tocsc()


def _carried(spread: Floats, flow: Floats) -> Floats:
    """Air that passes each border one way, by eddies and drift: the exponential scheme.

    Exact for steady flow along one line; never negative.
    """
    ratio = np.clip(-flow / spread, -50.0, 50.0)
    small = np.abs(ratio) < 1e-6
    safe = np.where(small, 1.0, ratio)
    return np.asarray(spread * np.where(small, 1.0 - ratio / 2.0, safe / np.expm1(safe)))


def _potential_flow(mesh: Mesh, draught: Draught | None) -> Floats:
    """Air that passes each border from a to b [m^2/s]: without whirls, and none is lost."""
    if draught is None:
        return np.zeros(len(mesh.a))
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.sparse.linalg import spsolve

    count = len(mesh.area)
    both = np.r_[mesh.a, mesh.b], np.r_[mesh.b, mesh.a]
    link = coo_array((-np.r_[mesh.shape, mesh.shape], both), (count, count)).tocsr()
    _, part = connected_components(link, directed=False)
    if part[draught.supply] != part[draught.exhaust]:
        raise ConfigError("no way leads from the supply of a draught to its exhaust")
    inside = np.flatnonzero(part == part[draught.supply])
    here = np.setdiff1d(inside, [draught.exhaust])  # its potential is zero
    own = np.bincount(mesh.a, mesh.shape, count) + np.bincount(mesh.b, mesh.shape, count)
    matrix = (link + coo_array((own, (np.arange(count),) * 2)).tocsr())[here][:, here]
    potential, source = np.zeros(count), np.zeros(count)
    source[draught.supply] = draught.rate / MIXED_HEIGHT
    potential[here] = spsolve(matrix.tocsc(), source[here])
    return np.asarray(mesh.shape * (potential[mesh.a] - potential[mesh.b]))


@lru_cache(maxsize=8)
def air_in(building: Building, diffusivity: float, loss: float, draught: Draught | None) -> Air:
    """The air of a building, once per process."""
    return Air(mesh_in(building), diffusivity, loss, draught)


class Spread(NamedTuple):
    """Martin's constants of a class: `a` across; c, d, f upwards below and beyond 1 km."""

    a: float
    near: tuple[float, float, float]
    far: tuple[float, float, float]


CLASSES = {
    "A": Spread(213.0, (440.8, 1.941, 9.27), (459.7, 2.094, -9.6)),
    "B": Spread(156.0, (106.6, 1.149, 3.3), (108.2, 1.098, 2.0)),
    "C": Spread(104.0, (61.0, 0.911, 0.0), (61.0, 0.911, 0.0)),
    "D": Spread(68.0, (33.2, 0.725, -1.7), (44.5, 0.516, -13.0)),
    "E": Spread(50.5, (22.8, 0.678, -1.3), (55.4, 0.305, -34.0)),
    "F": Spread(34.0, (14.35, 0.740, -0.35), (62.6, 0.180, -48.6)),
}
FITTED = 0.1  # from so far on [km]


def sigma_y(stability: str, distance: float) -> float:
    """Standard deviation across the wind [m] at a distance downwind [m]."""
    return float(CLASSES[stability].a * (distance / 1000.0) ** 0.894)


def sigma_z(stability: str, distance: float) -> float:
    """Standard deviation upwards [m] at a distance downwind [m]."""
    spread, x = CLASSES[stability], max(FITTED, distance / 1000.0)
    c, d, f = spread.near if x <= 1.0 else spread.far
    return float(c * x**d + f) * distance / 1000.0 / x


def plume(rate: float, wind: float, stability: str, x: float, y: float, z: float) -> float:
    """Share of gas in the air downwind of a steady source on the ground.

    Args:
        rate: Gas set free [m^3/s].
        wind: [m/s]
        stability: A to F.
        x: Downwind of the source [m]; there is none upwind.
        y: Across [m].
        z: Above the ground, which throws back what reaches it [m].
    """
    if x <= 0.0:
        return 0.0
    across, up = sigma_y(stability, x), sigma_z(stability, x)
    shape = math.exp(-0.5 * (y / across) ** 2 - 0.5 * (z / up) ** 2)
    return min(1.0, rate / (math.pi * wind * across * up) * shape)
