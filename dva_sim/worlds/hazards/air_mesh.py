"""The floor as a mesh for gas: coarse cells that no wall runs through.

A coarse cell that a wall cuts becomes two nodes, one on each side; two nodes exchange air over
as much of their common border as is free. So walls are tight wherever they stand, and doors are
as wide as they are. Cells are 0.5 m wide; on more than 10 000 m^2 of floor, where they would be
more than 40 000, they are as much wider as it takes: a leak in a large house costs seconds.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from dva_sim.worlds.hazards.building import KEPT_PLACES, NO_SPACE, Building
from dva_sim.worlds.maps import FREE, OccupancyGrid

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

MIXED_HEIGHT = 3.0  # height up to which the jet of a leak mixes the air [m]; assumed
CELL = 0.5  # side of a coarse cell [m]
MAX_CELLS = 40_000  # maximum cells; larger houses have larger ones


@dataclass(frozen=True, eq=False)
class Mesh:
    """Nodes and the borders between them.

    Attributes:
        area: Area of each node, shape `(n,)` [m^2].
        a: Node on one side of each border, shape `(k,)`.
        b: Node on the other side.
        shape: Length of each border over the distance between its nodes.
        nodes: Node of each cell of the grid, or -1, shape `(rows, columns)`.
        grid: Grid of the cells.
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
        look_up = self.grid.look_up
        nodes = self.nodes
        return lru_cache(KEPT_PLACES)(lambda x, y: int(look_up(nodes, x, y, -1)))

    def nearest(self, x: float, y: float) -> int:
        """Return the node around a point [m], or the one nearest to it."""
        node = self.node_at(x, y)
        if node < 0:
            rows, columns = np.nonzero(self.nodes >= 0)
            row, column = self.grid.to_cell(x, y)
            nearest = int(np.argmin((rows - row) ** 2 + (columns - column) ** 2))
            node = int(self.nodes[rows[nearest], columns[nearest]])
        return node


@lru_cache(maxsize=8)
def mesh_in(building: Building) -> Mesh:
    """Return the mesh of all floor indoors, once per process."""
    inside = (building.grid.cells == FREE) & (building.labels != NO_SPACE)
    return make_mesh(building.grid, inside, side_for(inside.sum() * building.grid.resolution**2))


def side_for(floor: float) -> float:
    """Side of a coarse cell [m] that makes no more than about `MAX_CELLS` of a floor [m^2]."""
    return max(CELL, math.sqrt(floor / MAX_CELLS))


def make_mesh(grid: OccupancyGrid, free: NDArray[np.bool_], cell: float = CELL) -> Mesh:
    """Return the mesh of some cells of a grid.

    Args:
        grid: Grid of the cells.
        free: True for cells that hold air, shape `(rows, columns)`.
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
    return Mesh(area, a.astype(np.int64), b.astype(np.int64), shape, nodes=nodes, grid=grid)


def _edges(number: NDArray[np.int32], axis: int) -> NDArray[np.int32]:
    """Return pairs of neighbouring cells along an axis, shape `(2, k)`."""
    low, high = (number[:-1], number[1:]) if axis == 0 else (number[:, :-1], number[:, 1:])
    both = (low >= 0) & (high >= 0)
    return np.stack([low[both], high[both]])


def _borders(pairs: Integers, middles: Floats, count: int, block: int) -> Floats:
    """Return edges between cells put together to borders between nodes.

    Args:
        pairs: Nodes on both sides of each edge, shape `(2, k)`.
        middles: Centres of the nodes along the axis that the edges are crossed in [cells].
        count: Number of nodes.
        block: Side of a coarse cell [cells].

    Returns:
        Rows a, b, length over distance.
    """
    code, edges = np.unique(pairs[0] * count + pairs[1], return_counts=True)
    a = code // count
    b = code % count
    across = np.clip(middles[b] - middles[a], 1.0, block)
    return np.stack([a, b, edges / across])
