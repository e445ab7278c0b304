"""What one hazard does to a site: smoke and heat, gas, or water.

What robots and people do changes nothing but when the source stops. So a field is solved once
per process for each site, kind and space that it starts in; a run goes on from there on its own
once its hazard is dealt with.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cached_property, lru_cache
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from dva_sim.worlds.hazards.base import AMBIENT, BREATHING_HEIGHT, CLEAR, Conditions, Hazard
from dva_sim.worlds.hazards.building import NOWHERE, Building
from dva_sim.worlds.hazards.dispersion import Air, Draught, air_in, mesh_in
from dva_sim.worlds.hazards.filling import Filling
from dva_sim.worlds.hazards.fire import Fire
from dva_sim.worlds.hazards.flood import FILM, Flood
from dva_sim.worlds.hazards.leak import HOUR, GasLeak
from dva_sim.worlds.hazards.march import PACES, March, Paces, Step
from dva_sim.worlds.hazards.plumes import plume
from dva_sim.worlds.hazards.smoke import (
    CO_RATIO,
    DENSITY,
    HEAT,
    HEAT_CAPACITY,
    KELVIN,
    MASS,
    SOOT,
    SOOT_EXTINCTION,
    Smoke,
)
from dva_sim.worlds.sight import Sight

Floats = NDArray[np.float64]

BLUR = 0.3  # the lower face of a smoke layer is so thick [m]; assumed
RADIATION = 5.67e-11  # Stefan and Boltzmann's constant [kW/m^2/K^4]
SMOKE_PACES = ((math.inf, 1.0),)  # in longer steps layers would swing
GAS_PACES = ((120.0, 2.0), (600.0, 10.0), (math.inf, 30.0))


class Places(NamedTuple):
    """Points of a picture, and what lies there.

    Attributes:
        points: Shape `(rows, columns, 2)` [m].
        spaces: Index of the space, or -1.
        nodes: Index of the node of the gas mesh, or -1; not filled where nobody asks for gas.
    """

    points: Floats
    spaces: NDArray[np.int64]
    nodes: NDArray[np.int64]


class HazardField(Protocol):
    """What one hazard does."""

    until: float

    def at(self, x: float, y: float, time: float) -> Conditions:
        """What it adds to clear air at a place [m]."""

    def picture(self, what: str, places: Places, time: float) -> Floats | None:
        """A raster of what it adds; None if it adds nothing of the kind."""


class _Course:
    """A field as it develops: shared until the source stops, then this run's own.

    Args:
        shared: With the source, from age 0 on.
        step: Without the source.
        paces: Of this run's own.
    """

    def __init__(self, shared: March, step: Step, paces: Paces) -> None:
        self._shared, self._step, self._paces = shared, step, paces
        self._own: tuple[float, March] | None = None

    def around(self, age: float, stopped: float) -> tuple[Floats, Floats, float]:
        """The states before and after an age [s], and the weight of the later one."""
        if age <= stopped:
            return self._shared.around(age)
        if self._own is None or self._own[0] != stopped:
            self._own = stopped, March(self._shared.at(stopped), self._step, self._paces)
        return self._own[1].around(age - stopped)

    def at(self, age: float, stopped: float) -> Floats:
        """The state at an age [s]."""
        before, after, weight = self.around(age, stopped)
        between: Floats = before + weight * (after - before)
        return between


# --- fire ------------------------------------------------------------------------------


class Layer(NamedTuple):
    """Smoke under a ceiling: lower face and thickness [m], [deg C], [1/m], [ppm]."""

    bottom: float
    depth: float
    temperature: float
    extinction: float
    co: float


@lru_cache(maxsize=32)
def _smoke(building: Building, growth: str, peak: float, room: int) -> tuple[Smoke, March]:
    smoke = Smoke(building.spaces, Fire((0.0, 0.0), 0.0, growth, peak), room)
    return smoke, March(smoke.empty(), smoke.step, SMOKE_PACES)


class FireField:
    """Radiant heat of a fire, and its smoke.

    Args:
        building: Where.
        sight: What hides the flames.
        fire: What burns.
    """

    def __init__(self, building: Building, sight: Sight, fire: Fire) -> None:
        self.until = math.inf
        self._building, self._sight, self._fire = building, sight, fire
        self._room = building.space_at(*fire.position)
        self._course: _Course | None = None
        self._seen: tuple[Floats, NDArray[np.bool_]] | None = None

    def at(self, x: float, y: float, time: float) -> Conditions:
        """See `HazardField`."""
        if time < self._fire.start:
            return CLEAR
        heat = 0.0
        if time < self.until and self._sight.between((x, y), self._fire.position):
            heat = self._fire.heat_flux(time, (x, y))
        space = self._building.space_at(x, y)
        layer = self.layer(space, time) if space >= 0 else None
        if layer is None:
            return Conditions(AMBIENT, heat)
        heat += _glow(layer.temperature, layer.extinction * layer.depth)
        share = _within(layer.bottom)
        return Conditions(
            AMBIENT + share * (layer.temperature - AMBIENT),
            heat,
            share * layer.extinction,
            share * layer.co,
        )

    def layer(self, space: int, time: float) -> Layer | None:
        """The smoke in a space; None if there is none."""
        if self._room == NOWHERE or time <= self._fire.start:
            return None
        before, after, weight = self._states(time)
        mass, heat, soot, co = (before[space] + weight * (after[space] - before[space])).tolist()
        if mass <= 1e-6:
            return None
        spaces = self._building.spaces
        volume = (mass + heat / (HEAT_CAPACITY * KELVIN)) / DENSITY
        ceiling = float(spaces.ceiling[space])
        depth = min(ceiling, volume / float(spaces.area[space]))
        warmer = heat / (HEAT_CAPACITY * mass)
        return Layer(
            ceiling - depth,
            depth,
            AMBIENT + warmer,
            SOOT_EXTINCTION * soot / volume,
            CO_RATIO * co / mass,
        )

    def extinctions(self, time: float, mean: bool = False) -> Floats:
        """Extinction in each space [1/m], and 0 last, for -1: nowhere.

        Args:
            time: [s]
            mean: From floor to ceiling; else at breathing height.
        """
        spaces = self._building.spaces
        if self._room == NOWHERE or time <= self._fire.start:
            return np.zeros(spaces.count + 1)
        before, after, weight = self._states(time)
        state = (before + weight * (after - before))[:-1]
        room = spaces.area * spaces.ceiling
        volume = (state[:, MASS] + state[:, HEAT] / (HEAT_CAPACITY * KELVIN)) / DENSITY
        volume = np.maximum(volume, 1e-9)
        value = SOOT_EXTINCTION * state[:, SOOT] / volume
        share = np.minimum(1.0, volume / room)
        if not mean:
            bottom = spaces.ceiling * (1.0 - share)
            share = np.clip((BREATHING_HEIGHT - bottom) / BLUR + 0.5, 0.0, 1.0)
        return np.append(value * share, 0.0)

    def picture(self, what: str, places: Places, time: float) -> Floats | None:
        """See `HazardField`."""
        if what == "smoke":
            return np.asarray(self.extinctions(time, mean=True)[places.spaces])
        if what != "heat":
            return None
        if not self._fire.start <= time < self.until:
            return np.zeros(places.spaces.shape)
        if self._seen is None or self._seen[0] is not places.points:
            seen = self._sight.from_point(self._fire.position, places.points)
            self._seen = places.points, seen
        x, y = self._fire.position
        squared = (places.points[..., 0] - x) ** 2 + (places.points[..., 1] - y) ** 2
        nearest = max(0.1, self._fire.radius(time)) ** 2
        strength = self._fire.heat_flux(time, (x + 100.0, y)) * 1e4
        return np.asarray(strength / np.maximum(squared, nearest) * self._seen[1])

    def _states(self, time: float) -> tuple[Floats, Floats, float]:
        if self._course is None:
            smoke, march = _smoke(self._building, self._fire.growth, self._fire.peak, self._room)
            self._course = _Course(march, smoke.step_without_fire, SMOKE_PACES)
        start = self._fire.start
        return self._course.around(time - start, max(0.0, self.until - start))


def _within(bottom: float) -> float:
    """How far breathing height lies within a layer whose lower face is there [m], 0 to 1."""
    return min(1.0, max(0.0, (BREATHING_HEIGHT - bottom) / BLUR + 0.5))


def _glow(temperature: float, optical_depth: float) -> float:
    """Radiant heat of hot smoke on somebody below or in it [kW/m^2]."""
    if temperature < AMBIENT + 1.0:
        return 0.0
    kelvin = temperature + KELVIN - AMBIENT
    return RADIATION * (kelvin**4 - KELVIN**4) * -math.expm1(-optical_depth)


# --- gas -------------------------------------------------------------------------------


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
        self._course: _Course | None = None

    def at(self, x: float, y: float, time: float) -> Conditions:
        """See `HazardField`."""
        share = self.share(x, y, time)
        if self._leak.gas == "carbon_monoxide":
            return Conditions(co=1e6 * share)
        return Conditions(gas=share)

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
        one solution, with the source at this place, serves leaks wherever they are.
        """
        if not self._indoors or self._leak.draught > 0.0:
            return lambda age: self.share(x, y, self._leak.start + age)
        mesh, leak = mesh_in(self._building), self._leak
        here, there = mesh.nearest(x, y), mesh.nearest(*leak.position)
        march = _gas(self._air, here, 1.0)

        def share(age: float) -> float:
            before, after, weight = march.around(age)
            return leak.release * float(before[there] + weight * (after[there] - before[there]))

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
            self._course = _Course(
                march, lambda state, _, dt: air.step(state, node, 0.0, dt), GAS_PACES
            )
        return self._course.around(time - leak.start, max(0.0, self.until - leak.start))


