"""Gas in a building: it spreads by eddies, drifts with a draught, and fresh air thins it.

The share of gas in the air, averaged from floor to ceiling, on a mesh of the floor: finite
volumes, implicit in time. What is set free is in the air or was carried out, to rounding.

Left out: rising and layering of light gas, the jet itself, exchange through outer doors.

References:
    S. V. Patankar, Numerical Heat Transfer and Fluid Flow, Hemisphere 1980: finite volumes,
    the exponential scheme.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dva_sim.kernel.errors import ConfigError
from dva_sim.worlds.hazards.air_mesh import MIXED_HEIGHT, Mesh, mesh_in
from dva_sim.worlds.hazards.building import Building

Floats = NDArray[np.float64]


class Draught(NamedTuple):
    """Air blown in at one node of a mesh and sucked off at another [m^3/s]."""

    supply: int
    exhaust: int
    rate: float


class Air:
    """Air flow between the cells of a mesh.

    Args:
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
        """Clean air: the share of gas in every node and, last, the gas carried out [m^3]."""
        return np.zeros(len(self.mesh.area) + 1)

    def step(self, state: Floats, node: int, rate: float, dt: float) -> Floats:
        """Return the state `dt` [s] later, with a source [m^3/s] in a node."""
        source = self.mesh.area / dt * state[:-1]
        source[node] += rate / MIXED_HEIGHT
        share = self._solver(dt).solve(source)
        out = float((self._out * share).sum())  # in one thread, whatever the machine
        return np.append(share, state[-1] + dt * MIXED_HEIGHT * out)

    def _solver(self, dt: float) -> Any:
        """Return the factors of a step's equations, once for each length of a step."""
        if dt not in self._solvers:
            from scipy.sparse.linalg import splu

            self._solvers[dt] = splu(self._equations(dt), permc_spec="MMD_AT_PLUS_A")
        return self._solvers[dt]

    def _equations(self, dt: float) -> Any:
        """Return the matrix of one implicit step."""
        from scipy.sparse import coo_array

        mesh = self.mesh
        forth = _carried(self._spread, self.flow)
        back = _carried(self._spread, -self.flow)
        diagonal = mesh.area / dt + self._out
        diagonal = (
            diagonal
            + np.bincount(mesh.a, forth, len(diagonal))
            + np.bincount(mesh.b, back, len(diagonal))
        )
        here = np.arange(len(diagonal))
        rows = np.r_[here, mesh.b, mesh.a]
        columns = np.r_[here, mesh.a, mesh.b]
        return coo_array((np.r_[diagonal, -forth, -back], (rows, columns))).tocsc()


def _carried(spread: Floats, flow: Floats) -> Floats:
    """Return air that passes each border one way, by eddies and drift: the exponential scheme.

    Exact for steady flow along one line; never negative.
    """
    ratio = np.clip(-flow / spread, -50.0, 50.0)
    small = np.abs(ratio) < 1e-6
    safe = np.where(small, 1.0, ratio)
    return np.asarray(spread * np.where(small, 1.0 - ratio / 2.0, safe / np.expm1(safe)))


def _potential_flow(mesh: Mesh, draught: Draught | None) -> Floats:
    """Return air that passes each border from a to b [m^2/s]: without whirls, and none is lost."""
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
    diagonal = np.bincount(mesh.a, mesh.shape, count) + np.bincount(mesh.b, mesh.shape, count)
    matrix = (link + coo_array((diagonal, (np.arange(count),) * 2)).tocsr())[here][:, here]
    potential = np.zeros(count)
    source = np.zeros(count)
    source[draught.supply] = draught.rate / MIXED_HEIGHT
    potential[here] = spsolve(matrix.tocsc(), source[here])
    return np.asarray(mesh.shape * (potential[mesh.a] - potential[mesh.b]))


@lru_cache(maxsize=8)
def air_in(building: Building, diffusivity: float, loss: float, draught: Draught | None) -> Air:
    """Return the air of a building, once per process."""
    return Air(mesh_in(building), diffusivity, loss, draught)
