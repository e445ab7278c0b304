"""Floors and ceilings: painted once per site, looked up row by row.

Walls, frames and signs: columns of texels, painted once per site.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from dva_sim.worlds.camera.surfaces import (
    FRAME,
    LEAF,
    LINTEL,
    SOLID,
    Colours,
    Floats,
    Hits,
    Ints,
    RoomGrid,
    Surfaces,
    doorways,
    pack,
)
from dva_sim.worlds.geo import Pose
from dva_sim.worlds.site import Site
from dva_sim.worlds.site_parts import DOOR_HEIGHT

Bytes = NDArray[np.uint8]

OPEN_AIR = np.uint32(1 << 24)

HORIZON = 60.0  # floors and ceilings end there [m]
MIDDLE, DISTANT = 5.0, 16.0  # from here on coarser cells do [m]
TILE, JOINT = 1.0, 0.035  # of a floor [m]
HAZE = 250.0  # daylight falls off to a half over this distance [m], assumed
LAMPS = 3.0  # about so far apart [m]

GRASS, PAVING, BARE_FLOOR, LINOLEUM = (
    (142, 160, 120),
    (206, 202, 192),
    (214, 211, 204),
    (235, 232, 226),
)
DAYLIGHT, BARE_CEILING, CEILING, LAMP = (205, 222, 238), (208,) * 3, (206,) * 3, (255, 255, 248)
BASE, POST = (42, 104, 176), (54, 128, 62)


class Floors:
    """What rows of pixels show where nothing stands.

    Args:
        site: Whose floors.
        rooms: Its rooms.
        fall: How far below the axis of the lens each row looks, per metre ahead `(h,)`.
        eye_height: Of the lens [m].

    Attributes:
        daylight: Light of each row where the sky is above it `(h, 1)`.
        depth: How far ahead each row meets floor or ceiling `(h, 1)` [m].
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
        self._start, self._columns = starts[part].astype(np.int32), sizes[part, 1].astype(np.int32)
        self._last = (sizes[part] - 1).astype(np.float32)

    def seen(self, pose: Pose, slopes: Floats) -> Colours:
        """Colours of all pixels `(h, w)`.

        Args:
            pose: Of the lens [m, rad].
            slopes: How far to the right each column looks, per metre ahead `(w,)`.
        """
        cos, sin = math.cos(pose.heading), math.sin(pose.heading)
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
        """Tiles in a tint of each room's colour, so that one sees oneself move."""
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
        """Colour of the floor of each room, by its number `(n, 3)`."""
        tints = 0.55 * np.array(LINOLEUM) + 0.45 * 255 * self._rooms.palette
        rooms = tints[self._rooms.accent]
        rooms[self._rooms.outdoor] = PAVING if site.rooms else BARE_FLOOR
        lawns = [n for n, r in enumerate(site.rooms, 1) if r.outdoor and "lawn" in r.name.lower()]
        rooms[lawns] = GRASS
        if site.rooms:
            rooms[0] = GRASS
        return rooms

    def _ring(self, draw: Any, x: float, y: float, radius: float, colour: Any) -> None:
        """A painted circle on the floor."""
        column, row = (
            (x - self._rooms.origin[0]) / self._rooms.cell,
            (y - self._rooms.origin[1]) / self._rooms.cell,
        )
        r = radius / self._rooms.cell
        width = max(1, round(0.08 / self._rooms.cell))
        draw.ellipse((column - r, row - r, column + r, row + r), outline=colour, width=width)

    def _lamps(self, site: Site) -> Bytes:
        """A white ceiling with lamps over the rooms, the sky elsewhere."""
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
        (xmin, ymin), (xmax, ymax) = polygon.min(axis=0), polygon.max(axis=0)
        long_x = xmax - xmin >= ymax - ymin
        half = np.array([0.6, 0.12] if long_x else [0.12, 0.6]) / self._rooms.cell
        for x in _evenly(xmin, xmax):
            for y in _evenly(ymin, ymax):
                middle = (np.array([x, y]) - self._rooms.origin) / self._rooms.cell
                draw.rectangle([*(middle - half), *(middle + half)], fill=LAMP)


def _coarser(colours: Bytes, times: int) -> Bytes:
    """Blocks of cells in one."""
    rows, columns = colours.shape[0] // times, colours.shape[1] // times
    blocks = colours.reshape(rows, times, columns, times, 3).mean(axis=(1, 3))
    return np.asarray(blocks, dtype=np.uint8)


