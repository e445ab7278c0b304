"""Range finders: how far it is to the nearest wall, robot or person, ray by ray.

All rays of all robots that ask at the same time are cast together. What stands in the way is
taken by itself: the angle under which it is seen says which rays can meet it, and only with
these it is cut, exactly. Walls out of reach are left out by a grid of cells.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from dva_sim.worlds.bodies import Body, RobotBody
from dva_sim.worlds.physics import World

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

CELL: Final = 2.0  # side of the cells by which walls are indexed [m]
LISTENS: Final = 0.25  # a reader this recent will read again [s]
EDGE: Final = 1e-9  # a ray through a corner meets both walls, never neither


class Lidar:
    """A kind of lidar; one serves all robots that carry it.

    Args:
        rays: Per scan, evenly all around, the first one ahead.
        reach: Range [m].
    """

    def __init__(self, world: World, rays: int = 36, reach: float = 8.0) -> None:
        self.rays = rays
        self.reach = reach
        self._step = 2.0 * math.pi / rays
        self.angles: Floats = self._step * np.arange(rays, dtype=np.float64)
        self._world = world
        self._walls = world.site.walls
        self._near: dict[tuple[int, int], Ints] = {}
        self._asked: dict[RobotBody, float] = {}
        self._seen: dict[RobotBody, Floats] = {}
        self._seen_at = -math.inf

    def scan(self, bodies: Sequence[RobotBody]) -> Floats:
        """Return distances from the middle of each body, rays counter-clockwise.

        Returns:
            Shape `(n, rays)` [m]; `reach` where nothing is met.
        """
        eyes = np.array([body.pose() for body in bodies]).reshape(-1, 3)
        best = np.full(len(bodies) * self.rays, self.reach)
        self._meet_segments(eyes, best, *self._walls_near(eyes))
        bodies_around = [*self._world.robots, *self._world.people]
        near, by = self._others_near(bodies, eyes, bodies_around)
        angular = np.array([bool(_corners(body)) for body in bodies_around], bool)
        discs = ~angular[near]
        edged = angular[near]
        places = np.array([(body.x, body.y, body.radius) for body in bodies_around]).reshape(-1, 3)
        self._meet_discs(eyes, best, by[discs], places[near[discs]])
        self._meet_segments(eyes, best, *_edges(bodies_around, near[edged], by[edged]))
        return best.reshape(len(bodies), self.rays)

    def read(self, body: RobotBody) -> Floats:
        """Return a scan of one body, shape `(rays,)` [m]: the same as `scan` gives, but cheaper.

        Those who listen are scanned along with the first of them that asks in a tick.
        """
        now = self._world.time
        listeners = {body: None}
        if now != self._seen_at:
            self._asked = {b: last for b, last in self._asked.items() if now - last <= LISTENS}
            listeners.update(dict.fromkeys(self._asked))
            self._seen = {}
            self._seen_at = now
        if body not in self._seen:
            self._seen.update(zip(listeners, self.scan(list(listeners)), strict=True))
        self._asked[body] = now
        return self._seen[body]

    # --- what may be met ---------------------------------------------------------------

    def _walls_near(self, eyes: Floats) -> tuple[Ints, Floats]:
        """Walls that may be in reach of each eye: whose eye, shape `(k,)`, and `(k, 4)` [m]."""
        cells = np.floor(eyes[:, :2] / CELL).astype(int).tolist()
        near = [self._walls_about(column, row) for column, row in cells]
        by = np.repeat(np.arange(len(near)), [len(walls) for walls in near])
        return by, self._walls[np.concatenate([np.empty(0, np.int64), *near])]

    def _walls_about(self, column: int, row: int) -> Ints:
        """Return walls in reach of somewhere in a cell, kept for the next time."""
        key = column, row
        if key not in self._near:
            middle = CELL * (np.array(key) + 0.5)
            away = _distance(self._walls, middle)
            self._near[key] = np.flatnonzero(away <= self.reach + CELL * math.sqrt(0.5))
        return self._near[key]

    def _others_near(
        self, bodies: Sequence[RobotBody], eyes: Floats, others: Sequence[Body]
    ) -> tuple[Ints, Ints]:
        """Return pairs within reach: indices in `others`, and in `bodies`."""
        at = np.array([(body.x, body.y, body.radius) for body in others]).reshape(-1, 3)
        away = np.hypot(at[:, 0] - eyes[:, :1], at[:, 1] - eyes[:, 1:2])
        number_of = {body: number for number, body in enumerate(others)}
        away[np.arange(len(bodies)), [number_of[body] for body in bodies]] = np.inf  # itself
        by, seen = np.nonzero(away < self.reach + at[:, 2])
        return seen, by

    # --- cutting rays with it ----------------------------------------------------------

    def _rays_between(self, low: Floats, span: Floats) -> tuple[Ints, Ints]:
        """Return rays within each of some angles, from `low` counter-clockwise [rad].

        Returns:
            Which angle, and which ray, one row for each that may fall into it.
        """
        turn = 2.0 * math.pi
        low = low % turn
        firsts = []
        lasts = []
        for begin in (low, low - turn):  # what crosses the first ray comes in two parts
            firsts.append(np.maximum(np.ceil(begin / self._step - EDGE), 0).astype(np.int64))
            last = np.floor((begin + span) / self._step + EDGE).astype(np.int64)
            lasts.append(np.minimum(last, self.rays - 1))
        first = np.concatenate(firsts)
        last = np.concatenate(lasts)
        count = np.maximum(last - first + 1, 0)
        which = np.repeat(np.arange(len(first)), count)
        before = np.cumsum(count) - count
        ray = first[which] + np.arange(len(which)) - before[which]
        return which % max(len(low), 1), ray

    def _meet_segments(self, eyes: Floats, best: Floats, by: Ints, ends: Floats) -> None:
        x, y, heading = eyes[by].T
        ax = ends[:, 0] - x
        ay = ends[:, 1] - y
        bx = ends[:, 2] - x
        by_ = ends[:, 3] - y
        span = np.arctan2(ax * by_ - ay * bx, ax * bx + ay * by_)
        low = np.arctan2(ay, ax) - heading + np.minimum(span, 0.0)
        which, ray = self._rays_between(low, np.abs(span))
        angle = heading[which] + self.angles[ray]
        ux = np.cos(angle)
        uy = np.sin(angle)
        ax = ax[which]
        ay = ay[which]
        ex = bx[which] - ax
        ey = by_[which] - ay
        across = ux * ey - uy * ex
        with np.errstate(divide="ignore", invalid="ignore"):
            distance = (ax * ey - ay * ex) / across
            share = (ax * uy - ay * ux) / across
        met = (share >= -EDGE) & (share <= 1.0 + EDGE) & (distance >= 0.0)
        np.minimum.at(best, (by[which] * self.rays + ray)[met], distance[met])

    def _meet_discs(self, eyes: Floats, best: Floats, by: Ints, discs: Floats) -> None:
        x, y, heading = eyes[by].T
        dx = discs[:, 0] - x
        dy = discs[:, 1] - y
        radius = discs[:, 2]
        away = np.hypot(dx, dy)
        half = np.where(away > radius, np.arcsin(np.minimum(radius / away, 1.0)), math.pi)
        which, ray = self._rays_between(np.arctan2(dy, dx) - heading - half, 2.0 * half)
        angle = heading[which] + self.angles[ray]
        ux = np.cos(angle)
        uy = np.sin(angle)
        dx = dx[which]
        dy = dy[which]
        along = dx * ux + dy * uy
        aside = dx * uy - dy * ux
        rest = radius[which] ** 2 - aside**2
        met = rest >= 0.0
        distance = np.maximum(along[met] - np.sqrt(rest[met]), 0.0)
        np.minimum.at(best, (by[which] * self.rays + ray)[met], distance)


def _distance(walls: Floats, point: Floats) -> Floats:
    """Return the distance of each wall `(n, 4)` from a point [m]."""
    a = walls[:, :2]
    along = walls[:, 2:] - walls[:, :2]
    square = np.maximum((along**2).sum(axis=1), 1e-300)
    share = np.clip(((point - a) * along).sum(axis=1) / square, 0.0, 1.0)
    return np.asarray(np.hypot(*(a + share[:, None] * along - point).T))


def _corners(body: Body) -> tuple[tuple[float, float], ...]:
    return body.spec.corners if isinstance(body, RobotBody) else ()


def _edges(others: Sequence[Body], seen: Ints, by: Ints) -> tuple[Ints, Floats]:
    """Return the sides of bodies with corners, for each eye that may see them."""
    sides = {int(number): _sides(others[number]) for number in np.unique(seen)}
    near = [sides[number] for number in seen.tolist()]
    whose = np.repeat(by, [len(ends) for ends in near])
    return whose, np.concatenate([np.empty((0, 4)), *near])


def _sides(body: Body) -> Floats:
    """Return the sides of a body now, shape `(k, 4)` [m]."""
    corners = np.array(_corners(body))
    cos = math.cos(body.body.angle)
    sin = math.sin(body.body.angle)
    xy = corners @ np.array([[cos, sin], [-sin, cos]]) + (body.x, body.y)
    return np.hstack([xy, np.roll(xy, -1, axis=0)])
