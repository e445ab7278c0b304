"""Robots held by an emergency, by their own reports, and the persons who released them.

A robot obeys its own latch. This table tells the DVA which robots it cannot send, and stops a robot
again if its new program has lost the latch.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

from dva_sim.core.events import Choice
from dva_sim.protocol import messages as m

# Stopped robots report that every second; without a report the stop is over after this time [s].
UNCONFIRMED_AFTER = 30.0


@dataclass(frozen=True, slots=True)
class RobotStop:
    """Emergency of one robot.

    Attributes:
        stopped_by: Id of the device that sent it; None: the robot's own button.
        tick: The robot's own clock at the newest emergency [ms].
        heard: Time at which the robot last said so [s].
        since: Time at which it was stopped [s].
        released: Person who has released it.
    """

    stopped_by: str | None
    tick: int
    heard: float
    since: float
    released: Choice | None = None

    def message(self, now: float) -> m.RobotEmergency:
        """Return the emergency as the robot reports it."""
        return m.RobotEmergency(self.stopped_by, max(0.0, now - self.since), self.tick)


@dataclass
class Emergencies:
    """Emergencies by robot.

    Attributes:
        changes: Number of emergencies that began, were released or forgotten.
    """

    changes: int = 0
    _stops: dict[str, RobotStop] = field(default_factory=dict)

    def holds(self, robot: str) -> bool:
        """Return True if a robot is stopped, and nobody has released it."""
        stop = self._stops.get(robot)
        return stop is not None and stop.released is None

    def stopped(self) -> dict[str, RobotStop]:
        """Return the robots that nobody has released."""
        return {robot: stop for robot, stop in self._stops.items() if stop.released is None}

    def hear(self, robot: str, emergency: m.RobotEmergency, now: float) -> RobotStop:
        """Note a robot's report of its emergency; a newer emergency ends an earlier release."""
        stop = self._stops.get(robot)
        # The robot's tick tells emergencies apart: an old release must not free a new stop.
        if stop is not None and stop.tick == emergency.tick:
            stop = replace(stop, heard=now)
        else:
            since = now - emergency.stopped_for
            stop = RobotStop(emergency.stopped_by, emergency.tick, heard=now, since=since)
            self.changes += 1
        self._stops[robot] = stop
        return stop

    def restore(self, robot: str, stop: RobotStop) -> None:
        """Take over an emergency of an earlier life of the DVA."""
        self._stops[robot] = stop

    def release(self, robot: str, choice: Choice) -> None:
        """Note that a person has released a robot, which asks for its release itself."""
        self._stops[robot] = replace(self._stops[robot], released=choice)
        self.changes += 1

    def who_released(self, robot: str) -> Choice | None:
        """Return the release of a robot's newest emergency."""
        stop = self._stops.get(robot)
        return stop.released if stop is not None else None

    def forget(self, robot: str) -> None:
        """Forget a robot that is registered no longer."""
        self.changes += self._stops.pop(robot, None) is not None

    def lapse(self, now: float, last_heard: Callable[[str], float]) -> None:
        """Forget emergencies of robots that are heard and no longer say that they are stopped."""
        for robot, stop in self.stopped().items():
            if now - stop.heard > UNCONFIRMED_AFTER and last_heard(robot) > stop.heard:
                self.forget(robot)
