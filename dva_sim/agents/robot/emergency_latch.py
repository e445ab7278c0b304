"""Latch of a robot: after an emergency it takes no orders until it is released.

Without keys anybody can claim to be the DVA. A release is therefore read only from the DVA's answer
to the robot's own request, and it counts only for the newest emergency that the request named.
Pure.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from dva_sim.protocol import messages as m

PERSON: Final = "person"
DRIVE: Final = "drive"
MAX_STOP_S = 1e6  # longest stop that a message can state [s]


@dataclass
class EmergencyLatch:
    """Emergency that holds a robot, and how it ends.

    It outlives restarts of the robot's program and of the DVA.

    Attributes:
        rule: `person` or `drive`, where the configuration decides; None: as the DVA says.
        holds: True from an emergency on until it is released.
        stopped_by: Id of the device that sent the first emergency; None: its own button.
        since: Time of the first emergency [s].
        tick: The robot's own clock at the newest emergency [ms].
        released: Person who released it last.
        released_by: Rule of this emergency, once the DVA has stated it.
    """

    rule: m.ReleasedBy | None = None
    holds: bool = False
    stopped_by: str | None = None
    since: float = 0.0
    tick: int = 0
    released: m.ByWhom | None = None
    released_by: m.ReleasedBy | None = None

    def close(self, stopped_by: str | None, now: float, tick: int) -> None:
        """Hold the robot; a further emergency needs a further release."""
        if not self.holds:
            self.stopped_by = stopped_by
            self.since = now
            self.released = None
            self.released_by = self.rule
        self.holds = True
        self.tick = tick

    def release(self, released: m.ByWhom | None) -> None:
        """Release the robot, so that it takes orders again."""
        self.holds = False
        self.released = released

    def take_answer(self, answer: m.EmergencyRelease) -> None:
        """Apply the DVA's answer; once a person has to release it, nothing less does."""
        if not self.holds or answer.tick != self.tick:
            return
        if answer.released is not None:
            self.release(answer.released)
        elif self.rule is None and (answer.released_by == PERSON or self.released_by is None):
            self.released_by = PERSON if answer.released_by == PERSON else DRIVE

    def take_refusal(self) -> None:
        """Note that the DVA knows no releases, as before version 1.7 of the protocol."""
        if self.holds and self.released_by is None:
            self.released_by = DRIVE

    def starts(self) -> bool:
        """Return True if a new start by the robot's holder is allowed, which releases it."""
        return not self.holds or self.released_by == DRIVE

    @property
    def refusal(self) -> str:
        """Reason for which orders are refused."""
        if self.released_by == DRIVE:
            return "stopped by an emergency: its driver has to start it again"
        return "stopped by an emergency: a person has to release it"

    def message(self, now: float) -> m.RobotEmergency:
        """Return the emergency as the robot publishes it and sends it to the DVA."""
        stopped_for = min(max(0.0, now - self.since), MAX_STOP_S)
        return m.RobotEmergency(self.stopped_by, stopped_for, self.tick, self.released)
