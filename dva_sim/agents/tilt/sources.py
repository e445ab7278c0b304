"""A phone that a person holds: tilted itself, or steered by stick, keys or gamepad on its screen.

Both pass through an app of the same profile. Only the newest source acts; the filter content of the
other one is discarded. Samples arrive all the time, but act only while no stick is held.
"""

from __future__ import annotations

import math
from typing import Final

from dva_sim.agents.tilt.accelerometer import Triple
from dva_sim.agents.tilt.app import TiltApp, TiltCommand
from dva_sim.agents.tilt.calibration import Reading
from dva_sim.agents.tilt.given import GivenTilt
from dva_sim.agents.tilt.measured import MeasuredTilt
from dva_sim.agents.tilt.profile import PhoneProfile

STICK_HOLDS: Final = 0.3  # design: time after stick input in which samples do not act [s]


class TiltSources:
    """Sources of commands for all input devices of a person.

    Args:
        profile: Settings of reading, filter, mapping and sending.
        reference: Reading of the phone's part in the neutral pose [m/s^2].
        period: Mean time between two samples of that part [s].
        given_hz: Sampling rate of a stick [Hz].

    Raises:
        ConfigError: the filter or the mapping cannot be had.
    """

    def __init__(
        self, profile: PhoneProfile, reference: Triple, period: float, given_hz: float
    ) -> None:
        self._measured = MeasuredTilt(profile, reference, period)
        self._given = GivenTilt(profile.model_copy(update={"sample_rate_hz": given_hz}))
        self._acting: TiltApp = self._measured
        self._given_at = -math.inf
        self.pick_up(0.0)

    def pick_up(self, now: float) -> None:
        """Begin a drive."""
        self._measured.pick_up(now)
        self._given.pick_up(now)

    def sample(self, at: float, acceleration: Triple) -> None:
        """Take a sample of the phone's part."""
        if self._acting is not self._measured and at - self._given_at > STICK_HOLDS:
            self._measured.pick_up(at)
            self._acting = self._measured
        self._measured.sample(at, acceleration)

    def ask(self, now: float, speed: float, turn_rate: float) -> None:
        """Take the position of a stick; see `GivenTilt`."""
        if self._acting is not self._given:
            self._given.pick_up(now)
            self._acting = self._given
        self._given_at = now
        self._given.ask(now, speed, turn_rate)

    def let_go(self) -> None:
        """Let go of the stick: the next sample acts, if one comes."""
        self._given_at = -math.inf

    def next_look(self, now: float, rate_hz: float) -> float:
        """Return the time of the next look [s]."""
        return self._acting.next_look(now, rate_hz)

    def look(self, now: float) -> TiltCommand | None:
        """Return a command, if one is to be sent now."""
        return self._acting.look(now)

    def reading(self, acceleration: Triple) -> Reading:
        """Return the calibrated reading of a sample, without limits: level, turn [deg/s]."""
        return self._measured.reading(acceleration)

    @property
    def waits(self) -> bool:
        """True if it sends from within the call that takes a sample; see `TiltApp`."""
        return self._acting.waits

    def hold(self) -> None:
        """Hold the samples while a request is open."""
        self._measured.hold()
        self._given.hold()

    def release(self, now: float) -> None:
        """Resume after the reply."""
        self._measured.release(now)
        self._given.release(now)

    @property
    def is_tilted(self) -> bool:
        """True if the phone itself is tilted."""
        return self._acting is self._measured

    @property
    def keeps_alive(self) -> bool:
        """True if the newest value is sent at every chance, changed or not."""
        return self._acting.keeps_alive

    @property
    def shown(self) -> Reading:
        """The command on the display: level, turn [deg/s]."""
        return self._acting.shown

    @property
    def samples(self) -> int:
        """Number of samples in the batches of this drive."""
        return self._acting.samples

    @property
    def values(self) -> int:
        """Number of batches."""
        return self._acting.values
