"""Sessions of the DVA: who holds which robot, and which devices must be told when that ends.

There is one holder at a time, whose session is a fencing token (`Permissions`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import KW_ONLY, dataclass, field, replace
from typing import TypeVar

from dva_sim.protocol import messages as m
from dva_sim.protocol.exchange import LOW_BITS, is_absurd


@dataclass(frozen=True, slots=True)
class Send:
    """A message that the DVA wants delivered: to whom, what, and in which session."""

    to: str
    body: m.Body
    session: int = 0


@dataclass(frozen=True, slots=True)
class DvaAnswer:
    """Answer to a request, and what else to send because of it.

    Attributes:
        code: `messages.OK`, or why nothing was done.
        text: Reason for people; may be empty.
        content: Requested content.
        sends: Messages to other devices.
    """

    code: int = m.OK
    text: str = ""
    content: m.Content | None = None
    sends: Sequence[Send] = ()


MAX_UNACKNOWLEDGED = 1000  # maximum notices that robots have not acknowledged


@dataclass
class Sessions:
    """Permissions, and notices of their end.

    Attributes:
        unacknowledged: Notices that a robot has not acknowledged, by session. Until then it may
            obey the wrong device.
        changes: Number of changes of `unacknowledged`.
        reserved: Robots that are being handed over: held, as far as others are concerned.
    """

    permissions: Permissions
    unacknowledged: dict[int, Send] = field(default_factory=dict)
    changes: int = 0
    reserved: set[str] = field(default_factory=set)
    _over: list[Send] = field(default_factory=list)
    _unheard: dict[int, Send] = field(default_factory=dict)

    def grant(
        self, robot: m.Device, holder: m.Device, wish: m.PermissionRequest
    ) -> tuple[m.Permission, list[Send]] | None:
        """Grant a robot; return the permission, and any message to the robot.

        None if another device holds it.
        """
        grant, is_news = self.permissions.request(
            robot.id_tag, holder.id_tag, wish.level, wish.sensors, holder.address
        )
        if grant is None:
            return None
        level = grant.level
        session = grant.session
        sensors = grant.sensors
        notice = m.PermissionGrant(holder.id_tag, level, session, holder.address, sensors)
        content = m.Permission(robot.id_tag, level, session, robot.address, sensors)
        return content, [Send(robot.id_tag, notice, session)] if is_news else []

    def hold(self, robot: str) -> tuple[int, Send | None]:
        """Take a robot for the DVA; return the session, and any message to the robot."""
        dva = self.permissions.own
        grant, is_news = self.permissions.request(robot, dva, "missions")
        assert grant is not None
        notice = Send(robot, m.PermissionGrant(dva, grant.level, grant.session), grant.session)
        return grant.session, notice if is_news else None

    def is_held(self, robot: str) -> bool:
        """Return True if a robot is held by somebody other than the DVA."""
        grant = self.permissions.grants.get(robot)
        has_driver = grant is not None and grant.holder != self.permissions.own
        return has_driver or robot in self.reserved

    def held(self, robot: str, holder: str | None, to_read: bool) -> Grant | None:
        """Return the permission of a device, or that of the current holder, if there is one.

        Args:
            robot: Id of the robot.
            holder: Id of the device; None: the holder.
            to_read: True if a permission to read sensors is sufficient.
        """
        permissions = self.permissions
        reads = permissions.observers.get((robot, holder or "")) if to_read else None
        drives = permissions.grants.get(robot)
        return reads or (drives if drives is not None and holder in (None, drives.holder) else None)

    def observe(self, robot: str, sensors: tuple[str, ...]) -> Send:
        """Let the DVA itself read sensors of a robot; return the message to the robot."""
        dva = self.permissions.own
        grant, _ = self.permissions.request(robot, dva, "sensors", sensors)
        assert grant is not None
        notice = m.PermissionGrant(dva, grant.level, grant.session, None, sensors)
        return Send(robot, notice, grant.session)

    def observes(self, robot: str) -> int:
        """Return the session in which the DVA reads sensors of a robot; 0: it does not."""
        grant = self.permissions.observers.get((robot, self.permissions.own))
        return grant.session if grant is not None else 0

    def has_unacknowledged(self, robot: str) -> bool:
        """Return True if a robot has not confirmed the end of a session yet."""
        return any(send.to == robot for send in self.unacknowledged.values())

    def give_back(self, body: m.PermissionRevocation) -> bool:
        """End a session that its holder needs no longer; return False if there is none."""
        both = (
            self.permissions.grants.get(body.device),
            self.permissions.observers.get((body.device, body.holder)),
        )
        mine = {g.session for g in both if g is not None and g.holder == body.holder}
        if body.session not in mine:
            return False
        self.permissions.end(body.session)
        self.tell_robot(body)
        return True

    def take_back(self, holder: str, robot: str) -> None:
        """End a device's right to drive a robot; the device itself need not be told."""
        for grant in self.permissions.release(holder, robot):
            self._tell(grant, holder_too=False)

    def take_back_all(self, holder: str) -> None:
        """End all rights of a device, and tell it."""
        for grant in (*self.permissions.release(holder), *self.permissions.forget(holder)):
            self._tell(grant, holder_too=True)

    def take_back_everything(self) -> None:
        """End all rights of everybody."""
        for holder in dict.fromkeys(grant.holder for grant in self.permissions.all()):
            self.take_back_all(holder)

    def revoke(self, grant: Grant) -> None:
        """End one permission while it is in use; its holder and the robot hear of it."""
        self.permissions.end(grant.session)
        self._tell(grant, holder_too=True)

    def undelivered(self, send: Send) -> None:
        """Note that a robot did not take a grant, or did not hear that one is over."""
        body = send.body
        if isinstance(body, m.PermissionGrant):
            self.permissions.end(body.session)
            self._tell(Grant(send.to, body.holder, body.level, body.session), holder_too=True)
        elif isinstance(body, m.PermissionRevocation) and send.to == body.device:
            self._unheard[body.session] = send

    def above(self, send: Send, floor: int) -> Send | None:
        """Return a session above the highest that a robot knows, which refused a grant.

        Its holder hears that the first is over, and asks for the new one. None: that grant holds
        no longer, or no session can be so high; then it is as if it had not arrived.
        """
        body = send.body
        permissions = self.permissions
        grant = permissions.grants.get(send.to)
        if not isinstance(body, m.PermissionGrant) or grant is None:
            return None
        if grant.session != body.session or is_absurd(floor, permissions.count << LOW_BITS):
            return None
        permissions.count = max(permissions.count, floor >> LOW_BITS)
        grant = permissions.renew(grant)
        over = m.PermissionRevocation(send.to, grant.holder, send.session)
        if grant.holder != permissions.own:
            self._over.append(Send(grant.holder, over))
        again = m.PermissionGrant(
            grant.holder, grant.level, grant.session, grant.address, grant.sensors
        )
        return Send(send.to, again, grant.session)

    def heard(self, send: Send) -> None:
        """Note that a robot knows that a session is over."""
        body = send.body
        if isinstance(body, m.PermissionRevocation) and send.to == body.device:
            self.changes += self.unacknowledged.pop(body.session, None) is not None

    def remind(self, is_there: Callable[[str], bool]) -> None:
        """Repeat the notices that robots have missed, once those robots are heard again."""
        self._unheard = {s: send for s, send in self._unheard.items() if s in self.unacknowledged}
        heard = [s for s, send in self._unheard.items() if is_there(send.to)]
        self._over += [self._unheard.pop(session) for session in heard]

    def with_something_open(self) -> set[str]:
        """Return robots that somebody holds, or that must still hear that a session is over."""
        robots = {g.robot for g in self.permissions.all() if g.holder != self.permissions.own}
        return robots.union(send.to for send in self.unacknowledged.values())

    def forget(self, robot: str) -> None:
        """End all sessions of a robot; tell its holders, and the robot if it comes back."""
        for grant in [g for g in self.permissions.all() if g.robot == robot]:
            self.revoke(grant)

    def tell_robot(self, body: m.PermissionRevocation) -> None:
        """Notify a robot that a session is over, and retry until it acknowledges."""
        self.changes += 1
        self.unacknowledged[body.session] = Send(body.device, body)
        self._over.append(self.unacknowledged[body.session])
        if len(self.unacknowledged) > MAX_UNACKNOWLEDGED:
            # The oldest goes: its robot is the least likely to be heard again.
            del self.unacknowledged[next(iter(self.unacknowledged))]

    def to_tell(self) -> list[Send]:
        """Return the ends of sessions to send now; each is returned once."""
        over = self._over
        self._over = []
        return over

    def _tell(self, grant: Grant, holder_too: bool) -> None:
        body = m.PermissionRevocation(grant.robot, grant.holder, grant.session)
        self.tell_robot(body)
        if holder_too and grant.holder != self.permissions.own:
            self._over.append(Send(grant.holder, body))


