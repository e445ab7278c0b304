"""Who may act on which robot, and who may ask for it.

There is one holder at a time, whose session is a fencing token (`Permissions`); the rules of
access say what a device may ask for, whoever holds what at the moment (`Access`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import KW_ONLY, dataclass, field
from typing import Literal, TypeVar

from dva_sim.core.registry import OPERATOR
from dva_sim.protocol.messages import Device

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
        address: Where the holder is found.
    """

    robot: str
    holder: str
    level: str
    session: int
    _: KW_ONLY
    sensors: tuple[str, ...] = ()
    address: str | None = None


@dataclass
class Permissions:
    """At most one grant to drive each robot, and any number to read its sensors.

    Attributes:
        draw: Gives `LOW_BITS` random bits.
        count: Sessions handed out so far, from any start that is higher than in an earlier
            life of the DVA: it makes sessions grow.
        changes: How often a grant was made, or ended.
        own: Id of the DVA, which may hold robots itself: its grants yield to all others.
    """

    draw: Callable[[], int]
    count: int = 1000
    grants: dict[str, Grant] = field(default_factory=dict)
    observers: dict[tuple[str, str], Grant] = field(default_factory=dict)
    changes: int = 0
    own: str = ""

    def request(
        self,
        robot: str,
        holder: str,
        level: str,
        sensors: tuple[str, ...] = (),
        address: str | None = None,
    ) -> tuple[Grant | None, bool]:
        """Grant a robot that is free, or already the holder's.

        Returns:
            The grant, or None if another holds the robot; and whether the robot has to be told:
            of what it knows already, asked for once more, it has not.
        """
        only_sensors = level == "sensors"
        held = self.observers.get((robot, holder)) if only_sensors else self.grants.get(robot)
        if held is not None and held.holder not in (holder, self.own):
            return None, False
        if only_sensors and held is None and len(self.observers) >= MOST_OBSERVERS:
            return None, False
        asked = holder, level, sensors
        same = held is not None and (held.holder, held.level, held.sensors) == asked
        session = held.session if held is not None and same else self._new_session(only_sensors)
        grant = Grant(robot, holder, level, session, sensors=sensors, address=address)
        self.changes += grant != held
        if only_sensors:
            self.observers[robot, holder] = grant
        else:
            self.grants[robot] = grant
        return grant, grant != held

    def _new_session(self, only_sensors: bool) -> int:
        """Only the right to drive is fenced by the height of its session."""
        self.count += not only_sensors
        return self.count << LOW_BITS | self.draw()

    def all(self) -> list[Grant]:
        """Every grant that holds."""
        return [*self.grants.values(), *self.observers.values()]

    def restore(self, grant: Grant) -> None:
        """A grant of an earlier life of the DVA holds on."""
        self.changes += 1
        if grant.level == "sensors":
            self.observers[grant.robot, grant.holder] = grant
        else:
            self.grants[grant.robot] = grant

    def end(self, session: int) -> None:
        """A single grant is over, or never began."""
        self.changes += 1
        _drop_session(self.grants, session)
        _drop_session(self.observers, session)

    def release(self, holder: str, robot: str | None = None) -> list[Grant]:
        """Take back the right to drive from `holder`: of one robot, or of all; what that was."""
        return self._counted(_take(self.grants, holder, robot))

    def forget(self, holder: str, robot: str | None = None) -> list[Grant]:
        """The same for the right to read sensors."""
        return self._counted(_take(self.observers, holder, robot))

    def _counted(self, taken: list[Grant]) -> list[Grant]:
        self.changes += len(taken)
        return taken


def _take(grants: dict[K, Grant], holder: str, robot: str | None) -> list[Grant]:
    """Take the grants of a holder out of a dictionary."""
    taken = {key: g for key, g in grants.items() if g.holder == holder and robot in (None, g.robot)}
    for key in taken:
        del grants[key]
    return list(taken.values())


def _drop_session(grants: dict[K, Grant], session: int) -> None:
    for key in [key for key, grant in grants.items() if grant.session == session]:
        del grants[key]


Level = Literal["teleoperation", "missions", "both", "sensors"]
LEVELS: tuple[Level, ...] = ("teleoperation", "missions", "both", "sensors")
_INCLUDES = {"both": {"teleoperation", "missions"}}


@dataclass(frozen=True, kw_only=True)
class AccessRule:
    """What some devices may do with some robots, for a time.

    Attributes:
        holders: Labels of the devices it is about; empty: all.
        robots: Labels of the robots it is about; empty: all.
        levels: What they may ask for.
        sensors: Which sensors they may read; None: all.
        since: From when on [s].
        until: Up to when [s]; what is still held then is taken back.
    """

    holders: frozenset[str] = frozenset()
    robots: frozenset[str] = frozenset()
    levels: frozenset[str] = frozenset(LEVELS)
    sensors: frozenset[str] | None = None
    since: float = 0.0
    until: float = math.inf

    @property
    def includes(self) -> frozenset[str]:
        """The levels, where `both` stands for the two that it is made of."""
        return self.levels.union(*(_INCLUDES.get(level, ()) for level in self.levels))

    def is_about(self, holder: Device, robot: Device, now: float) -> bool:
        """Whether it says something about these two now."""
        right = not self.holders or holder.label in self.holders
        return right and (not self.robots or robot.label in self.robots) and self._holds(now)

    def _holds(self, now: float) -> bool:
        return self.since <= now < self.until


@dataclass(frozen=True)
class Access:
    """The rules: what no rule allows is refused. Only operators drive, whatever they say.

    Attributes:
        rules: Any one that allows something suffices.
    """

    rules: Sequence[AccessRule] = field(default_factory=lambda: (AccessRule(),))

    def allows(self, holder: Device, robot: Device, level: str, now: float) -> bool:
        """Whether a device may have a level of permission on a robot."""
        if level != "sensors" and holder.device_type != OPERATOR:
            return False
        wanted = _INCLUDES.get(level, {level})
        rules = (r for r in self.rules if r.is_about(holder, robot, now))
        return any(wanted <= r.includes for r in rules)

    def sensors(
        self, holder: Device, robot: Device, wanted: Sequence[str], now: float
    ) -> tuple[str, ...]:
        """Those of the wanted sensors that a device may read."""
        rules = [r for r in self.rules if r.is_about(holder, robot, now)]
        return tuple(s for s in wanted if any(r.sensors is None or s in r.sensors for r in rules))

    def next_end(self, now: float) -> float:
        """When the next rule ceases to hold [s]."""
        return min((r.until for r in self.rules if r.until > now), default=math.inf)
