"""Avoidance of people and other robots: lanes, right of way, and places to wait.

A lane is the planned path, shifted sideways near people and robots. If both sides are equally good,
everybody keeps to the right, so that two who meet do not dodge to the same side.

Right of way where only one fits through: people before robots; then a robot that is already in the
narrow part; then the robot with the lower number. The other one steps aside.

References:
    E. T. Hall: The Hidden Dimension. Doubleday, 1966: personal distance begins at 0.45 m (18
    inches), its far phase ends at 1.2 m (4 feet).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dva_sim.agents.robot.collision_guard import PERSONAL, Nearby
from dva_sim.agents.route_following import Route

Floats = NDArray[np.float64]
Point = tuple[float, float]

SOCIAL = 1.2  # gap to people beyond which a robot drives at full speed [m] (Hall)
SQUEEZE = 0.20  # gap to people who stand in the way and do not move [m]; assumed
CREEP = 0.15  # speed beside people [m/s]; assumed
LANE_ROOM = 0.06  # gap to walls in a lane other than the planned one [m]; assumed

LOOK_AHEAD_M = 4.0  # length of lanes ahead of the robot [m]
STEP = 0.2  # distance between the points of a lane [m]
RAMP = 1.2  # distance on which a lane moves to the side [m]
HOLDS = (1.6, 2.8, 4.0)  # distances at which a lane returns to the middle [m]
SIDES = (0.0, -0.25, 0.25, -0.5, 0.5, -0.7, 0.7, -0.82, 0.82, -1.0, 1.0)  # shifts to the left [m]
LANE_SPARE = 0.02  # gap in a lane on top of the one to be kept [m]
TO_THE_LEFT = 0.2  # additional cost of a lane on the left [m]
CHANGE = 0.3  # cost of changing lanes per distance between them
PACE = 0.4  # speed assumed for the robot's own progress [m/s]
FORESEEN = 6.0  # time for which others are expected to keep their velocity [s]
NARROW = 0.35  # gap to the wall below which nobody can pass [m]
REFUGE = 3.0  # maximum distance of a place to step aside to [m]
SPARE = 0.15  # gap between a robot that has stepped aside and one that passes [m]


# One lane for each side and each distance of its return; the planned path is the first.
_LANES = np.array([(side, hold) for side in SIDES for hold in (HOLDS if side else HOLDS[:1])])
_SIDES, _HOLDS = _LANES.T


class Lane(NamedTuple):
    """Lane past others: its points `(n, 2)` [m], and its shift to the left [m]."""

    points: Floats
    side: float


class Blocked(NamedTuple):
    """Result when no lane is free.

    Attributes:
        by: The nearest obstacle in the lane.
        distance: Distance to it [m].
        gap: Smallest gap to any other body on that lane [m].
        lane: The lane with most room.
    """

    by: Nearby
    distance: float
    gap: float
    lane: Lane


@dataclass(frozen=True)
class Avoidance:
    """Finder of lanes past others.

    Attributes:
        name: Name of this robot.
        radius: Radius of this robot [m].
        room_at: Distance to the nearest wall at points `(n, 2)` [m].
    """

    name: str
    radius: float
    room_at: Callable[[Floats], Floats]

    def yields_to(self, here: Point, others: Sequence[Nearby]) -> list[bool]:
        """Return for each other robot whether it goes first."""
        room = self.room_at(np.array([here, *((other.x, other.y) for other in others)])).tolist()
        is_narrow = room[0] - self.radius < NARROW
        return [
            other.kind == "person"
            or (
                _number(other.name) < _number(self.name)
                if (space - other.radius < NARROW) == is_narrow
                else not is_narrow
            )
            for other, space in zip(others, room[1:], strict=True)
        ]

    def lane(
        self, route: Route, along: float, here: Point, others: Sequence[Nearby], last: float
    ) -> Lane | Blocked:
        """Return the best free lane ahead, or what blocks it.

        Args:
            route: The planned path.
            along: Distance covered along the route [m].
            here: Current position [m].
            others: Others nearby.
            last: Shift to the left that was chosen before [m].
        """
        along_lane = np.arange(0.0, min(LOOK_AHEAD_M, route.length - along) + STEP, STEP)
        base = np.array([route.point_at(along + s) for s in along_lane.tolist()])
        left = _to_the_left(base)
        # Written out: a product of arrays is rounded as the processor's library likes.
        east = here[0] - float(base[0, 0])
        north = here[1] - float(base[0, 1])
        offset = east * float(left[0, 0]) + north * float(left[0, 1])
        places = self._foreseen(along_lane, here, others)
        if last == 0.0:  # no lane can be better than the planned path: look at that alone first
            points = base + _shifts(along_lane, offset, _SIDES[:1], _HOLDS[:1])[..., None] * left
            if self._are_free(points, places, others)[1].all():
                return Lane(points[0], 0.0)
        points = base + _shifts(along_lane, offset, _SIDES, _HOLDS)[..., None] * left
        walls = self._keeps_to_walls(points, base)
        gaps, free = self._are_free(points, places, others)
        keep = _keeps(others)
        cost = np.abs(_SIDES) + TO_THE_LEFT * (_SIDES > 0.0) + CHANGE * np.abs(_SIDES - last)
        choices = np.flatnonzero((walls & free).all(axis=1))
        if len(choices):
            best = int(choices[np.argmin(cost[choices])])
            return Lane(points[best], float(_SIDES[best]))
        # None is free: take the lane where least of the gaps to others is missing.
        lack = np.maximum(keep - gaps, 0.0).max(axis=(0, 2))
        choices = np.flatnonzero(walls.all(axis=1))
        best = int(choices[np.argmin((lack + 0.05 * cost)[choices])])
        lane = Lane(points[best], float(_SIDES[best]))
        return _blocked(others, gaps[:, best], keep[:, 0], along_lane, lane)

    def _keeps_to_walls(self, points: Floats, base: Floats) -> NDArray[np.bool_]:
        """Return where lanes `(k, n, 2)` have room; the planned path has as much as there is."""
        room = self.room_at(points.reshape(-1, 2)).reshape(points.shape[:2])
        needed = np.minimum(self.radius + LANE_ROOM, np.maximum(self.room_at(base), self.radius))
        needed = np.minimum(needed, room[:, :1] + STEP)  # a robot already too near may move away
        keeps = room >= needed - 1e-9
        keeps[0] = True
        return keeps

    def _foreseen(self, along_lane: Floats, here: Point, others: Sequence[Nearby]) -> Floats:
        """Predict where others will be along the robot's path: `(2, others, n)` [m].

        Others with the right of way are expected to keep moving, all others to stay.
        """
        x, y, vx, vy = np.array([(o.x, o.y, o.vx, o.vy) for o in others]).T[..., None]
        first = np.array(self.yields_to(here, others))[:, None]
        time = np.minimum(along_lane / PACE, FORESEEN) * first
        return np.stack([x + vx * time, y + vy * time])

    def _are_free(
        self, points: Floats, places: Floats, others: Sequence[Nearby]
    ) -> tuple[Floats, NDArray[np.bool_]]:
        """Return the gaps to everybody, `(others, k, n)` [m], and where they suffice.

        A gap that is too small already may grow.

        Args:
            points: Points of the lanes, shape `(k, n, 2)` [m].
            places: Predicted positions of others; see `_foreseen`.
            others: The others.

        Returns:
            The gaps, and of all lanes' points whether they are free, shape `(k, n)`.
        """
        x, y = places[:, :, None]
        radii = np.array([other.radius for other in others])[:, None, None]
        gaps = np.hypot(points[..., 0] - x, points[..., 1] - y) - self.radius - radii
        enough = gaps >= np.minimum(_keeps(others), gaps[..., :1] - 0.01)
        return gaps, np.asarray(enough.all(axis=0))

    def refuge(self, here: Point, route: Floats, others: Sequence[Nearby]) -> Point | None:
        """Return the nearest place beside the path where the robot blocks nobody.

        None if there is no such place.

        Args:
            here: Current position [m].
            route: Path to leave free, shape `(n, 2)` [m].
            others: Others nearby.
        """
        rings = np.arange(0.4, REFUGE + 0.1, 0.2)
        angles = np.arange(24) * (2.0 * math.pi / 24)
        spokes = np.stack([np.cos(angles), np.sin(angles)], 1)
        places = (np.array(here) + rings[:, None, None] * spokes).reshape(-1, 2)
        widest = max(other.radius for other in others)
        difference = places[:, None] - route[None]
        gaps = np.asarray(np.hypot(difference[..., 0], difference[..., 1]).min(axis=1))
        off = gaps - self.radius - widest
        good = (off >= SPARE) & (self.room_at(places) >= self.radius + 0.02)
        for place in places[good]:  # nearest first
            if self._can_reach(np.array(here), place, others):
                return float(place[0]), float(place[1])
        return None

    def _can_reach(self, here: Floats, place: Floats, others: Sequence[Nearby]) -> bool:
        """Return True if the straight path keeps clear of walls and others."""
        points = np.linspace(here, place, 2 + int(math.dist(here, place) / 0.1))
        room = self.room_at(points) - self.radius
        if (room < min(0.02, float(room[0]) - 0.01)).any():
            return False
        for other in others:
            gap = np.hypot(*(points - (other.x, other.y)).T) - self.radius - other.radius
            if (gap < min(other.keep, float(gap[0]) - 0.01)).any():
                return False
        return True


def _blocked(
    others: Sequence[Nearby], gaps: Floats, keep: Floats, along_lane: Floats, lane: Lane
) -> Blocked:
    """Return the first obstacle; gaps are `(others, n)`, distances to keep `(others, 1)`."""
    tight = gaps < keep
    at = np.where(tight.any(axis=1), along_lane[tight.argmax(axis=1)], math.inf)
    order = np.lexsort((gaps.min(axis=1), at))
    first = int(order[0])
    return Blocked(others[first], min(float(at[first]), LOOK_AHEAD_M), float(gaps.min()), lane)


def pace_among(people: Sequence[Nearby], here: Point, radius: float, speed: float) -> float:
    """Return a speed limited by the distance of the nearest person.

    It falls from `SOCIAL` on, down to `CREEP` at `PERSONAL`.
    """
    gaps = [math.dist(here, (p.x, p.y)) - radius - p.radius for p in people if p.kind == "person"]
    share = (min(gaps, default=SOCIAL) - PERSONAL) / (SOCIAL - PERSONAL)
    return min(speed, CREEP + max(share, 0.0) * max(speed - CREEP, 0.0))


def _number(name: str) -> tuple[int, str]:
    """Return a sorting key by which robot-2 comes before robot-10."""
    return len(name), name


def _to_the_left(points: Floats) -> Floats:
    """Return the unit vectors to the left of a line, shape `(n, 2)`."""
    ahead = _gradient(points) if len(points) > 1 else np.array([[1.0, 0.0]])
    length = np.maximum(np.hypot(ahead[:, 0], ahead[:, 1]), 1e-9)[:, None]
    return np.asarray(np.stack([-ahead[:, 1], ahead[:, 0]], 1) / length)


def _gradient(points: Floats) -> Floats:
    """Differentiate along a line `(n, 2)` as NumPy does, in a fifth of the time."""
    between = np.empty_like(points)
    between[1:-1] = (points[2:] - points[:-2]) / 2.0
    between[0] = points[1] - points[0]
    between[-1] = points[-1] - points[-2]
    return between


def _shifts(along_lane: Floats, offset: float, sides: Floats, holds: Floats) -> Floats:
    """Return the lateral offsets of lanes, from the present one, aside and back: `(k, n)` [m]."""
    out = np.minimum(along_lane / RAMP, 1.0)
    back = np.minimum(np.maximum((along_lane - holds[:, None]) / RAMP, 0.0), 1.0)
    side = sides[:, None]
    return np.asarray(offset + (side - offset) * out - side * back)


def _keeps(others: Sequence[Nearby]) -> Floats:
    """Return the distance a lane has to keep from each, shape `(others, 1, 1)` [m]."""
    return np.array([other.keep + LANE_SPARE for other in others])[:, None, None]
