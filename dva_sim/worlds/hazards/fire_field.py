"""What a fire does to a site: radiant heat and smoke."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dva_sim.worlds.hazards.base import AMBIENT, BREATHING_HEIGHT, CLEAR, Conditions
from dva_sim.worlds.hazards.building import NOWHERE, Building
from dva_sim.worlds.hazards.course import Course, Places
from dva_sim.worlds.hazards.fire import Fire
from dva_sim.worlds.hazards.march import March
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
        self._course: Course | None = None
        self._seen: tuple[Floats, NDArray[np.bool_]] | None = None
        self._known: tuple[Floats, Floats, bool] = np.empty(0), np.empty(0), True

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

    def extinctions(self, time: float, where: str = "breathing") -> Floats:
        """Extinction in each space [1/m], and 0 last, for -1: nowhere.

        Args:
            time: [s]
            where: At `breathing` height, the `mean` from floor to ceiling, or in the `layer`.
        """
        if self._room == NOWHERE or time <= self._fire.start:
            return np.zeros(self._building.spaces.count + 1)
        before, after, weight = self._states(time)
        state = (before + weight * (after - before))[:-1]
        volume, share = self._filled(state)
        value = SOOT_EXTINCTION * state[:, SOOT] / volume
        if where == "breathing":
            bottom = self._building.spaces.ceiling * (1.0 - share)
            share = np.clip((BREATHING_HEIGHT - bottom) / BLUR + 0.5, 0.0, 1.0)
        elif where == "layer":
            share = np.ones_like(share)
        return np.append(value * share, 0.0)

    def _filled(self, state: Floats) -> tuple[Floats, Floats]:
        """Of each space: volume of its smoke [m^3], and the share of the space that it fills."""
        spaces = self._building.spaces
        volume = (state[:, MASS] + state[:, HEAT] / (HEAT_CAPACITY * KELVIN)) / DENSITY
        volume = np.maximum(volume, 1e-9)
        return volume, np.minimum(1.0, volume / (spaces.area * spaces.ceiling))

    def is_above_heads(self, time: float) -> bool:
        """Whether there is no smoke at breathing height anywhere: quick, as cameras ask often.

        Volumes change on straight lines from one state of the field to the next, so that it is
        enough to look at both, once.
        """
        if self._room == NOWHERE or time <= self._fire.start:
            return True
        before, after, _ = self._states(time)
        if before is not self._known[0] or after is not self._known[1]:
            ceiling = self._building.spaces.ceiling
            bottoms = [ceiling * (1.0 - self._filled(s[:-1])[1]) for s in (before, after)]
            above = bool(np.min(bottoms) > BREATHING_HEIGHT + BLUR / 2 + 1e-6)
            self._known = before, after, above
        return self._known[2]

    def picture(self, what: str, places: Places, time: float) -> Floats | None:
        """See `HazardField`."""
        if what in ("smoke", "layer"):
            where = "mean" if what == "smoke" else "layer"
            return np.asarray(self.extinctions(time, where)[places.spaces])
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
            self._course = Course(march, smoke.step_without_fire, SMOKE_PACES)
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