# --- water -----------------------------------------------------------------------------


@lru_cache(maxsize=64)
def _water(building: Building, inflow: float, room: int) -> tuple[Filling, March]:
    filling = Filling(building.spaces, room, inflow)
    return filling, March(filling.dry(), filling.step)


class FloodField:
    """Water on the floors: one level in each space; where it comes, first a spreading film.

    Args:
        building: Where.
        flood: What flows.
    """

    def __init__(self, building: Building, flood: Flood) -> None:
        self.until = math.inf
        self._building, self._flood = building, flood
        self._room = building.space_at(*flood.position)
        self._course: _Course | None = None

    def at(self, x: float, y: float, time: float) -> Conditions:
        """See `HazardField`."""
        space = self._building.space_at(x, y)
        if space == NOWHERE or self._room == NOWHERE or time <= self._flood.start:
            return CLEAR
        before, after, weight = self._states(time)
        volume = float(before[space]) * (1.0 - weight) + float(after[space]) * weight
        level = volume / float(self._building.spaces.area[space])
        if space == self._room and level < FILM:
            wet = math.dist((x, y), self._flood.position) < math.sqrt(volume / (math.pi * FILM))
            level = FILM if wet else 0.0
        return Conditions(water=level)

    def picture(self, what: str, places: Places, time: float) -> Floats | None:
        """See `HazardField`."""
        if what != "water":
            return None
        if self._room == NOWHERE or time <= self._flood.start:
            return np.zeros(places.spaces.shape)
        before, after, weight = self._states(time)
        state = before + weight * (after - before)
        level = np.append(state[:-1] / self._building.spaces.area, 0.0)
        depth = level[places.spaces]
        if level[self._room] < FILM:
            here = places.spaces == self._room
            x, y = self._flood.position
            away = np.hypot(places.points[..., 0] - x, places.points[..., 1] - y)
            wet = away < math.sqrt(state[self._room] / (math.pi * FILM))
            depth = np.where(here, np.where(wet, FILM, 0.0), depth)
        return np.asarray(depth)

    def _states(self, time: float) -> tuple[Floats, Floats, float]:
        flood = self._flood
        if self._course is None:
            filling, march = _water(self._building, flood.inflow, self._room)
            self._course = _Course(march, filling.step_without_inflow, PACES)
        return self._course.around(time - flood.start, max(0.0, self.until - flood.start))


def field_of(
    hazard: Hazard, building: Building, sight: Sight
) -> FireField | LeakField | FloodField:
    """The field of a hazard."""
    if isinstance(hazard, Fire):
        return FireField(building, sight, hazard)
    if isinstance(hazard, GasLeak):
        return LeakField(building, hazard)
    assert isinstance(hazard, Flood)
    return FloodField(building, hazard)
