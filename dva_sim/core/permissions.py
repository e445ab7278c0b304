"""Access rules: which device may request what, independent of the current holder."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

from dva_sim.core.registry import DRIVERS
from dva_sim.protocol.messages import Device

Level = Literal["teleoperation", "missions", "both", "sensors"]
LEVELS: tuple[Level, ...] = ("teleoperation", "missions", "both", "sensors")
_INCLUDES = {"both": {"teleoperation", "missions"}}


@dataclass(frozen=True, kw_only=True)
class AccessRule:
    """Permission of some devices to use some robots, for a time.

    Attributes:
        holders: Labels of the devices it is about; empty: all.
        robots: Labels of the robots it is about; empty: all.
        levels: Levels that they may request.
        sensors: Sensors that they may read; None: all.
        since: Start of the permission [s].
        until: End of the permission [s]; what is still held then is taken back.
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
        """Return True if the rule applies to these two now."""
        right = not self.holders or holder.label in self.holders
        return right and (not self.robots or robot.label in self.robots) and self._holds(now)

    def _holds(self, now: float) -> bool:
        return self.since <= now < self.until


@dataclass(frozen=True)
class Access:
    """Rules of access: what no rule allows is refused, and only `DRIVERS` drive.

    Attributes:
        rules: Rules; a request needs one that allows it.
    """

    rules: Sequence[AccessRule] = field(default_factory=lambda: (AccessRule(),))

    def allows(self, holder: Device, robot: Device, level: str, now: float) -> bool:
        """Return True if a device may have a level of permission on a robot."""
        if level != "sensors" and holder.device_type not in DRIVERS:
            return False
        levels = _INCLUDES.get(level, {level})
        rules = (r for r in self.rules if r.is_about(holder, robot, now))
        return any(levels <= r.includes for r in rules)

    def sensors(
        self, holder: Device, robot: Device, names: Sequence[str], now: float
    ) -> tuple[str, ...]:
        """Return those of the wanted sensors that a device may read."""
        rules = [r for r in self.rules if r.is_about(holder, robot, now)]
        return tuple(s for s in names if any(r.sensors is None or s in r.sensors for r in rules))

    def ends(self, holder: Device, robot: Device, level: str, now: float) -> float:
        """Return the time until which a device may have a level of permission on a robot [s]."""
        levels = _INCLUDES.get(level, {level})
        rules = (r for r in self.rules if r.is_about(holder, robot, now) and levels <= r.includes)
        return max((r.until for r in rules), default=now)

    def next_end(self, now: float) -> float:
        """Return when the next rule expires [s]."""
        return min((r.until for r in self.rules if r.until > now), default=math.inf)
