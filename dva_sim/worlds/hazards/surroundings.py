"""All hazards of one run on one site: what it is like anywhere, at any time."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dva_sim.worlds.hazards.building import building_of
from dva_sim.worlds.hazards.field import (
    AMBIENT,
    CLEAR,
    Conditions,
    Hazard,
    HazardField,
    Places,
    Point,
)
from dva_sim.worlds.hazards.fire_field import FireField
from dva_sim.worlds.hazards.flood import Flood
from dva_sim.worlds.hazards.gas_dispersion import mesh_in
from dva_sim.worlds.hazards.gas_leak_field import LeakField
from dva_sim.worlds.hazards.registry import field_of
from dva_sim.worlds.layout import Site
from dva_sim.worlds.line_of_sight import Sight

UNITS = {"smoke": "1/m", "layer": "1/m", "gas": "1", "water": "m", "heat": "kW/m2"}
RAY = 0.25  # between the points of a line of sight [m]


class Raster(NamedTuple):
    """A field for a picture.

    Attributes:
        values: From south to north and west to east, shape `(rows, columns)`.
        extent: West, east, south, north [m], as matplotlib's `imshow` takes it.
        unit: Of the values.
    """

    values: NDArray[np.float64]
    extent: tuple[float, float, float, float]
    unit: str


class Surroundings:
    """All hazards of one run; each field is solved only when and as far as somebody asks.

    Two fires do not know of each other: their smoke adds up, the hotter air counts.

    Args:
        site: Where.
        hazards: What happens there; what is reported and not there is not among them.
    """

    def __init__(self, site: Site, hazards: Sequence[Hazard]) -> None:
        self._site, self._hazards = site, tuple(hazards)
        self._places: dict[float, Places] = {}

    @cached_property
    def _fields(self) -> list[HazardField]:
        building, sight = building_of(self._site), Sight(self._site.walls)
        return [field_of(hazard, building, sight) for hazard in self._hazards]

    @cached_property
    def _fires(self) -> list[FireField]:
        return [field for field in self._fields if isinstance(field, FireField)]

    @property
    def has_any(self) -> bool:
        """Whether there is any hazard."""
        return bool(self._hazards)

    @property
    def may_be_wet(self) -> bool:
        """Whether water ever stands on the floor."""
        return any(isinstance(hazard, Flood) for hazard in self._hazards)

    def contain(self, number: int, time: float) -> None:
        """Hazard `number`, from 0, is dealt with at `time` [s]: its source stops for good."""
        field = self._fields[number]
        field.until = min(field.until, time)

    def at(self, x: float, y: float, time: float) -> Conditions:
        """What it is like at a place [m] at `time` [s], at breathing height."""
        here = CLEAR
        for hazard, field in zip(self._hazards, self._fields, strict=True):
            if time > hazard.start:
                here = _together(here, field.at(x, y, time))
        return here

    def optical_depth(self, a: Point, b: Point, time: float) -> float:
        """Extinction by smoke along the straight line between two places, at eye height."""
        smoky = [f for f in self._fires if not f.is_above_heads(time)]
        if not smoky:
            return 0.0
        length = math.dist(a, b)
        count = max(1, round(length / RAY))
        along = ((np.arange(count) + 0.5) / count)[:, None]
        spaces = self._spaces(np.array(a) + along * (np.array(b) - np.array(a)))
        total = sum(float(f.extinctions(time)[spaces].sum()) for f in smoky)
        return total * length / count

    def raster(self, what: str, time: float, cell: float = 0.25) -> Raster:
        """A field as a picture shows it.

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
        return Raster(values, extent, UNITS[what])

    # --- where points lie --------------------------------------------------------------

    def _places_of(self, cell: float) -> Places:
        """The points of a picture, worked out once."""
        if cell not in self._places:
            west, south, east, north = self._site.extent
            x = west + cell * (np.arange(max(1, math.ceil((east - west) / cell - 1e-6))) + 0.5)
            y = south + cell * (np.arange(max(1, math.ceil((north - south) / cell - 1e-6))) + 0.5)
            points = np.stack(np.meshgrid(x, y), axis=2)
            building, leaks = (
                building_of(self._site),
                any(isinstance(field, LeakField) for field in self._fields),
            )
            nodes = mesh_in(building).nodes if leaks else np.full(building.labels.shape, -1)
            self._places[cell] = Places(points, self._spaces(points), self._pick(nodes, points))
        return self._places[cell]

    def _spaces(self, points: NDArray[np.float64]) -> NDArray[np.int64]:
        """Index of the space at each point `(..., 2)` [m], or -1."""
        return self._pick(building_of(self._site).labels, points)

    def _pick(self, cells: NDArray[np.integer], points: NDArray[np.float64]) -> NDArray[np.int64]:
        """What a grid says at each point `(..., 2)` [m]; -1 beyond it."""
        origin, resolution = self._site.grid.origin, self._site.grid.resolution
        cos, sin = math.cos(origin.heading), math.sin(origin.heading)
        dx, dy = points[..., 0] - origin.x, points[..., 1] - origin.y
        columns = np.floor((cos * dx + sin * dy) / resolution).astype(np.int64)
        rows = np.floor((cos * dy - sin * dx) / resolution).astype(np.int64)
        height, width = cells.shape
        inside = (rows >= 0) & (rows < height) & (columns >= 0) & (columns < width)
        return np.where(inside, cells[rows * inside, columns * inside], -1).astype(np.int64)


def _together(a: Conditions, b: Conditions) -> Conditions:
    """The air with both hazards; gases explode together by their shares of their limits.

    References:
        H. Le Chatelier, Annales des Mines 19 (1891) 388: limits of mixed gases.
    """
    return Conditions(
        max(a.temperature, b.temperature, AMBIENT),
        a.heat_flux + b.heat_flux,
        a.extinction + b.extinction,
        a.co + b.co,
        min(1.0, a.gas + b.gas),
        a.water + b.water,
        a.explosive + b.explosive,
    )
