"""Handover of robots: the holder, the device that asks, and when it may take over.

A robot changes hands at a standstill (S2): its holder gives it up, or a supervisor takes it; the
robot acknowledges that the session is over; it is seen to stand; only then
is the next session granted. Meanwhile it is nobody else's.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import StrEnum

from dva_sim.core.orders import Orders
from dva_sim.core.sessions import Send, Sessions
from dva_sim.protocol import messages as m
from dva_sim.protocol.wire_size import sent_time

ANSWER_WITHIN = 30.0  # a holder that has not answered within this time declines [s]
STOP_WITHIN = 30.0  # a robot that has not stopped within this time is not handed over [s]
FETCH_WITHIN = 30.0  # time for which a stopped robot is reserved for its next holder [s]
DECLINED_FOR = 10.0  # a holder that has declined is not asked again for this time [s]
STANDING = 0.02  # a robot slower than this stands [m/s, rad/s]


class Step(StrEnum):
    """Stage of a handover, in words for the one who waits for it."""

    ASKED = "who has been asked for it"
    DECLINED = "who does not give it up"
    STOPPING = "it is being stopped for you"
    READY = "it is kept for you"


@dataclass
class Handover:
    """Handover of one robot: the device that asks, the step, and its deadline [s]."""

    asker: str
    step: Step
    until: float


@dataclass
class Handovers:
    """All handovers of the DVA; at most one of each robot.

    Attributes:
        orders: Current orders.
        supervisors: Ids of the devices that may take a robot from its holder.
        under_way: Handovers by robot.
    """

    orders: Orders
    supervisors: frozenset[str] = frozenset()
    under_way: dict[str, Handover] = field(default_factory=dict)
    _since: dict[str, tuple[int, float]] = field(default_factory=dict)

    @property
    def sessions(self) -> Sessions:
        """Permissions of devices."""
        return self.orders.sessions

    # --- who has it --------------------------------------------------------------------

    def holder(self, robot: str, asker: str, now: float) -> m.Holder | None:
        """Return another device that holds a robot, serves an order with it, or waits for it."""
        handover = self.under_way.get(robot)
        if handover is not None and robot in self.sessions.reserved and handover.asker != asker:
            return self._named(handover.asker, 0.0)
        grant = self.sessions.permissions.grants.get(robot)
        if grant is not None and grant.holder not in (asker, self.sessions.permissions.own):
            return self._named(grant.holder, now - self._noted(robot, grant.session, now))
        engaged = self.orders.engaged
        for event in engaged.all(robot):
            if not engaged.is_at(asker, event):
                holder_id = event.operator or robot
                return self._named(holder_id, now - event.times.get("assigned", now))
        return None

    def _named(self, device: str, held_for: float) -> m.Holder:
        label = self.orders.label_of(device)
        return m.Holder(device, label, sent_time(held_for))

    def _noted(self, robot: str, session: int, now: float) -> float:
        """Return when a session was first seen to hold a robot [s]."""
        if self._since.get(robot, (0, 0.0))[0] != session:
            grants = self.sessions.permissions.grants
            # Cleaned only now and then, so that a call takes constant time on average.
            if len(self._since) > 2 * len(grants) + 64:
                self._since = {r: since for r, since in self._since.items() if r in grants}
            self._since[robot] = session, now
        return self._since[robot][1]

    def granted(self, robot: str, session: int, now: float) -> None:
        """Note that somebody has the robot from now on, or still."""
        if robot in self.sessions.reserved:
            self.orders.counters["robot handed over"] += 1
        self._noted(robot, session, now)
        self._over(robot)

    # --- how it changes hands ----------------------------------------------------------

    def wish(
        self, request: m.PermissionRequest, asker: m.Device, holder: m.Holder, now: float
    ) -> tuple[str, list[Send]]:
        """Return how a request for another's robot stands, in words, and what to send."""
        robot = request.device
        handover = self.under_way.get(robot)
        if request.takeover == "force":
            return Step.STOPPING, self._stop(robot, asker.id_tag, now)
        if request.takeover != "ask":
            return "", []
        if handover is not None:
            return handover.step if handover.asker == asker.id_tag else "another waits for it", []
        self.under_way[robot] = Handover(asker.id_tag, Step.ASKED, now + ANSWER_WITHIN)
        ask = m.HandoverRequest(robot, asker.id_tag, asker.label)
        return Step.ASKED, [Send(holder.holder, ask)]

    def waits(self, robot: str, asker: str) -> str | None:
        """Return why the asker has to wait for a robot that is reserved for it, or None."""
        handover = self.under_way.get(robot)
        if handover is None or handover.asker != asker or handover.step is not Step.STOPPING:
            return None
        return Step.STOPPING

    def answered(self, send: Send, gives: bool, now: float) -> list[Send]:
        """Take the answer of a holder that gives its robot up, or does not."""
        body = send.body
        assert isinstance(body, m.HandoverRequest)
        handover = self.under_way.get(body.device)
        if handover is None or handover.step is not Step.ASKED or handover.asker != body.holder:
            return []
        holder = self.holder(body.device, handover.asker, now)
        if gives and holder is not None and holder.holder == send.to:
            return self._stop(body.device, handover.asker, now)
        handover.step = Step.DECLINED
        handover.until = now + DECLINED_FOR
        return []

    def _stop(self, robot: str, asker: str, now: float) -> list[Send]:
        """Let nobody drive the robot any more; its task is open to others."""
        self.under_way[robot] = Handover(asker, Step.STOPPING, now + STOP_WITHIN)
        self.sessions.reserved.add(robot)
        sends = self.orders.taken_away(robot, now)
        grant = self.sessions.permissions.grants.get(robot)
        if grant is not None:
            self.sessions.revoke(grant)
        return sends

    def seen(self, robot: str, status: m.RobotStatus, now: float) -> None:
        """Take a robot's status: once it stands and knows its session is over, it is ready."""
        handover = self.under_way.get(robot)
        if (
            handover is None
            or handover.step is not Step.STOPPING
            or self.sessions.has_unacknowledged(robot)
        ):
            return
        still = max(abs(status.speed), abs(status.turn_rate)) <= STANDING
        if still and status.mode == "Idle":
            handover.step = Step.READY
            handover.until = now + FETCH_WITHIN

    def next_deadline(self) -> float:
        """Return when the next handover has taken too long [s]."""
        return min((handover.until for handover in self.under_way.values()), default=math.inf)

    def lapse(self, now: float) -> None:
        """End handovers that take too long, or whose asker is gone."""
        entries = self.orders.registry.entries
        for robot, handover in list(self.under_way.items()):
            asker = entries.get(handover.asker)
            if handover.until <= now or asker is None or asker.silent:
                self._over(robot)

    def _over(self, robot: str) -> None:
        self.under_way.pop(robot, None)
        self.sessions.reserved.discard(robot)
