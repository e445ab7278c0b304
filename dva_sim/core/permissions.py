"""Who may act on which robot: one holder at a time, each with a session as fencing token."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class Grant:
    """A permission that holds.

    Attributes:
        robot: Id of the robot.
        holder: Id of the device that may act.
        level: `teleoperation`, `missions` or `both`.
        session: Fencing token: a robot obeys only the highest it was told.
    """

    robot: str
    holder: str
    level: str
    session: int


@dataclass
class Permissions:
    """At most one grant per robot.

    Attributes:
        last_session: Newest session handed out; sessions only grow.
    """

    last_session: int = 1000
    grants: dict[str, Grant] = field(default_factory=dict)

    def request(self, robot: str, holder: str, level: str) -> Grant | None:
        """Grant a robot that is free, or already the holder's; None if another holds it."""
        held = self.grants.get(robot)
        if held is not None and held.holder != holder:
            return None
        if held is not None and held.level == level:
            return held
        self.last_session += 1
        grant = self.grants[robot] = Grant(robot, holder, level, self.last_session)
        return grant

    def release(self, holder: str, robot: str | None = None) -> None:
        """Take back what `holder` holds: of one robot, or of all."""
        for name, grant in list(self.grants.items()):
            if grant.holder == holder and robot in (None, name):
                del self.grants[name]