def _evenly(low: float, high: float) -> NDArray[np.float64]:
    """Where lamps hang between two walls."""
    count = max(1, round((high - low) / LAMPS))
    return low + (np.arange(count) + 0.5) * (high - low) / count


TEXELS = 128  # of a wall, from the floor to the ceiling
PANEL, PANEL_COLUMNS = 1.2, 32  # a wall has a joint every so often [m]
WINDOW, WINDOW_COLUMNS = 2.4, 64  # and an outer wall a window [m]
SIGN_COLUMNS = 96  # of a lintel, from post to post
THROUGH = 0.15  # so far on both sides of a wall its rooms are looked for [m]
BEYOND = 0.4  # so far behind a door its room is looked for [m]

WOOD, PLASTER, SKIRTING = (138, 98, 60), (226, 225, 220), (96, 98, 104)
STEEL, GLASS, LEAF_PAINT = (150, 154, 160), (176, 208, 232), (62, 122, 96)
SIGN, EXIT = (40, 62, 96), (26, 122, 66)


class Uprights:
    """How everything upright on a site looks.

    Args:
        site: Whose.
        surfaces: Its upright parts.
        rooms: Its rooms.

    Attributes:
        colours: Of all painted columns, each `TEXELS` from the floor up, in one row.
    """

    def __init__(self, site: Site, surfaces: Surfaces, rooms: RoomGrid) -> None:
        self._surfaces, self._rooms, self._ceiling = surfaces, rooms, site.ceiling
        self.colours: Colours = self._columns(site)

    def texels(self, hits: Hits, pose_xy: tuple[float, float], far: tuple[Floats, Floats]) -> Ints:
        """First texel of the painted column of each hit.

        Args:
            hits: Surfaces and places on them.
            pose_xy: Of the lens [m]; it sees one side.
            far: x and y of the hits [m].
        """
        kind = self._surfaces.kind[hits.surface]
        x, y = far
        x1, y1, x2, y2 = self._surfaces.ends[hits.surface].T
        left = (x2 - x1) * (pose_xy[1] - y1) - (y2 - y1) * (pose_xy[0] - x1) > 0
        gap = np.where(left, THROUGH, -THROUGH) / self._surfaces.length[hits.surface]
        dx, dy = gap * (y1 - y2), gap * (x2 - x1)
        here, beyond = self._rooms.at(x + dx, y + dy), self._rooms.at(x - dx, y - dy)
        column = self._wall_columns(hits, here, beyond)
        column = np.where(kind == FRAME, self._plain + 0, column)
        column = np.where(kind == SOLID, self._plain + 1, column)
        column = np.where(kind == LEAF, self._plain + 2, column)
        lintel = kind == LINTEL
        if lintel.any():
            column[lintel] = self._sign_columns(hits.where(lintel), left[lintel])
        return np.asarray(column * TEXELS, dtype=np.intp)

    def _wall_columns(self, hits: Hits, here: Any, beyond: Any) -> Ints:
        """Panels, and windows where an outer wall has room for them."""
        accent = self._rooms.accent[here]
        length = self._surfaces.length[hits.surface]
        base = accent * (PANEL_COLUMNS + WINDOW_COLUMNS)
        panel = ((hits.along / PANEL) % 1 * PANEL_COLUMNS).astype(np.intp)
        bays = np.floor(length / WINDOW)
        margin = (length - bays * WINDOW) / 2
        inside = (hits.along > margin) & (hits.along < length - margin)
        glazed = inside & (self._rooms.outdoor[here] != self._rooms.outdoor[beyond])
        window = (((hits.along - margin) / WINDOW) % 1 * WINDOW_COLUMNS).astype(np.intp)
        return np.asarray(base + np.where(glazed, PANEL_COLUMNS + window, panel))

    def _sign_columns(self, hits: Hits, left: Any) -> Ints:
        """The side of a lintel that is seen, read from left to right."""
        share = np.clip(hits.along / self._surfaces.length[hits.surface], 0, 0.999)
        # Seen from its left side, a line runs from right to left.
        share = np.where(left, 0.999 - share, share)
        side = 2 * self._surfaces.door[hits.surface] + left
        return np.asarray(self._first_sign + side * SIGN_COLUMNS + share * SIGN_COLUMNS).astype(
            np.intp
        )

    def _columns(self, site: Site) -> Colours:
        """Every painted column, `(n, TEXELS)` in one row, from the floor up."""
        height = (np.arange(TEXELS) + 0.5) / TEXELS * self._ceiling
        parts = []
        for accent in self._rooms.palette:
            parts += [_panels(height, accent), _windows(height, accent)]
        self._plain = len(self._rooms.palette) * (PANEL_COLUMNS + WINDOW_COLUMNS)
        self._first_sign = self._plain + 3
        plain = np.array([WOOD, STEEL, LEAF_PAINT], dtype=np.float64)[:, None, :]
        plain = plain * np.ones((3, TEXELS, 1))
        plain[1] *= (0.9 + 0.1 * (height % 0.45 > 0.04))[:, None]
        plain[2, (height > 0.98) & (height < 1.06)] = STEEL  # the bar to push
        signs = [self._lintel(text, wide, height) for wide, *pair in _signs(site) for text in pair]
        return pack(np.concatenate([*parts, plain, *signs]).clip(0, 255).astype(np.uint8)).ravel()

    def _lintel(self, text: str, wide: float, height: Any) -> NDArray[np.float64]:
        """The wall over a door with the name of the room behind it, `(SIGN_COLUMNS, TEXELS, 3)`."""
        colours = np.ones((SIGN_COLUMNS, TEXELS, 1)) * np.array(PLASTER, dtype=np.float64)
        colours[:, height < DOOR_HEIGHT + 0.08] = WOOD
        room = int(np.count_nonzero(height > DOOR_HEIGHT + 0.12))
        tall = max(4, min(14, room - 3))
        size = wide, tall * self._ceiling / TEXELS
        plate = _plate(text, size).resize((SIGN_COLUMNS - 6, tall), Image.Resampling.LANCZOS)
        first = TEXELS - room
        colours[3:-3, first : first + tall] = np.asarray(plate)[::-1].transpose(1, 0, 2)
        return colours