K = TypeVar("K")

MAX_OBSERVERS = 10_000


@dataclass(frozen=True, slots=True)
class Grant:
    """A permission that holds.

    Attributes:
        robot: Id of the robot.
        holder: Id of the device that may act.
        level: `teleoperation`, `missions`, `both` or `sensors`.
        session: Fencing token: a robot obeys only the highest it has received.
        sensors: Sensors that the holder may subscribe to.
        address: Address of the holder.
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
        draw: Function that returns `LOW_BITS` random bits.
        count: Sessions handed out so far, from any start that is higher than in an earlier
            life of the DVA: it makes sessions grow.
        changes: Number of grants made or ended.
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
            The grant, or None if another device holds the robot; and whether the robot has to be
            told, which it has not if the same grant is requested again.
        """
        only_sensors = level == "sensors"
        current = self.observers.get((robot, holder)) if only_sensors else self.grants.get(robot)
        # The DVA's own hold yields to any device.
        if current is not None and current.holder not in (holder, self.own):
            return None, False
        if only_sensors and current is None and len(self.observers) >= MAX_OBSERVERS:
            return None, False
        terms = holder, level, sensors
        same = current is not None and (current.holder, current.level, current.sensors) == terms
        session = (
            current.session if current is not None and same else self._new_session(only_sensors)
        )
        grant = Grant(robot, holder, level, session, sensors=sensors, address=address)
        self.changes += grant != current
        if only_sensors:
            self.observers[robot, holder] = grant
        else:
            self.grants[robot] = grant
        return grant, grant != current

    def renew(self, grant: Grant) -> Grant:
        """Return the same right with a session above all previous ones."""
        self.changes += 1
        renewed = self.grants[grant.robot] = replace(grant, session=self._new_session(False))
        return renewed

    def _new_session(self, only_sensors: bool) -> int:
        """Return a new session; only rights to drive are fenced, so only they raise the count."""
        # The random bits below the count keep anybody from guessing a session.
        self.count += not only_sensors
        return self.count << LOW_BITS | self.draw()

    def all(self) -> list[Grant]:
        """Return every grant that holds."""
        return [*self.grants.values(), *self.observers.values()]

    def restore(self, grant: Grant) -> None:
        """Restore a grant of an earlier life of the DVA."""
        self.changes += 1
        if grant.level == "sensors":
            self.observers[grant.robot, grant.holder] = grant
        else:
            self.grants[grant.robot] = grant

    def end(self, session: int) -> None:
        """End a single grant, or one that never began."""
        self.changes += 1
        _drop_session(self.grants, session)
        _drop_session(self.observers, session)

    def release(self, holder: str, robot: str | None = None) -> list[Grant]:
        """End and return the rights of `holder` to drive: of one robot, or of all."""
        return self._counted(_take(self.grants, holder, robot))

    def forget(self, holder: str, robot: str | None = None) -> list[Grant]:
        """End and return the rights of `holder` to read sensors: of one robot, or of all."""
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
