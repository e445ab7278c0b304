"""Lines of sight, which walls block."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

Point = tuple[float, float]

ON_LINE = 1e-6  # points this near the line of a wall are on neither side of it [m]


class Sight:
    """Lines of sight between walls.

    Args:
        walls: Segments x1, y1, x2, y2, shape `(n, 4)` [m].
    """

    def __init__(self, walls: NDArray[np.float64]) -> None:
        x1, y1, x2, y2 = walls.T
        lines = np.stack([y1 - y2, x2 - x1, x1 * y2 - x2 * y1], axis=1)
        lengths = np.hypot(x2 - x1, y2 - y1)[:, None]
        self._lines = np.divide(lines, lengths, out=np.zeros_like(lines), where=lengths > 0.0)
        self._ends = walls.reshape(-1, 2).T
        self._kept = lru_cache(maxsize=4096)(self._between)

    def between(self, a: Point, b: Point) -> bool:
        """Return True if no wall stands between two places [m]; repeated queries are cached.

        A wall blocks if its ends lie on both sides of the line a-b, and a and b on both sides of
        the wall. So it never blocks the sight of a point on its own line, as in an exit.
        """
        return self._kept(a, b)

    def _between(self, a: Point, b: Point) -> bool:
        ax, ay = a
        bx, by = b
        sides = self._lines @ np.array([[ax, bx], [ay, by], [1.0, 1.0]])
        across = np.array([ay - by, bx - ax]) @ self._ends + (ax * by - bx * ay)
        start, end = sides.T
        apart = (np.minimum(start, end) < -ON_LINE) & (np.maximum(start, end) > ON_LINE)
        blocked = apart & (across[::2] * across[1::2] < 0)
        return not blocked.any()

    def from_point(self, a: Point, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return True for each of many places `(..., 2)` [m] that can be seen from one."""
        flat = points.reshape(-1, 2)
        is_visible = np.ones(len(flat), bool)
        ends = self._ends.T.reshape(-1, 2, 2)
        for (px, py), (qx, qy) in ends.tolist():
            p = (px, py)
            q = (qx, qy)
            on_line = ON_LINE * math.hypot(qx - px, qy - py)
            side_a = _side(p, q, a)
            sides = _side(p, q, flat.T)
            across = (np.minimum(side_a, sides) < -on_line) & (np.maximum(side_a, sides) > on_line)
            ends_apart = _side(a, flat.T, p) * _side(a, flat.T, q) < 0
            is_visible &= ~(across & ends_apart)
        return is_visible.reshape(points.shape[:-1])


def _side(p: Any, q: Any, point: Any) -> Any:
    """Return on which side of the line p-q a point lies, by sign."""
    px, py = p
    qx, qy = q
    x, y = point
    return (qx - px) * (y - py) - (qy - py) * (x - px)