def _panels(height: Any, accent: Any) -> NDArray[np.float64]:
    """A wall: skirting, a band in the room's colour, plaster; joints between panels."""
    colours = np.ones((PANEL_COLUMNS, TEXELS, 1)) * np.array(PLASTER, dtype=np.float64)
    colours[:, height < 1.0] = 255 * np.asarray(accent)
    colours[:, (height >= 1.0) & (height < 1.05)] = 170 * np.asarray(accent)
    colours[:, height < 0.1] = SKIRTING
    colours[0] *= 0.88
    return colours


def _windows(height: Any, accent: Any) -> NDArray[np.float64]:
    """An outer wall with a window in the middle of each bay."""
    wall = _panels(height, accent)
    colours = np.repeat(wall[1:2], WINDOW_COLUMNS, axis=0)
    tall = (height > 1.0) & (height < 2.2)
    pane = (height > 1.06) & (height < 2.14)
    low, high, middle = 10, WINDOW_COLUMNS - 10, WINDOW_COLUMNS // 2
    colours[low:high, tall] = (240, 240, 238)
    sky = np.array(GLASS) * (0.86 + 0.16 * (height[pane] - 1.06))[:, None]
    for first, last in ((low + 2, middle - 1), (middle + 1, high - 2)):
        colours[first:last, pane] = sky
    return colours


def _signs(site: Site) -> list[tuple[float, str, str]]:
    """Of each door: its width [m], and its signs seen from the right of its line and the left."""
    signs = []
    for x1, y1, x2, y2 in doorways(site)[0].tolist():
        wide = max(float(np.hypot(x2 - x1, y2 - y1)), 0.1)
        left = np.array([-(y2 - y1), x2 - x1]) / wide * BEYOND
        middle = np.array([x1 + x2, y1 + y2]) / 2
        signs.append((wide, _name(site, middle + left), _name(site, middle - left)))
    return signs


def _name(site: Site, point: Any) -> str:
    """What a sign calls a place [m]."""
    inside = [room for room in site.rooms if not room.outdoor and room.contains(*point)]
    return inside[0].name if inside else "Exit"


def _plate(text: str, size: tuple[float, float]) -> Image.Image:
    """A sign of a size [m] with a word on it."""
    width, height = (round(400 * side) for side in size)
    image = Image.new("RGB", (width, height), EXIT if text == "Exit" else SIGN)
    points = 0.95 * height
    font = ImageFont.load_default(points)
    while points > 8 and font.getlength(text) > 0.94 * width:
        points *= 0.94
        font = ImageFont.load_default(points)
    ImageDraw.Draw(image).text((width / 2, height / 2), text, font=font, fill="white", anchor="mm")
    return image
