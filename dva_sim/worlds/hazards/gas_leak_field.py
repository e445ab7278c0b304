"""What a gas leak does to a site: gas on the mesh indoors, a plume outdoors."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from dva_sim.worlds.hazards.building import NOWHERE, Building
from dva_sim.worlds.hazards.field import BREATHING_HEIGHT, Conditions, Course, March, Places
from dva_sim.worlds.hazards.gas_dispersion import Air, Draught, air_in, mesh_in, plume
from dva_sim.worlds.hazards.gas_leak import HOUR, GasLeak

Floats = NDArray[np.float64]

LARGE_MESH = 20_000  # nodes, of 5000 m^2 of floor
GAS_PACES = ((120.0, 2.0), (600.0, 10.0), (math.inf, 30.0))


@lru_cache(maxsize=16)
def _gas(air: Air, node: int, rate: float) -> March:
    return March(air.still(), lambda state, _, dt: air.step(state, node, rate, dt), GAS_PACES)


class LeakField:
    """Gas from a leak: on the mesh indoors, a plume outdoors.

    Args:
        building: Where.
        leak: What leaks.

    Attributes:
        limits: Of the gas.
    """

    def __init__(self, building: Building, leak: GasLeak) -> None:
        self.until = math.inf
        self._building, self._leak = building, leak
        self.limits = leak.kind_of_gas
        self._indoors = building.space_at(*leak.position) != NOWHERE
        self._course: Course | None = None

    def at(self, x: float, y: float, time: float) -> Conditions:
        """See `HazardField`; carbon monoxide kills long before it could explode."""
        share = self.share(x, y, time)
        if self._leak.gas == "carbon_monoxide":
            return Conditions(co=1e6 * share)
        return Conditions(gas=share, explosive=share / self.limits.lower)

    def share(self, x: float, y: float, time: float) -> float:
        """Share of the gas in the air, 0 to 1."""
        if time <= self._leak.start:
            return 0.0
        if not self._indoors:
            return self._outdoors(x, y, time)
        node = mesh_in(self._building).node_at(x, y)
        if node < 0:
            return 0.0
        before, after, weight = self._states(time)
        return min(1.0, float(before[node]) * (1.0 - weight) + float(after[node]) * weight)

    def seen_from(self, x: float, y: float) -> Callable[[float], float]:
        """The share of gas at a place [m] by the age of a leak that goes on [s].

        In still air as much gas comes from one place to another as would come back from there:
        one solution, with the source at this place, serves leaks wherever they are. In a large
        house that would be slow, for every detector, and the leak's own serves them all.
        """
        if not self._indoors or self._leak.draught > 0.0:
            return lambda age: self.share(x, y, self._leak.start + age)
        mesh, leak = mesh_in(self._building), self._leak
        here, there = mesh.nearest(x, y), mesh.nearest(*leak.position)
        source, seen, rate = here, there, 1.0
        if len(mesh.area) > LARGE_MESH:
            source, seen, rate = there, here, leak.release
        march = _gas(self._air, source, rate)

        def share(age: float) -> float:
            before, after, weight = march.around(age)
            gas = float(before[seen] + weight * (after[seen] - before[seen]))
            return leak.release / rate * gas

        return share

    def _outdoors(self, x: float, y: float, time: float) -> float:
        """In the plume: what is there was set free when the wind set out from the leak."""
        leak = self._leak
        if self._indoors or self._building.space_at(x, y) != NOWHERE:
            return 0.0
        dx, dy = x - leak.position[0], y - leak.position[1]
        cos, sin = math.cos(leak.wind_heading), math.sin(leak.wind_heading)
        downwind, across = dx * cos + dy * sin, dy * cos - dx * sin
        if not leak.start <= time - downwind / leak.wind < self.until:
            return 0.0
        height = BREATHING_HEIGHT
        return plume(leak.release, leak.wind, leak.stability, downwind, across, height)

    @cached_property
    def _air(self) -> Air:
        """The air that it leaks into."""
        leak, mesh = self._leak, mesh_in(self._building)
        draught = None
        if leak.draught > 0.0:
            supply = mesh.nearest(leak.supply_x, leak.supply_y)
            exhaust = mesh.nearest(leak.exhaust_x, leak.exhaust_y)
            draught = Draught(supply, exhaust, leak.draught)
        return air_in(self._building, leak.diffusivity, leak.air_changes / HOUR, draught)

    def picture(self, what: str, places: Places, time: float) -> Floats | None:
        """See `HazardField`."""
        if what != "gas":
            return None
        if time <= self._leak.start:
            return np.zeros(places.spaces.shape)
        if not self._indoors:
            return self._plume_picture(places, time)
        before, after, weight = self._states(time)
        share = before + weight * (after - before)
        share[-1] = 0.0  # what was carried out is nowhere
        return np.minimum(1.0, share[places.nodes])

    def _plume_picture(self, places: Places, time: float) -> Floats:
        shares = [self._outdoors(x, y, time) for x, y in places.points.reshape(-1, 2).tolist()]
        return np.array(shares).reshape(places.spaces.shape)

    def _states(self, time: float) -> tuple[Floats, Floats, float]:
        leak = self._leak
        if self._course is None:
            node = mesh_in(self._building).nearest(*leak.position)
            air, march = self._air, _gas(self._air, node, leak.release)
            self._course = Course(
                march, lambda state, _, dt: air.step(state, node, 0.0, dt), GAS_PACES
            )
        return self._course.around(time - leak.start, max(0.0, self.until - leak.start))
