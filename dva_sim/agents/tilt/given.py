"""A phone that is tilted exactly as commanded, by a person with keys, pointer or gamepad.

Hand lag and sensor noise are not simulated, as the person has a real hand. The app is the same, so
that input passes the same filter, mapping and sending rule as a tilt.
"""

from __future__ import annotations

import math

from typing_extensions import override

from dva_sim.agents.tilt.accelerometer import GRAVITY, Triple
from dva_sim.agents.tilt.app import TIE, TiltApp, TiltCommand, calibrated
from dva_sim.agents.tilt.calibration import SPEED_PER_LEVEL
from dva_sim.agents.tilt.mappings import limited
from dva_sim.agents.tilt.profile import PhoneProfile

MIN_WITHIN = 0.1  # design: a gap on the display is closed no sooner than in this time [s]


class GivenTilt(TiltApp):
    """A phone without a simulated hand.

    Samples are made on request, for all the time since the last one, at the profile's rate.

    Args:
        profile: Phone and app.

    Raises:
        ConfigError: the filter or the mapping cannot be had.
    """

    def __init__(self, profile: PhoneProfile) -> None:
        super().__init__(profile, profile.reference_mps2, 1.0 / profile.sample_rate_hz)
        self._pose = calibrated(profile, profile.reference_mps2).pose
        self.pick_up(0.0)

    @override
    def pick_up(self, now: float) -> None:
        # It is asked to stand.
        super().pick_up(now)
        self._wanted = 0.0, 0.0
        self._tilt = self._tilted()

    def ask(self, now: float, speed: float, turn_rate: float) -> None:
        """Set the command from `now` on: speed [m/s], turn rate [rad/s]."""
        self._advance(now)
        self.followed(now)
        self._wanted = limited(speed / SPEED_PER_LEVEL, math.degrees(turn_rate))
        self._tilt = self._tilted()

    @override
    def look(self, now: float) -> TiltCommand | None:
        # An ideal phone sends the desired command.
        if self._ideal:
            self.shown = self._wanted
            self._stems_from = now
            self._captured = self._trail.asked
        return super().look(now)

    @override
    def _advance(self, now: float) -> None:
        while not self._ideal and (at := self._next_sample) <= now + TIE:
            if self._watches:
                self._tilt = self._tilted()
            self.sample(at, self._tilt)
        self.take_values(now)

    def _tilted(self) -> Triple:
        """Return a perfect sensor's reading of the commanded tilt [m/s^2]."""
        within = max(MIN_WITHIN, self._period)
        pitch, roll = self._pose(*self._mapping.tilt_for(self._wanted, self.shown, within))
        flat = GRAVITY * math.cos(pitch)
        return GRAVITY * math.sin(pitch), flat * math.sin(roll), flat * math.cos(roll)
