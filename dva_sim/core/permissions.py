"""Who may act on which robot: one holder at a time, each with a session as fencing token."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeVar

K = TypeVar("K")

MOST_OBSERVERS = 10_000
LOW_BITS = 32  # of a session: nobody can guess them; the bits above only grow


@dataclass(frozen=True, slots=True)
class Grant:
    """A permission that holds.

    Attributes:
        robot: Id of the robot.
        holder: Id of the device that may act.
        level: `teleoperation`, `missions`, `both` or `sensors`.
        session: Fencing token: a robot obeys only the highest it was told.
        sensors: Sensors that the holder may subscribe to.
    """

    robot: str
    holder: str
    level: str
    session: int
    sensors: tuple[str, ...] = ()


@dataclass
class Permissions:
    """At most one grant to drive each robot, and any number to read its sensors.

    Attributes:
        draw: Gives `LOW_BITS` random bits.
        count: Sessions handed out so far, from any start that is higher than in an earlier
            life of the DVA: it makes sessions grow.
    """

    draw: Callable[[], int]
    count: int = 1000
    grants: dict[str, Grant] = field(default_factory=dict)
    observers: dict[tuple[str, str], Grant] = field(default_factory=dict)

    def request(
        self, robot: str, holder: str, level: str, sensors: tuple[str, ...] = ()
    ) -> Grant | None:
        """Grant a robot that is free, or already the holder's; None if another holds it."""
        if level == "sensors":
            return self._observe(robot, holder, sensors)
        held = self.grants.get(robot)
        if held is not None and held.holder != holder:
            return None
        if held is not None and (held.level, held.sensors) == (level, sensors):
            return held
        grant = Grant(robot, holder, level, self._new_session(), sensors)
        self.grants[robot] = grant
        return grant

    def _observe(self, robot: str, holder: str, sensors: tuple[str, ...]) -> Grant | None:
        held = self.observers.get((robot, holder))
        if held is not None and held.sensors == sensors:
            return held
        if held is None and len(self.observers) >= MOST_OBSERVERS:
            return None
        grant = Grant(robot, holder, "sensors", self._new_session(), sensors)
        self.observers[robot, holder] = grant
        return grant

    def _new_session(self) -> int:
        self.count += 1
        return self.count << LOW_BITS | self.draw()

    def release(self, holder: str, robot: str | None = None) -> list[Grant]:
        """Take back the right to drive from `holder`: of one robot, or of all; what that was."""
        return _take(self.grants, holder, robot)

    def forget(self, holder: str, robot: str | None = None) -> list[Grant]:
        """The same for the right to read sensors."""
        return _take(self.observers, holder, robot)


def _take(grants: dict[K, Grant], holder: str, robot: str | None) -> list[Grant]:
    """Take the grants of a holder out of a dictionary."""
    taken = {key: g for key, g in grants.items() if g.holder == holder and robot in (None, g.robot)}
    for key in taken:
        del grants[key]
    return list(taken.values())
