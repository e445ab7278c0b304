"""Robots that a supervisor takes from their holders, from messages on the network."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from dva_sim.core.handovers import STOP_WITHIN
from dva_sim.protocol import messages as m
from dva_sim.simulation.full.observations import Right

MAX_KEPT = 1000  # maximum requests that wait for an answer


class Stopping(NamedTuple):
    """Robot that is stopped for its next holder.

    Attributes:
        asker: For whom.
        session: Session of its last holder.
        until: Time after which any holder has got it in another way [s].
    """

    asker: str
    session: int
    until: float


class Takeovers:
    """Ledger of robots that are stopped for a device, and of when they are handed over."""

    def __init__(self) -> None:
        self._asked: dict[tuple[str, int], str] = {}
        self._stopping: dict[str, Stopping] = {}
        self._held: dict[str, Right] = {}

    def hears(self, source: str, message: m.Message) -> None:
        """Note a request that has reached the DVA."""
        body = message.body
        if isinstance(body, m.PermissionRequest) and body.takeover == "force":
            self._asked[source, message.message_id] = body.device
            if len(self._asked) > MAX_KEPT:
                del self._asked[next(iter(self._asked))]

    @property
    def waits(self) -> bool:
        """True while a request of the DVA is unanswered."""
        return bool(self._asked)

    def says(self, to: str, reply: m.Reply, now: float) -> None:
        """Note an answer of the DVA: a held robot is stopped for a device that may take it."""
        robot = self._asked.pop((to, reply.answers), None)
        hold = self._held.get(robot or "")
        if robot is None or hold is None or hold.holder == to or reply.code != m.BUSY:
            return
        self._stopping[robot] = Stopping(to, hold.session, now + STOP_WITHIN)

    def given(
        self, rights: Sequence[Right], now: float, works: bool
    ) -> Iterator[tuple[Right, int]]:
        """Yield rights of devices for which a robot was stopped, with the last holder's session."""
        before = self._held
        self._held = {right.robot: right for right in rights}
        if not works:  # another DVA knows of no hand-over
            self._stopping.clear()
        for robot, right in self._held.items():
            stopping = self._stopping.get(robot)
            if stopping is None or right.session == stopping.session or right == before.get(robot):
                continue
            del self._stopping[robot]
            if right.holder == stopping.asker and now < stopping.until:
                yield right, stopping.session
