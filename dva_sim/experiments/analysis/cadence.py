"""Theory of lock-step messaging: its command rate, and the delay from which it binds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from dva_sim.agents.robot.command_queue import mean_of
from dva_sim.experiments.study.parts import Level
from dva_sim.kernel.errors import ConfigError
from dva_sim.simulation.scenario import build, phone_profile


@dataclass(frozen=True)
class Cadence:
    """Send period of the phone, and the time a robot needs per command.

    Attributes:
        period_s: Wanted time between two commands; the shortest, where it is not constant.
        processing_s: Time a robot needs for one command, on average.
    """

    period_s: float
    processing_s: float

    @property
    def boundary_s(self) -> float:
        """One-way delay at which round trip and processing fill the wanted period.

        Beyond it a request waits for the reply to the one before: 2 d + P = T.
        """
        return (self.period_s - self.processing_s) / 2

    def lock_step_rate(self, delay_s: float) -> float:
        """Commands per second that request/reply can apply at a one-way delay [Hz]."""
        return 1.0 / max(self.period_s, 2 * delay_s + self.processing_s)


def cadence(scenario: Mapping[str, Any], changes: Mapping[str, Level]) -> Cadence | None:
    """The cadence of a scenario under some levels; None where its profile is not to be had.

    A phone that looks only when its batch is full or its time is up wants no more than that.
    """
    try:
        resolved = build(scenario, changes)
        phone = phone_profile(resolved)
    except ConfigError:
        return None
    period = 1.0 / resolved.command.rate_hz
    if phone.send == "on_change":
        period = min(phone.max_delay_s, 20 / phone.sample_rate_hz)
    return Cadence(period, mean_of(resolved.robot.processing_s or 0.0))
