"""Rooms on a site's grid, and the colour by which each is known."""

from __future__ import annotations

import colorsys
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from dva_sim.worlds.camera.surfaces import Ints
from dva_sim.worlds.site import Site

Colours = NDArray[np.uint32]

ACCENTS = 12  # number of different room colours
MAX_CELLS = 4_000_000  # maximum cells of a floor
BORDER = 1.0  # width of unknown ground around a site [m]
BLOCK = 16  # cells per block; floors consist of whole blocks, so that coarser cells fit
FACADE = (0.74, 0.60, 0.50)  # colour of facades from outside
PLAIN = (0.66, 0.68, 0.70)  # colour of bare maps
GOLDEN = 0.61803399  # step of the hue, so that neighbours differ


def pack(colours: Any) -> Colours:
    """Return colours `(..., 3)`, each in one number."""
    rgb = np.asarray(colours, dtype=np.uint32)
    return np.asarray(rgb[..., 0] | rgb[..., 1] << 8 | rgb[..., 2] << 16, dtype=np.uint32)


class RoomGrid:
    """The rooms of a site on a grid, numbered from 1; 0 is outside all.

    Attributes:
        cell: Side of a cell [m].
        origin: x, y of the first cell [m].
        numbers: Room number of each cell `(rows, columns)`, from south to north.
        palette: Colours of rooms, 0 to 1 `(n, 3)`.
        accent: Accent colour of each room.
        outdoor: True for rooms under the open sky.
    """

    def __init__(self, site: Site) -> None:
        xmin, ymin, xmax, ymax = site.extent
        sides = ymax - ymin + 2 * BORDER, xmax - xmin + 2 * BORDER
        self.cell = max(0.05, (sides[0] * sides[1] / MAX_CELLS) ** 0.5)
        self.origin = xmin - BORDER, ymin - BORDER
        rows, columns = (BLOCK * int(np.ceil(side / self.cell / BLOCK)) for side in sides)
        self.numbers = _room_numbers(site, self.origin, self.cell, (rows, columns))
        hues = (0.58 + GOLDEN * np.arange(ACCENTS)) % 1.0
        accents = [colorsys.hls_to_rgb(float(hue), 0.56, 0.42) for hue in hues]
        self.palette = np.array([FACADE if site.rooms else PLAIN, *accents, (0.78, 0.78, 0.80)])
        self.accent = _accents(site)
        self.outdoor = np.array([True, *(room.outdoor for room in site.rooms)])

    def at(self, x: Any, y: Any) -> NDArray[np.uint16]:
        """Return numbers of the rooms at places, arrays of 32 bits [m]."""
        rows, columns = self.numbers.shape
        scale = np.float32(1 / self.cell)
        column = (x - np.float32(self.origin[0])) * scale
        row = (y - np.float32(self.origin[1])) * scale
        np.clip(column, 0, columns - 1, out=column)
        np.clip(row, 0, rows - 1, out=row)
        index = row.astype(np.int32)
        index *= columns
        index += column.astype(np.int32)
        return np.asarray(self.numbers.take(index))


def _accents(site: Site) -> Ints:
    """Return each room's colour in the palette, by the room's number from 1."""
    accents = [0]
    for room in site.rooms:
        if room.outdoor:
            accents.append(0)
        elif "corridor" in room.name.lower():
            accents.append(ACCENTS + 1)
        else:
            accents.append(sum(0 < accent <= ACCENTS for accent in accents) % ACCENTS + 1)
    return np.array(accents, dtype=np.intp)


def _room_numbers(
    site: Site, origin: tuple[float, float], cell: float, shape: tuple[int, int]
) -> NDArray[np.uint16]:
    """Return the number of each cell's room, from 1; 0 outside all rooms."""
    numbers = np.zeros(shape, dtype=np.uint16)
    for number, room in enumerate(site.rooms, 1):
        # Cells whose middles lie inside.
        low = np.ceil((room.polygon.min(axis=0) - origin) / cell - 0.5).astype(int)
        high = np.ceil((room.polygon.max(axis=0) - origin) / cell - 0.5).astype(int)
        columns = np.arange(low[0], high[0])
        rows = np.arange(low[1], high[1])
        x, y = np.meshgrid(origin[0] + (columns + 0.5) * cell, origin[1] + (rows + 0.5) * cell)
        inside = shapely.contains_xy(room.area, x, y)
        numbers[low[1] : high[1], low[0] : high[0]][inside] = number
    return numbers
