"""Walls, frames and signs: columns of texels, painted once per site."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from dva_sim.worlds.camera.room_colours import Colours, RoomGrid, pack
from dva_sim.worlds.camera.surfaces import (
    FRAME,
    LEAF,
    LINTEL,
    SOLID,
    Floats,
    Hits,
    Ints,
    Surfaces,
    doorways,
)
from dva_sim.worlds.site import Site
from dva_sim.worlds.site_parts import DOOR_HEIGHT

Bytes = NDArray[np.uint8]
BASE = (42, 104, 176)
POST = (54, 128, 62)


TEXELS = 128  # texels of a wall from the floor to the ceiling
PANEL = 1.2  # distance between joints of a wall [m]
PANEL_COLUMNS = 32
WINDOW = 2.4  # distance between windows of an outer wall [m]
WINDOW_COLUMNS = 64
SIGN_COLUMNS = 96  # texels of a lintel from post to post
BESIDE_WALL_M = 0.15  # distance on both sides of a wall at which its rooms are looked up [m]
BEHIND_DOOR_M = 0.4  # distance behind a door at which its room is looked up [m]

WOOD = (138, 98, 60)
PLASTER = (226, 225, 220)
SKIRTING = (96, 98, 104)
STEEL = (150, 154, 160)
GLASS = (176, 208, 232)
LEAF_PAINT = (62, 122, 96)
SIGN = (40, 62, 96)
EXIT = (26, 122, 66)


class Uprights:
    """Textures of everything upright on a site.

    Args:
        surfaces: Its upright parts.
        rooms: Its rooms.

    Attributes:
        colours: Colours of all painted columns, each `TEXELS` from the floor up, in one row.
    """

    def __init__(self, site: Site, surfaces: Surfaces, rooms: RoomGrid) -> None:
        self._surfaces = surfaces
        self._rooms = rooms
        self._ceiling = site.ceiling
        self.colours: Colours = self._columns(site)

    def texels(self, hits: Hits, pose_xy: tuple[float, float], far: tuple[Floats, Floats]) -> Ints:
        """Return the first texel of the painted column of each hit.

        Args:
            hits: Surfaces and places on them.
            pose_xy: Position of the lens [m]; it sees one side.
            far: x and y of the hits [m].
        """
        kind = self._surfaces.kind[hits.surface]
        x, y = far
        x1, y1, x2, y2 = self._surfaces.ends[hits.surface].T
        left = (x2 - x1) * (pose_xy[1] - y1) - (y2 - y1) * (pose_xy[0] - x1) > 0
        gap = np.where(left, BESIDE_WALL_M, -BESIDE_WALL_M) / self._surfaces.length[hits.surface]
        dx = gap * (y1 - y2)
        dy = gap * (x2 - x1)
        here = self._rooms.at(x + dx, y + dy)
        beyond = self._rooms.at(x - dx, y - dy)
        column = self._wall_columns(hits, here, beyond)
        column = np.where(kind == FRAME, self._plain + 0, column)
        column = np.where(kind == SOLID, self._plain + 1, column)
        column = np.where(kind == LEAF, self._plain + 2, column)
        lintel = kind == LINTEL
        if lintel.any():
            column[lintel] = self._sign_columns(hits.where(lintel), left[lintel])
        return np.asarray(column * TEXELS, dtype=np.intp)

    def _wall_columns(self, hits: Hits, here: Any, beyond: Any) -> Ints:
        """Return panels, and windows where an outer wall has room for them."""
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
        """Return the side of a lintel that is seen, read from left to right."""
        share = np.clip(hits.along / self._surfaces.length[hits.surface], 0, 0.999)
        # Seen from its left side, a line runs from right to left.
        share = np.where(left, 0.999 - share, share)
        side = 2 * self._surfaces.door[hits.surface] + left
        return np.asarray(self._first_sign + side * SIGN_COLUMNS + share * SIGN_COLUMNS).astype(
            np.intp
        )

    def _columns(self, site: Site) -> Colours:
        """Return every painted column, `(n, TEXELS)` in one row, from the floor up."""
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
        """Return the wall over a door with the room's name, `(SIGN_COLUMNS, TEXELS, 3)`."""
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
    """Return a wall: skirting, a band in the room's colour, plaster; joints between panels."""
    colours = np.ones((PANEL_COLUMNS, TEXELS, 1)) * np.array(PLASTER, dtype=np.float64)
    colours[:, height < 1.0] = 255 * np.asarray(accent)
    colours[:, (height >= 1.0) & (height < 1.05)] = 170 * np.asarray(accent)
    colours[:, height < 0.1] = SKIRTING
    colours[0] *= 0.88
    return colours


def _windows(height: Any, accent: Any) -> NDArray[np.float64]:
    """Return an outer wall with a window in the middle of each bay."""
    wall = _panels(height, accent)
    colours = np.repeat(wall[1:2], WINDOW_COLUMNS, axis=0)
    tall = (height > 1.0) & (height < 2.2)
    pane = (height > 1.06) & (height < 2.14)
    low = 10
    high = WINDOW_COLUMNS - 10
    middle = WINDOW_COLUMNS // 2
    colours[low:high, tall] = (240, 240, 238)
    sky = np.array(GLASS) * (0.86 + 0.16 * (height[pane] - 1.06))[:, None]
    for first, last in ((low + 2, middle - 1), (middle + 1, high - 2)):
        colours[first:last, pane] = sky
    return colours


def _signs(site: Site) -> list[tuple[float, str, str]]:
    """Return the width [m] of each door, and its signs as seen from the right and the left."""
    signs = []
    for x1, y1, x2, y2 in doorways(site)[0].tolist():
        wide = max(float(np.hypot(x2 - x1, y2 - y1)), 0.1)
        left = np.array([-(y2 - y1), x2 - x1]) / wide * BEHIND_DOOR_M
        middle = np.array([x1 + x2, y1 + y2]) / 2
        signs.append((wide, _name(site, middle + left), _name(site, middle - left)))
    return signs


def _name(site: Site, point: Any) -> str:
    """Return the name of a place [m] on a sign."""
    inside = [room for room in site.rooms if not room.outdoor and room.contains(*point)]
    return inside[0].name if inside else "Exit"


def _plate(text: str, size: tuple[float, float]) -> Image.Image:
    """Return a sign of a size [m] with a word on it."""
    width, height = (round(400 * side) for side in size)
    image = Image.new("RGB", (width, height), EXIT if text == "Exit" else SIGN)
    points = 0.95 * height
    font = ImageFont.load_default(points)
    while points > 8 and font.getlength(text) > 0.94 * width:
        points *= 0.94
        font = ImageFont.load_default(points)
    ImageDraw.Draw(image).text((width / 2, height / 2), text, font=font, fill="white", anchor="mm")
    return image
