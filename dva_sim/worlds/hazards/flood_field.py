"""What a flood does to a site: water on its floors."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from dva_sim.worlds.hazards.base import CLEAR, Conditions
from dva_sim.worlds.hazards.building import NOWHERE, Building
from dva_sim.worlds.hazards.course import Course, Places
from dva_sim.worlds.hazards.filling import Filling
from dva_sim.worlds.hazards.flood import FILM, Flood
from dva_sim.worlds.hazards.march import PACES, March

Floats = NDArray[np.float64]


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
        self._course: Course | None = None

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
            self._course = Course(march, filling.step_without_inflow, PACES)
        return self._course.around(time - flood.start, max(0.0, self.until - flood.start))
