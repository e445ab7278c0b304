"""Upright surfaces of a site, and those that each column of a camera's pixels meets.

One ray for each column is enough: walls are upright, so all pixels of a column that show the
same surface are equally far away.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from dva_sim.worlds.geo import Pose
from dva_sim.worlds.site import Site
from dva_sim.worlds.site_parts import DOOR_HEIGHT

Floats = NDArray[np.float32]
Ints = NDArray[np.intp]

SOLID_HEIGHT = 1.8  # height of shelves and machines [m]; assumed
POSTS = 4  # upright parts of a door frame
POST = 0.08  # width of a door post [m]
REVEAL = 0.07  # distance by which a door frame stands out of the wall on both sides [m]
SHORT = 0.6  # shorter pieces of wall, as on bare maps, have no drawn corners [m]
HANGING = 0.04  # maximum distance behind a wall that still counts as on it [m]
NEAR_PLANE_M = 0.05  # nearer parts are cut off [m]
FAR_PLANE_M = 80.0  # farther objects are not looked for [m]

WALL, FRAME, LINTEL, SOLID, LEAF, NOTHING = range(6)


class Hits(NamedTuple):
    """Surfaces met by columns, one entry for each pair `(n,)`.

    Attributes:
        column: Column of the picture.
        surface: Number of the surface.
        depth: Distance ahead of the lens, along its axis [m].
        along: Position on the surface, from its first end [m].
    """

    column: Ints
    surface: Ints
    depth: Floats
    along: Floats

    def where(self, choice: NDArray[Any]) -> Hits:
        """Return a selection of the entries, by mask or by index."""
        return Hits(*(values[choice] for values in self))


class Surfaces:
    """Walls, door frames, lintels and the sides of solids.

    Attributes:
        ends: x1, y1, x2, y2 of each, shape `(n, 4)` [m].
        kind: `WALL`, `FRAME`, `LINTEL`, `SOLID` or the `LEAF` of a shut door; the last one is
            `NOTHING`, without height.
        low: Height of the lower edge [m].
        high: Height of the upper edge [m].
        light: Brightness due to its orientation, 0 to 1.
        door: Door of a lintel, -1 for other surfaces.
        length: [m].
        dark_ends: Ends of the shade of a corner `(n, 2)` [m]; doors make none.
    """

    def __init__(self, site: Site) -> None:
        walls = np.asarray(site.walls, dtype=np.float64).reshape(-1, 4)
        solid = _sides_of_solids(site, walls)
        doors, tall = doorways(site)
        frames = np.vstack([_frame(door) for door in doors]) if len(doors) else doors
        nothing = np.array([[0.0, 0.0, 1.0, 0.0]])
        shut = _shut(doors, walls)
        leaves = _inset(doors[shut])
        parts = [walls[~solid], frames, doors, walls[solid], leaves, nothing]
        heights = (site.ceiling, 0, 0, SOLID_HEIGHT, 0, 0)
        counts = [len(part) for part in parts]
        self.ends: Floats = np.vstack(parts).astype(np.float32)
        self.kind = np.repeat(np.arange(6), counts)
        self.low: Floats = np.zeros(len(self.kind), dtype=np.float32)
        self.high: Floats = np.repeat(np.array(heights, dtype=np.float32), counts)
        self.high[self.kind == FRAME] = np.repeat(tall, POSTS)
        self.high[self.kind == LEAF] = tall[shut]
        self.low[self.kind == LINTEL] = tall
        self.high[self.kind == LINTEL] = site.ceiling
        self.door = np.full(len(self.kind), -1)
        self.door[self.kind == LINTEL] = np.arange(len(doors))
        dx = self.ends[:, 2] - self.ends[:, 0]
        dy = self.ends[:, 3] - self.ends[:, 1]
        self.length: Floats = np.hypot(dx, dy)
        # Light as from high windows in the south-west: walls of the two directions differ.
        across = np.abs(np.cos(np.arctan2(dy, dx) - 0.35))
        self.light: Floats = (0.74 + 0.24 * across).astype(np.float32)
        self.dark_ends = self._dark_ends(doors)
        self._full = self.kind == WALL
        # A shut door hangs on its wall; what stands against a wall does not show through it.
        self._slack = np.where(self.kind == SOLID, -HANGING / 4, HANGING).astype(np.float32)

    def _dark_ends(self, doors: NDArray[np.float64]) -> Floats:
        """Return places of the corners along each surface; far away where there is none."""
        places = np.stack([np.zeros_like(self.length), self.length], axis=1)
        if len(doors):
            jambs = doors.reshape(-1, 1, 1, 2)
            gaps = np.hypot(*np.moveaxis(self.ends.reshape(1, -1, 2, 2) - jambs, -1, 0))
            places[gaps.min(axis=0) < 0.2] = -FAR_PLANE_M
        places[(self.kind == LINTEL) | (self.length < SHORT)] = -FAR_PLANE_M
        return places.astype(np.float32)

    def hits(self, pose: Pose, slopes: Floats) -> tuple[Hits, Hits]:
        """Return the nearest wall of each column, and the surfaces before it.

        Args:
            pose: Pose of the lens [m, rad].
            slopes: Slope of each column to the right, per metre ahead, ascending `(w,)`.

        Returns:
            The nearest wall of each column, `NOTHING` where there is none; and all lower or
            hanging surfaces before it, the farthest first.
        """
        met = self._all_hits(pose, slopes)
        full = self._full[met.surface]
        walls = met.where(full)
        order = np.argsort(-walls.depth, kind="stable")
        nearest = np.full(len(slopes), len(walls.depth))
        nearest[walls.column[order]] = order  # of a column, the nearest is written last
        columns = np.arange(len(slopes))
        walls = Hits(
            columns,
            np.r_[walls.surface, len(self.kind) - 1][nearest],
            np.r_[walls.depth, np.float32(FAR_PLANE_M)][nearest],
            np.r_[walls.along, np.float32(0)][nearest],
        )
        reach = walls.depth[met.column] + self._slack[met.surface]
        before = met.where(~full & (met.depth < reach))
        return walls, before.where(np.argsort(-before.depth, kind="stable"))

    def _all_hits(self, pose: Pose, slopes: Floats) -> Hits:
        """Return every pair of a surface and a column that meets it."""
        cos = math.cos(pose.heading)
        sin = math.sin(pose.heading)
        turn = np.array([[cos, sin], [sin, -cos]], dtype=np.float32)  # ahead, to the right
        ends = (self.ends - np.array([pose.x, pose.y] * 2, dtype=np.float32)).reshape(-1, 2)
        local = (ends @ turn.T).reshape(-1, 4)
        ahead = (np.maximum(local[:, 0], local[:, 2]) > NEAR_PLANE_M) & (
            np.minimum(local[:, 0], local[:, 2]) < FAR_PLANE_M
        )
        ahead[-1] = False
        index = np.flatnonzero(ahead)
        first, last, det, step = _spans(local[index], slopes)
        is_hit = (last > first) & (np.abs(det) > 1e-6)
        index, first, last, det, step = (v[is_hit] for v in (index, first, last, det, step))
        count = last - first
        which = np.repeat(np.arange(len(index)), count)
        column = np.arange(len(which)) - np.repeat(np.cumsum(count) - count - first, count)
        z1 = local[index, 0][which]
        t1 = local[index, 1][which]
        slope = slopes[column]
        dz = step[which, 0]
        dt = step[which, 1]
        # The ray t = slope z meets the line (z1, t1) + s (dz, dt).
        closing = dt - slope * dz
        depth = det[which] / closing
        surface = index[which]
        along = (slope * z1 - t1) / closing * self.length[surface]
        return Hits(column, surface, depth, along)


def _spans(local: Floats, slopes: Floats) -> tuple[Any, ...]:
    """Return the first and last column of each surface, cut off at the lens."""
    z1, t1, z2, t2 = local.T
    dz = z2 - z1
    dt = t2 - t1
    det = z1 * dt - t1 * dz
    with np.errstate(divide="ignore", invalid="ignore"):
        cut1 = np.where(z1 < NEAR_PLANE_M, t1 + (NEAR_PLANE_M - z1) / dz * dt, t1) / np.maximum(
            z1, NEAR_PLANE_M
        )
        cut2 = np.where(z2 < NEAR_PLANE_M, t2 + (NEAR_PLANE_M - z2) / dz * dt, t2) / np.maximum(
            z2, NEAR_PLANE_M
        )
    first = np.searchsorted(slopes, np.minimum(cut1, cut2))
    last = np.searchsorted(slopes, np.maximum(cut1, cut2))
    return first, last, det, np.stack([dz, dt], axis=1)


def _sides_of_solids(site: Site, walls: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which walls are sides of solids rather than of rooms."""
    corners = {
        corner for solid in site.solids for corner in map(tuple, np.round(solid, 3).tolist())
    }
    ends = np.round(walls, 3).tolist()
    return np.array([(a, b) in corners and (c, d) in corners for a, b, c, d in ends], dtype=bool)


