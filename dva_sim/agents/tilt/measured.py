"""A real phone, whose measured samples arrive at irregular times."""

from __future__ import annotations

from typing import Final

from typing_extensions import override

from dva_sim.agents.tilt.accelerometer import Triple
from dva_sim.agents.tilt.app import TiltApp
from dva_sim.agents.tilt.calibration import Reading

SOONEST: Final = 0.005  # design: minimum interval of checks for a late batch [s]


class MeasuredTilt(TiltApp):
    """An app that is fed by `sample` alone.

    Samples have the same effect as in any phone. The difference is that a batch that should be
    complete may not be, as its last samples are still on their way.
    """

    @override
    def sample(self, at: float, acceleration: Triple) -> None:
        # Samples from before the drive do not count.
        if at >= self._sampled_at:
            self.followed(at)
            super().sample(at, acceleration)

    def reading(self, acceleration: Triple) -> Reading:
        """Return the calibrated reading of a sample, without limits: level, turn [deg/s]."""
        return self._app.reading(*acceleration)

    @override
    def next_look(self, now: float, rate_hz: float) -> float:
        # A late batch is checked for again after `SOONEST`, not at once.
        return max(super().next_look(now, rate_hz), now + SOONEST)
