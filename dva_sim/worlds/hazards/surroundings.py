"""Conditions that the hazards of a run cause on its site, at any place and time."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dva_sim.worlds.hazards.building import SitePoints, building_of
from dva_sim.worlds.hazards.conditions import CLEAR, QUANTITIES, Conditions, together
from dva_sim.worlds.hazards.hazard import Hazard, HazardField, Point
from dva_sim.worlds.site import Site

RAY = 0.25  # distance between the points of a line of sight [m]


class Raster(NamedTuple):
    """A field for a picture.

    Attributes:
        values: From south to north and west to east, shape `(rows, columns)`.
        extent: West, east, south, north [m], as matplotlib's `imshow` takes it.
        unit: Unit of the values.
    """

    values: NDArray[np.float64]
    extent: tuple[float, float, float, float]
    unit: str


class Surroundings:
    """The hazards of a run; each field is solved only as far as somebody queries it.

    Two fires do not know of each other: their smoke adds up, the hotter air counts.

    Args:
        hazards: Real hazards; false alarms are not among them.
    """

    def __init__(self, site: Site, hazards: Sequence[Hazard]) -> None:
        self._site = site
        self._hazards = tuple(hazards)
        self._places: dict[float, SitePoints] = {}

    @cached_property
    def _fields(self) -> list[HazardField]:
        return [hazard.field(self._site) for hazard in self._hazards]

    @property
    def has_any(self) -> bool:
        """True if there is any hazard."""
        return bool(self._hazards)

    @property
    def may_be_wet(self) -> bool:
        """True if water ever stands on the floor."""
        return any("water" in hazard.shows for hazard in self._hazards)

    def contain(self, number: int, time: float) -> None:
        """Deal with hazard `number`, from 0, at `time` [s]: its source stops for good."""
        field = self._fields[number]
        field.until = min(field.until, time)

    def at(self, x: float, y: float, time: float) -> Conditions:
        """Return the conditions at a place [m] at `time` [s], at breathing height."""
        here = CLEAR
        for hazard, field in zip(self._hazards, self._fields, strict=True):
            if time > hazard.start:
                here = together(here, field.at(x, y, time))
        return here

    def is_hazy(self, time: float) -> bool:
        """Return True if smoke is at eye height anywhere at `time` [s]; fast, for cameras."""
        for field in self._fields:  # noqa: SIM110 - a generator takes as long as the answer
            if field.is_hazy(time):
                return True
        return False

    def optical_depth(self, a: Point, b: Point, time: float) -> float:
        """Extinction by smoke along the straight line between two places, at eye height."""
        hazy = [field for field in self._fields if field.is_hazy(time)]
        if not hazy:
            return 0.0
        length = math.dist(a, b)
        count = max(1, round(length / RAY))
        along = ((np.arange(count) + 0.5) / count)[:, None]
        points = np.array(a) + along * (np.array(b) - np.array(a))
        places = SitePoints(building_of(self._site), points)
        total = sum(float(field.haze(places, time).sum()) for field in hazy)
        return total * length / count

    def raster(self, what: str, time: float, cell: float = 0.25) -> Raster:
        """Return a field as a picture shows it.

        Args:
            what: `smoke` (extinction, mean from floor to ceiling), `layer` (extinction in the
                layer under the ceiling), `gas` (share of the volume), `water` (depth) or
                `heat` (radiant, of flames).
            time: [s]
            cell: Side of a cell [m].
        """
        places = self._places_of(cell)
        west, south, _, _ = self._site.extent
        rows, columns = places.spaces.shape
        values = np.zeros((rows, columns))
        for field in self._fields:
            part = field.picture(what, places, time)
            values = values if part is None else values + part
        extent = west, west + columns * cell, south, south + rows * cell
        return Raster(values, extent, QUANTITIES["smoke" if what == "layer" else what].unit)

    def _places_of(self, cell: float) -> SitePoints:
        """Return the points of a picture, worked out once."""
        if cell not in self._places:
            west, south, east, north = self._site.extent
            x = west + cell * (np.arange(max(1, math.ceil((east - west) / cell - 1e-6))) + 0.5)
            y = south + cell * (np.arange(max(1, math.ceil((north - south) / cell - 1e-6))) + 0.5)
            points = np.stack(np.meshgrid(x, y), axis=2)
            self._places[cell] = SitePoints(building_of(self._site), points)
        return self._places[cell]
