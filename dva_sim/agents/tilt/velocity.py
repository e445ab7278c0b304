"""Velocities from a program instead of tilt, sent unchanged as they arrive."""

from __future__ import annotations

from typing_extensions import override

from dva_sim.agents.tilt.app import TiltCommand
from dva_sim.agents.tilt.given import GivenTilt


class GivenVelocity(GivenTilt):
    """An app that sends each speed and turn rate once, without filter, mapping or steps."""

    @override
    def pick_up(self, now: float) -> None:
        super().pick_up(now)
        self._velocity: tuple[float, float] | None = None
        self._given_at = now
        self.keeps_alive = self.waits = False

    @override
    def ask(self, now: float, speed: float, turn_rate: float) -> None:
        self._velocity = (speed, turn_rate)
        self._given_at = now

    @override
    def look(self, now: float) -> TiltCommand | None:
        velocity = self._velocity
        self._velocity = None
        if velocity is None:
            return None
        self.samples += 1
        self.values += 1
        return TiltCommand(*velocity, sample_age=now - self._given_at, captured=self._given_at)

    @override
    def next_look(self, now: float, rate_hz: float) -> float:
        return now + 1.0 / rate_hz
