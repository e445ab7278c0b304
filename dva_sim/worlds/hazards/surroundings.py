"""All hazards of one run on one site: what the air is like anywhere, at any time."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dva_sim.worlds.hazards.base import AMBIENT, Conditions, Hazard, Point
from dva_sim.worlds.hazards.fire import Fire
from dva_sim.worlds.sight import Sight
from dva_sim.worlds.site import Site


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

    Args:
        site: Where.
        hazards: What may happen there.
    """

    def __init__(self, site: Site, hazards: Sequence[Hazard]) -> None:
        self._site, self._hazards = site, list(hazards)
        self._sight = Sight(site.walls)
        self._until = [math.inf] * len(self._hazards)

    def contain(self, number: int, time: float) -> None:
        """Hazard `number` is dealt with at `time` [s]: its source stops, its fields decay."""
        self._until[number] = min(time, self._until[number])

    def at(self, x: float, y: float, time: float) -> Conditions:
        """What it is like at a place [m] at `time` [s]."""
        heat = 0.0
        for hazard, until in zip(self._hazards, self._until, strict=True):
            if (
                isinstance(hazard, Fire)
                and hazard.start <= time < until
                and self._sight.between((x, y), hazard.position)
            ):
                heat += hazard.heat_flux(time, (x, y))
        return Conditions(AMBIENT, heat)

    def optical_depth(self, a: Point, b: Point, time: float) -> float:
        """Extinction by smoke along the straight line between two places [m]."""
        return 0.0

    def raster(self, what: str, time: float, cell: float = 0.25) -> Raster:
        """A field as a picture shows it: `smoke`, `gas`, `water` or `heat`."""
        west, south, east, north = self._site.extent
        shape = round((north - south) / cell), round((east - west) / cell)
        return Raster(np.zeros(shape), (west, east, south, north), "1/m")
