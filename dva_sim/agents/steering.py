"""Geometry of following a route: where am I on it, and which way is ahead.

References:
    R. C. Coulter: Implementation of the pure pursuit path tracking algorithm.
    CMU-RI-TR-92-01, 1992.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


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


class Route:
    """A polyline to follow, and how far along it one has come.

    Args:
        points: Corners, shape `(n, 2)` [m], n >= 2.
    """

    def __init__(self, points: NDArray[np.float64]) -> None:
        self._points = [(float(x), float(y)) for x, y in points]
        steps = np.hypot(*np.diff(points, axis=0).T)
        self._at: list[float] = [0.0, *np.cumsum(steps).tolist()]
        self._segment = 0
        self.points = points

    @property
    def length(self) -> float:
        """Whole way [m]."""
        return self._at[-1]

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

    def _project(self, x: float, y: float) -> tuple[float, float]:
        """Nearest place on the next three segments: (way along the route, distance) [m]."""
        best = (math.inf, 0.0, self._segment)
        for i in range(self._segment, min(self._segment + 3, len(self._points) - 1)):
            (ax, ay), (bx, by) = self._points[i], self._points[i + 1]
            ux, uy = bx - ax, by - ay
            square = ux * ux + uy * uy
            share = ((x - ax) * ux + (y - ay) * uy) / square if square else 0.0
            share = min(max(share, 0.0), 1.0)
            distance = math.hypot(ax + share * ux - x, ay + share * uy - y)
            if distance < best[0]:
                best = distance, self._at[i] + share * math.sqrt(square), i
        self._segment = best[2]
        return best[1], best[0]

    def point_at(self, along: float) -> tuple[float, float]:
        """The place a given way along the route [m]; beyond its end, the end."""
        i = min(bisect_right(self._at, along), len(self._at) - 1) - 1
        (ax, ay), (bx, by) = self._points[i], self._points[i + 1]
        length = self._at[i + 1] - self._at[i]
        share = min(max((along - self._at[i]) / length, 0.0), 1.0) if length else 1.0
        return ax + share * (bx - ax), ay + share * (by - ay)
