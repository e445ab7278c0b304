"""Times of a phone's samples by our clock: the phone's times, set by the earliest arrivals.

A phone tells its times by a clock of its own, which began some time and goes a little fast or slow.
Samples come late by the network, never early. So the offset between the clocks is at most what the
soonest sample shows, and that one holds. If the phone's clock is slow the true offset grows: ours
may grow after it, by `DRIFT` at most, which a burst of late samples cannot pull along.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

DRIFT: Final = 300e-6  # design: growth of the offset in a second; crystals keep within 100 ppm
RESTARTED: Final = 2.0  # design: times so far back are of another count, as after a reload [s]


class PhoneClock:
    """Converter of the times of one phone to our clock.

    Attributes:
        offset: Offset of our time against the phone's [s]; infinite before the first sample.
    """

    def __init__(self) -> None:
        self.offset = math.inf
        self._last_stamp = -math.inf
        self._came = -math.inf
        self._last = -math.inf

    def is_old(self, stamp: float) -> bool:
        """Return True if data for a time [s] is obsolete."""
        return self._last_stamp - RESTARTED < stamp <= self._last_stamp

    def times_of(self, stamps: Sequence[float], came: float) -> list[float]:
        """Return the capture times of samples by our clock [s]: not in the future, and in order.

        Args:
            stamps: Times by the phone, rising [s]; at least one.
            came: Common arrival time by our clock [s]; non-decreasing between calls.
        """
        if stamps[-1] <= self._last_stamp - RESTARTED:
            self.offset = math.inf
        grown = self.offset + DRIFT * (came - self._came)
        self.offset = min(came - stamps[-1], grown)
        self._last_stamp = stamps[-1]
        self._came = came
        return [self._set(one, came) for one in stamps]

    def _set(self, stamp: float, came: float) -> float:
        self._last = max(self._last, min(came, stamp + self.offset))
        return self._last