def doorways(site: Site) -> tuple[NDArray[np.float64], Floats]:
    """Return doors and exits: ends x1, y1, x2, y2, shape `(n, 4)` [m], and heights `(n,)` [m]."""
    exits = [exit_.ends for exit_ in site.exits]
    ends = np.vstack([np.reshape(site.doors, (-1, 4)), np.reshape(exits, (-1, 4))])
    heights = site.door_heights or (DOOR_HEIGHT,) * len(site.doors)
    return ends, np.array([*heights, *(DOOR_HEIGHT for _ in exits)], dtype=np.float32)


def _shut(doors: NDArray[np.float64], walls: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which doors have a wall right across them: exits that nobody drives through `(n,)`."""
    lines: Any = shapely.linestrings(walls.reshape(-1, 2, 2))
    middles: Any = shapely.points((doors[:, :2] + doors[:, 2:]) / 2)
    gaps = shapely.distance(middles[:, None], lines[None, :])
    return np.asarray(gaps.min(axis=1, initial=np.inf) < HANGING)


def _inset(doors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the leaves of doors, between their posts."""
    along = doors[:, 2:] - doors[:, :2]
    along = along / np.maximum(np.hypot(*along.T), 1e-6)[:, None] * POST
    return np.hstack([doors[:, :2] + along, doors[:, 2:] - along])


def _frame(door: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return posts of a door: across its line and along it, at both ends `(4, 4)` [m]."""
    a = door[:2]
    b = door[2:]
    along = (b - a) / max(float(np.hypot(*(b - a))), 1e-6)
    across = np.array([-along[1], along[0]]) * REVEAL
    posts = []
    for end, inward in ((a, along), (b, -along)):
        edge = end + inward * POST
        posts += [np.r_[edge - across, edge + across], np.r_[end, edge]]
    return np.array(posts)
