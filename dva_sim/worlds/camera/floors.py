"""Floors and ceilings: painted once per site, looked up row by row."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from dva_sim.worlds.camera.room_colours import Colours, RoomGrid, pack
from dva_sim.worlds.camera.surfaces import (
    Floats,
)
from dva_sim.worlds.camera.textures import BASE, POST, Bytes
from dva_sim.worlds.geo import Pose
from dva_sim.worlds.site import Site

OPEN_AIR = np.uint32(1 << 24)

HORIZON = 60.0  # distance at which floors and ceilings end [m]
MIDDLE = 5.0  # distance from which coarser cells suffice [m]
DISTANT = 16.0  # distance from which still coarser cells suffice [m]
TILE = 1.0  # side of a floor tile [m]
JOINT = 0.035  # width of the joint between tiles [m]
HAZE = 250.0  # distance over which daylight falls to a half [m]; assumed
LAMPS = 3.0  # approximate distance between lamps [m]

GRASS = (142, 160, 120)
PAVING = (206, 202, 192)
BARE_FLOOR = (214, 211, 204)
LINOLEUM = (235, 232, 226)
DAYLIGHT = (205, 222, 238)
BARE_CEILING = (208,) * 3
CEILING = (206,) * 3
LAMP = (255, 255, 248)


class Floors:
    """Colours of the floor in rows of pixels.

    Args:
        rooms: Its rooms.
        fall: Slope of each row below the axis of the lens, per metre ahead `(h,)`.
        eye_height: Height of the lens [m].

    Attributes:
        daylight: Light of each row where the sky is above it `(h, 1)`.
        depth: Distance ahead at which each row meets floor or ceiling `(h, 1)` [m].
    """

    def __init__(self, site: Site, rooms: RoomGrid, fall: Floats, eye_height: float) -> None:
        self._rooms = rooms
        floor = self._floor(site)
        parts = [floor, _coarser(floor, 4), _coarser(floor, 16), self._lamps(site)]
        # A bit above the colours tells what lies under the open sky.
        steps = (1, 4, 16, 1)
        open_air = rooms.outdoor & bool(site.rooms)
        self._colours: Colours = np.concatenate(
            [
                (pack(part) | open_air[rooms.numbers[::step, ::step]] * OPEN_AIR).ravel()
                for part, step in zip(parts, steps, strict=True)
            ]
        ).astype(np.uint32)
        above = np.where(fall > 0, eye_height, site.ceiling - eye_height)
        depth = np.minimum(above / np.abs(fall), HORIZON)
        part = np.where(fall > 0, (depth >= MIDDLE) + (depth >= DISTANT), 3)[:, None]
        sizes = np.array([p.shape[:2] for p in parts])
        starts = np.cumsum([0, *sizes.prod(axis=1)[:-1]])
        cell = rooms.cell * np.array(steps)[part]
        self.depth: Floats = depth.astype(np.float32)[:, None]
        sky = 0.94 + 0.2 * np.minimum(np.maximum(fall, -0.4), 0.0)  # deeper higher up
        daylight = np.where(fall > 0, 1.0 / (1.0 + depth / HAZE), sky)
        self.daylight: Floats = daylight.astype(np.float32)[:, None]
        self._per_metre: Floats = (1 / cell).astype(np.float32)
        self._scale: Floats = (depth[:, None] / cell).astype(np.float32)
        self._start = starts[part].astype(np.int32)
        self._columns = sizes[part, 1].astype(np.int32)
        self._last = (sizes[part] - 1).astype(np.float32)

    def seen(self, pose: Pose, slopes: Floats) -> Colours:
        """Return colours of all pixels `(h, w)`.

        Args:
            pose: Pose of the lens [m, rad].
            slopes: Slope of each column to the right, per metre ahead `(w,)`.
        """
        cos = math.cos(pose.heading)
        sin = math.sin(pose.heading)
        x0, y0 = self._rooms.origin
        x = self._scale * (cos + slopes * sin)
        x += (pose.x - x0) * self._per_metre
        y = self._scale * (sin - slopes * cos)
        y += (pose.y - y0) * self._per_metre
        np.clip(x, 0, self._last[..., 1], out=x)
        np.clip(y, 0, self._last[..., 0], out=y)
        index = y.astype(np.int32)
        index *= self._columns
        index += self._start
        index += x.astype(np.int32)
        return self._colours.take(index, mode="clip")

    def _floor(self, site: Site) -> Bytes:
        """Return tiles in a tint of each room's colour; the joints show how the robot moves."""
        colours = self._tints(site)[self._rooms.numbers]
        rows, columns = self._rooms.numbers.shape
        x = self._rooms.origin[0] + (np.arange(columns) + 0.5) * self._rooms.cell
        y = self._rooms.origin[1] + (np.arange(rows) + 0.5) * self._rooms.cell
        line = JOINT / TILE
        joint = ((x / TILE) % 1 < line)[None, :] | ((y / TILE) % 1 < line)[:, None]
        odd = (np.floor(x / TILE)[None, :] + np.floor(y / TILE)[:, None]) % 2
        colours = colours * (0.87 + 0.06 * odd)[..., None]
        colours[joint] *= 0.82
        image = Image.fromarray(np.clip(colours, 0, 255).astype(np.uint8))
        draw = ImageDraw.Draw(image)
        for base in site.robot_bases:
            self._ring(draw, base.x, base.y, 0.42, BASE)
        for post in site.guard_posts:
            self._ring(draw, post.x, post.y, 0.3, POST)
        return np.asarray(image)

    def _tints(self, site: Site) -> NDArray[np.float64]:
        """Return the colour of the floor of each room, by its number `(n, 3)`."""
        tints = 0.55 * np.array(LINOLEUM) + 0.45 * 255 * self._rooms.palette
        rooms = tints[self._rooms.accent]
        rooms[self._rooms.outdoor] = PAVING if site.rooms else BARE_FLOOR
        lawns = [n for n, r in enumerate(site.rooms, 1) if r.outdoor and "lawn" in r.name.lower()]
        rooms[lawns] = GRASS
        if site.rooms:
            rooms[0] = GRASS
        return rooms

    def _ring(self, draw: Any, x: float, y: float, radius: float, colour: Any) -> None:
        """Draw a painted circle on the floor."""
        column = (x - self._rooms.origin[0]) / self._rooms.cell
        row = (y - self._rooms.origin[1]) / self._rooms.cell
        r = radius / self._rooms.cell
        width = max(1, round(0.08 / self._rooms.cell))
        draw.ellipse((column - r, row - r, column + r, row + r), outline=colour, width=width)

    def _lamps(self, site: Site) -> Bytes:
        """Return a white ceiling with lamps over the rooms, the sky elsewhere."""
        rows, columns = self._rooms.numbers.shape
        image = Image.new("RGB", (columns, rows), DAYLIGHT if site.rooms else BARE_CEILING)
        draw = ImageDraw.Draw(image)
        for room in (room for room in site.rooms if not room.outdoor):
            self._fill(draw, room.polygon, CEILING)
            self._lamps_of(draw, room.polygon)
            for hole in room.holes:
                self._fill(draw, hole, DAYLIGHT)
        return np.asarray(image)

    def _fill(self, draw: Any, polygon: NDArray[np.float64], colour: Any) -> None:
        corners = (polygon - self._rooms.origin) / self._rooms.cell - 0.5
        draw.polygon([tuple(c) for c in corners.tolist()], fill=colour)

    def _lamps_of(self, draw: Any, polygon: NDArray[np.float64]) -> None:
        xmin, ymin = polygon.min(axis=0)
        xmax, ymax = polygon.max(axis=0)
        long_x = xmax - xmin >= ymax - ymin
        half = np.array([0.6, 0.12] if long_x else [0.12, 0.6]) / self._rooms.cell
        for x in _evenly(xmin, xmax):
            for y in _evenly(ymin, ymax):
                middle = (np.array([x, y]) - self._rooms.origin) / self._rooms.cell
                draw.rectangle([*(middle - half), *(middle + half)], fill=LAMP)


def _coarser(colours: Bytes, times: int) -> Bytes:
    """Return the mean colour of each block of `times` by `times` cells."""
    rows = colours.shape[0] // times
    columns = colours.shape[1] // times
    blocks = colours.reshape(rows, times, columns, times, 3).mean(axis=(1, 3))
    return np.asarray(blocks, dtype=np.uint8)


def _evenly(low: float, high: float) -> NDArray[np.float64]:
    """Return the positions of lamps between two walls."""
    count = max(1, round((high - low) / LAMPS))
    return low + (np.arange(count) + 0.5) * (high - low) / count
