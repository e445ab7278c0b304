"""What can be seen from where: walls hide what is behind them."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

Point = tuple[float, float]


class Sight:
    """Lines of sight between walls.

    Args:
        walls: Segments x1, y1, x2, y2, shape `(n, 4)` [m].
    """

    def __init__(self, walls: NDArray[np.float64]) -> None:
        x1, y1, x2, y2 = walls.T
        self._lines = np.stack([y1 - y2, x2 - x1, x1 * y2 - x2 * y1], axis=1)
        self._ends = walls.reshape(-1, 2).T
        self._kept = lru_cache(maxsize=4096)(self._between)

    def between(self, a: Point, b: Point) -> bool:
        """Whether no wall stands between two places [m]; who stands still asks the same again.

        A wall blocks when its ends lie on both sides of the line a-b and a and b on both
        sides of the wall.
        """
        return self._kept(a, b)

    def _between(self, a: Point, b: Point) -> bool:
        (ax, ay), (bx, by) = a, b
        sides = self._lines @ np.array([[ax, bx], [ay, by], [1.0, 1.0]])
        across = np.array([ay - by, bx - ax]) @ self._ends + (ax * by - bx * ay)
        blocked = (sides[:, 0] * sides[:, 1] < 0) & (across[::2] * across[1::2] < 0)
        return not blocked.any()

    def from_point(self, a: Point, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Whether each of many places `(..., 2)` [m] can be seen from one."""
        flat = points.reshape(-1, 2)
        seen = np.ones(len(flat), bool)
        ends = self._ends.T.reshape(-1, 2, 2)
        for (px, py), (qx, qy) in ends.tolist():
            side_a, (x, y) = _side(px, py, qx, qy, *a), flat.T
            across = side_a * _side(px, py, qx, qy, x, y) < 0
            ends_apart = _side(*a, x, y, px, py) * _side(*a, x, y, qx, qy) < 0
            seen &= ~(across & ends_apart)
        return seen.reshape(points.shape[:-1])


def _side(px: Any, py: Any, qx: Any, qy: Any, x: Any, y: Any) -> Any:
    """On which side of the line p-q a point lies, by sign."""
    return (qx - px) * (y - py) - (qy - py) * (x - px)
