"""Lag rule: robots are held while the machine cannot keep up. Pure, fed with measurements."""

from __future__ import annotations

LIMIT = 0.25  # behind real time; above, nobody drives by what is on the page [s]
GOOD_FOR = 1.0  # below the limit for so long, driving may begin again [s]


class LagRule:
    """Decide whether a world is too far behind for anybody to drive in it.

    Attributes:
        held: True while driving is suspended.
        newest: The lag that was measured last [s].
    """

    def __init__(self) -> None:
        self.held = False
        self.newest = 0.0
        self._bad_at = float("-inf")

    def measured(self, now: float, lag: float) -> bool:
        """Take a measurement: True if robots have to stop now that went on until then.

        Args:
            now: Real time [s].
            lag: By how much events came too late [s].
        """
        self.newest = lag
        if lag > LIMIT:
            begins = not self.held
            self.held = True
            self._bad_at = now
            return begins
        if self.held and now - self._bad_at >= GOOD_FOR:
            self.held = False
        return False
