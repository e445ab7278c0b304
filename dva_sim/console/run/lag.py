"""Lag rule: robots are held while the machine cannot keep up. Pure, fed with measurements."""

from __future__ import annotations

LIMIT = 0.25  # behind real time; above, nobody drives by what is on the page [s]
RECOVERY_S = 1.0  # driving may begin again once the lag has been below the limit for this time [s]


class LagRule:
    """Decide whether a world is too far behind for anybody to drive in it.

    Attributes:
        held: True while driving is suspended.
        held_for: Time for which it has been suspended [s].
        newest: The lag that was measured last [s].
    """

    def __init__(self) -> None:
        self.held = False
        self.newest = 0.0
        self.held_for = 0.0
        self._bad_at = self._begun = float("-inf")

    def measured(self, now: float, lag: float) -> bool:
        """Take a measurement: True if robots have to stop now that went on until then.

        Args:
            now: Real time [s].
            lag: By how much events came too late [s].
        """
        self.newest = lag
        begins = lag > LIMIT and not self.held
        if begins:
            self.held = True
            self._begun = now
        if lag > LIMIT:
            self._bad_at = now
        elif now - self._bad_at >= RECOVERY_S:
            self.held = False
        self.held_for = now - self._begun if self.held else 0.0
        return begins
