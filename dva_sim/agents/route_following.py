"""Geometry of following a route: where am I on it, and which way is ahead.

References:
    R. C. Coulter: Implementation of the pure pursuit path tracking algorithm.
    CMU-RI-TR-92-01, 1992.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

REACH = 2.0  # on a route in a building, one looks for one's place so far ahead of the last [m]
BENT = 1.5  # way along a route to what one moves straight; around a right angle, up to 1.41


def wrap(angle: float) -> float:
    """The same angle in (-pi, pi] [rad]."""
    return math.remainder(angle, 2.0 * math.pi)


class Ahead(NamedTuple):
    """The target on the route as seen from a pose.

    Attributes:
        bearing: Direction to the look-ahead point, relative to the heading [rad].
        distance: Distance to it [m].
        remaining: Way left on the route [m].
        offset: Distance from the route [m].
    """

    bearing: float
    distance: float
    remaining: float
    offset: float


class _Leg(NamedTuple):
    """A straight piece: its beginning [m], the way to its end [m] and the square of that."""

    x: float
    y: float
    dx: float
    dy: float
    square: float


class Route:
    """A polyline to follow, and how far along it one has come.

    One's place on it is the nearest one that can have been reached: not behind the piece where one
    was, and ahead of that no farther along the route than one may have come since, and `reach`. So
    it does not matter how finely a route is cut nor how seldom one looks, and a later part of a
    route that folds back beside an earlier one is not taken for it.

    Args:
        points: Corners, shape `(n, 2)` [m], n >= 2.
        reach: How far ahead, beyond what one may have come [m]. A corner may be cut by so much of
            the route; where laps lie on each other, it should be well below a lap.
    """

    def __init__(self, points: NDArray[np.float64], reach: float = REACH) -> None:
        self._points = [(float(x), float(y)) for x, y in points]
        steps = np.hypot(*np.diff(points, axis=0).T)
        self._legs = [
            _Leg(ax, ay, bx - ax, by - ay, (bx - ax) * (bx - ax) + (by - ay) * (by - ay))
            for (ax, ay), (bx, by) in pairwise(self._points)
        ]
        self._at: list[float] = [0.0, *np.cumsum(steps).tolist()]
        self._segment, self._along, self._seen = 0, 0.0, self._points[0]
        self._reach = reach
        self.points = points

    @property
    def length(self) -> float:
        """Whole way [m]."""
        return self._at[-1]

    @property
    def left(self) -> float:
        """Way left from the beginning of the piece that one was on when one last looked [m]."""
        return self._at[-1] - self._at[self._segment]

    def ahead(self, x: float, y: float, heading: float, look_ahead: float) -> Ahead:
        """What to aim at from a pose; never steps back along the route.

        Args:
            x: Position [m].
            y: Position [m].
            heading: Heading [rad].
            look_ahead: How far ahead on the route the target lies [m].
        """
        along, offset = self._project(x, y)
        tx, ty = self.point_at(along + look_ahead)
        bearing = wrap(math.atan2(ty - y, tx - x) - heading)
        distance = math.hypot(tx - x, ty - y)
        return Ahead(bearing, distance, self.length - along, offset)

    def advance(self, x: float, y: float) -> None:
        """Keep track of how far one has come who is here [m], as `ahead` does."""
        self._project(x, y)

    def _project(self, x: float, y: float) -> tuple[float, float]:
        """Nearest place within reach of the last one: (way along the route, distance) [m]."""
        at, legs, nearest, found = self._at, self._legs, math.inf, (0.0, math.inf, 0.0)
        last_x, last_y = self._seen
        end = self._along + self._reach + BENT * math.hypot(x - last_x, y - last_y)
        for i in range(self._segment, len(legs)):
            begins = at[i]
            if begins > end:
                break
            ax, ay, dx, dy, square = legs[i]
            share = ((x - ax) * dx + (y - ay) * dy) / square if square else 0.0
            share = 0.0 if share < 0.0 else 1.0 if share > 1.0 else share
            if at[i + 1] > end:
                share = min(share, (end - begins) / (at[i + 1] - begins))
            away_x, away_y = ax + share * dx - x, ay + share * dy - y
            far = away_x * away_x + away_y * away_y
            if far < nearest:
                nearest, found = far, (begins + share * math.sqrt(square), away_x, away_y)
                self._segment = i
        self._seen, self._along = (x, y), found[0]
        return found[0], math.hypot(found[1], found[2])

    def point_at(self, along: float) -> tuple[float, float]:
        """The place a given way along the route [m]; beyond its end, the end."""
        i = min(bisect_right(self._at, along), len(self._at) - 1) - 1
        (ax, ay), (bx, by) = self._points[i], self._points[i + 1]
        length = self._at[i + 1] - self._at[i]
        share = min(max((along - self._at[i]) / length, 0.0), 1.0) if length else 1.0
        return ax + share * (bx - ax), ay + share * (by - ay)
