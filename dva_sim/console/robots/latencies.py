"""Latencies of messages: the last, the median, the 95th percentile, and the largest."""

from __future__ import annotations

import math
from collections import deque

from dva_sim.console.wire.rows import LatencyFigures

KEPT_TIMES = 1000  # of the newest times


class Latencies:
    """Times of one kind [s]; only the newest are kept."""

    def __init__(self) -> None:
        self._times: deque[float] = deque(maxlen=KEPT_TIMES)
        self._count = 0

    def add(self, seconds: float) -> None:
        """Add another one."""
        self._times.append(seconds)
        self._count += 1

    def line(self) -> LatencyFigures | None:
        """Return the figures in milliseconds, of the newest `KEPT_TIMES`; None without any."""
        if not self._times:
            return None
        ordered = sorted(self._times)
        last = len(ordered) - 1
        median = 0.5 * (ordered[last // 2] + ordered[(last + 1) // 2])
        p95 = ordered[max(0, math.ceil(0.95 * len(ordered)) - 1)]
        return {
            "last_ms": _ms(self._times[-1]),
            "median_ms": _ms(median),
            "p95_ms": _ms(p95),
            "largest_ms": _ms(ordered[-1]),
            "count": self._count,
        }


def _ms(seconds: float) -> float:
    return round(1000 * seconds, 1)
