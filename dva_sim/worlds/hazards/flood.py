"""Floods: how much water comes, and how it fills rooms; doors let it through like weirs.

Each space has one level. What flows through a door follows a broad-crested weir, held back by
the water on the other side (Villemonte); outdoors it is gone. No water is lost on the way.

Left out: waves, slopes, drains, water under shut doors.

References:
    V. T. Chow, Open-Channel Hydraulics, New York 1959: broad-crested weirs.
    J. R. Villemonte, Engineering News-Record 139 (1947) 866: submerged weirs.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Annotated

import numpy as np
from pydantic import Field
from typing_extensions import override

from dva_sim.worlds.hazards.building import NO_SPACE, Building, Floats, SitePoints, Spaces
from dva_sim.worlds.hazards.conditions import CLEAR, Conditions
from dva_sim.worlds.hazards.hazard import LARGEST, Hazard, March, SolvedField, Step
from dva_sim.worlds.site import Site

MAX_INFLOW = 10.0  # upper bound of the inflow, beyond any building [m^3/s]; assumed
INFLOW = 2e-3  # inflow of a burst pipe [m^3/s]; assumed
FILM = 5e-3  # depth at which water spreads on a level floor [m]; about twice the capillary length
BASIN = 50.0  # floor area of a usual room [m^2]; assumed
DOOR = 1.2  # width of the room's door [m]; assumed
SILL = 0.01  # height of the door's threshold [m]; assumed
WEIR = 1.705  # coefficient of a broad-crested weir, (2/3)^1.5 sqrt(g) [m^0.5/s]
DEEP = 0.1  # depth that can take a person's footing, and hides steps [m]; assumed
MIN_DANGER = 1.0  # minimum dangerous distance from the source: slippery floor, sockets [m]; assumed
FULL_VOLUME = 1.0  # volume that counts as severity 1 [m^3]; assumed


class Flood(Hazard):
    """Water that comes at a steady rate until it is stopped.

    Attributes:
        inflow: [m^3/s]
    """

    reported_as = "flood"
    title = "flood"
    detectors = ("water",)
    shows = ("water",)
    colour = "#2a7fb8"
    mark = "v"

    inflow: Annotated[float, Field(gt=0, le=MAX_INFLOW)] = INFLOW

    def volume(self, time: float) -> float:
        """Return the water that has come until `time` [s], in [m^3]."""
        return self.inflow * max(0.0, time - self.start)

    @override
    def radius(self, time: float) -> float:
        # Of a film on an open floor.
        return min(LARGEST, math.sqrt(self.volume(time) / (math.pi * FILM)))

    def danger_radius(self, time: float) -> float:
        """See `Hazard`: where water stands more than 0.1 m deep in a usual room, or 1 m.

        The room fills until its door lets as much out as comes.

        References:
            V. T. Chow, Open-Channel Hydraulics, New York 1959: broad-crested weirs.
        """
        if time < self.start:
            return 0.0
        balance = SILL + (self.inflow / (WEIR * DOOR)) ** (2.0 / 3.0)
        deep = min(self.volume(time) / BASIN, balance) > DEEP
        return math.sqrt(BASIN / math.pi) if deep else MIN_DANGER

    @override
    def severity(self, time: float) -> float:
        # The water that has come.
        return min(1.0, self.volume(time) / FULL_VOLUME)

    @override
    def field(self, site: Site) -> FloodField:
        return FloodField(self, site)


EASY = 0.25  # share of the difference of levels that one step may cover


class Filling:
    """Water that comes in one space of a building.

    Args:
        spaces: The building.
        room: Index of the space that it comes in.
        inflow: [m^3/s]
        sill: Height of the thresholds [m].
    """

    def __init__(self, spaces: Spaces, room: int, inflow: float, sill: float = SILL) -> None:
        self._spaces = spaces
        self._room = room
        self._inflow = inflow
        self._sill = np.where(spaces.top < spaces.ceiling[spaces.a], sill, 0.0)
        areas = np.r_[spaces.area, np.inf]
        a = areas[spaces.a]
        b = areas[spaces.b]
        self._levels = 1.0 / (1.0 / a + 1.0 / b)  # volume per difference of levels [m^2]

    def dry(self) -> Floats:
        """Return the water in each space and, last, the water that has run out [m^3]."""
        return np.zeros(self._spaces.count + 1)

    def step(self, state: Floats, age: float, dt: float) -> Floats:
        """Return the state `dt` [s] later."""
        new = self.step_without_inflow(state, age, dt)
        new[self._room] += self._inflow * dt
        return new

    def step_without_inflow(self, state: Floats, age: float, dt: float) -> Floats:
        """Advance a step after the water has been shut off."""
        spaces = self._spaces
        depth = np.append(state[:-1] / spaces.area, 0.0)
        a = depth[spaces.a]
        b = depth[spaces.b]
        flow = np.sign(a - b) * over_weir(
            np.maximum(a, b) - self._sill, np.minimum(a, b) - self._sill, spaces.width
        )
        most = EASY * self._levels * np.abs(a - b) / dt
        moved = np.clip(flow, -most, most) * dt
        return np.asarray(
            state
            - np.bincount(spaces.a, moved, len(state))
            + np.bincount(spaces.b, moved, len(state))
        )


def over_weir(above: Floats, below: Floats, width: Floats) -> Floats:
    """Return the water that flows over a broad crest [m^3/s].

    Args:
        above: Water over the crest on the higher side [m]; none where negative.
        below: On the lower side [m].
        width: Width of the crest [m].
    """
    head = np.maximum(above, 0.0)
    drowned = np.clip(below / np.maximum(head, 1e-12), 0.0, 1.0)
    return np.asarray(WEIR * width * head**1.5 * (1.0 - drowned**1.5) ** 0.385)


@lru_cache(maxsize=64)
def _water(building: Building, inflow: float, room: int) -> tuple[March, Step]:
    filling = Filling(building.spaces, room, inflow)
    return March(filling.dry(), filling.step), filling.step_without_inflow


class FloodField(SolvedField):
    """Water on the floors: one level in each space; where it comes, first a spreading film."""

    def __init__(self, flood: Flood, site: Site) -> None:
        super().__init__(flood, site)
        self._flood = flood

    @override
    def at(self, x: float, y: float, time: float) -> Conditions:
        space = self.building.space_at(x, y)
        if space == NO_SPACE or self.room == NO_SPACE or time <= self._flood.start:
            return CLEAR
        before, after, weight = self.states(time)
        volume = float(before[space]) * (1.0 - weight) + float(after[space]) * weight
        level = volume / float(self.building.spaces.area[space])
        if space == self.room and level < FILM:
            wet = math.dist((x, y), self._flood.position) < math.sqrt(volume / (math.pi * FILM))
            level = FILM if wet else 0.0
        return Conditions(water=level)

    @override
    def picture(self, what: str, places: SitePoints, time: float) -> Floats | None:
        if what != "water":
            return None
        if self.room == NO_SPACE or time <= self._flood.start:
            return np.zeros(places.spaces.shape)
        state = self.state(time)
        level = np.append(state[:-1] / self.building.spaces.area, 0.0)
        depth = level[places.spaces]
        if level[self.room] < FILM:
            here = places.spaces == self.room
            x, y = self._flood.position
            away = np.hypot(places.points[..., 0] - x, places.points[..., 1] - y)
            wet = away < math.sqrt(state[self.room] / (math.pi * FILM))
            depth = np.where(here, np.where(wet, FILM, 0.0), depth)
        return np.asarray(depth)

    @override
    def solve(self) -> tuple[March, Step]:
        return _water(self.building, self._flood.inflow, self.room)
