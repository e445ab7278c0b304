"""Taking a robot over by hand: from its holder, with what it was sent to, step by step.

A supervisor's control room revokes the holder's session and calls the robot off; it is sent to the
same event again, to be driven by the person's own seat; and the seat asks for it, which succeeds
once it stands. Without a seat, it is recalled and requested again. Each
step is a message, and the DVA may refuse any.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, Unpack

from dva_sim.agents.control_room.control_room import ControlRoomAgent
from dva_sim.console.asking.refusal import OnResult, unanswered
from dva_sim.console.wire.seats import Answered
from dva_sim.protocol import messages as m

RETRY_DELAY_S: Final = (
    0.5  # while a robot is brought to a standstill, or the policy was quicker [s]
)
MAX_TRIES: Final = 40


class Takeover:
    """One robot on its way into a person's hands.

    Args:
        agent: Control room that decides.
        robot: Id of the robot.
        reason: Reason in words.
        event: Event that the robot was sent to; None: it was sent nowhere.
        seat: Id of the device that is to drive it; None: the DVA sends it nowhere.
        take: Function that requests the robot, for the seat or otherwise.
        on_result: Callback for the result.
    """

    def __init__(
        self,
        agent: ControlRoomAgent,
        robot: str,
        reason: str,
        event: m.EventStatus | None,
        seat: str | None,
        take: Callable[[OnResult], object],
        on_result: OnResult,
    ) -> None:
        self._agent = agent
        self._robot = robot
        self._reason = reason
        self._event = event
        self._seat = seat
        self._take = take
        self._on_result = on_result
        self._tries = 0

    def begin(self) -> None:
        """Take the robot from its driver."""
        if self._seat is not None and self._event and self._event.operator == self._seat:
            self._ask_for_it()
        else:
            self._agent.ask(m.Revoke(self._robot, self._reason), self._revoked, self._lost)

    def _lost(self) -> None:
        unanswered(self._on_result)

    def _revoked(self, reply: m.Reply) -> None:
        if reply.code != m.OK:
            self._on_result(False, reply.reason)
        elif self._event is None:
            self._ask_for_it()
        else:
            # Where nobody held it yet, somebody may still be about to; else this is refused.
            body = m.TakeOff(self._event.event_id, self._robot, self._reason)
            self._agent.ask(body, self._called_off, self._lost)

    def _called_off(self, reply: m.Reply) -> None:
        self._send(reply.content)

    def _send(self, content: object) -> None:
        """Send it to the same event, driven by the seat, if the event is still open."""
        event = content if isinstance(content, m.EventStatus) else self._event
        assert event is not None
        if event.closed_for is not None or self._seat is None:
            self._ask_for_it()
            return
        number = event.event_id
        decisions = event.decisions
        body = m.Assign(number, self._robot, self._seat, None, self._reason, decisions)
        self._agent.ask(body, self._sent, self._lost)

    def _sent(self, reply: m.Reply) -> None:
        status = reply.content
        if reply.code == m.OK or not self._has_another_try():
            self._ask_for_it()
        elif isinstance(status, m.EventStatus):
            # The policy was quicker, or the robot is not free yet.
            self._agent.device.clock.call_after(RETRY_DELAY_S, self._send, status)
        else:
            self._ask_for_it()

    def _ask_for_it(self) -> None:
        self._take(self._taken)

    def _taken(self, ok: bool, text: str, /, **more: Unpack[Answered]) -> None:
        if ok or not self._has_another_try():
            self._on_result(ok, text, **more)
        else:
            self._agent.device.clock.call_after(RETRY_DELAY_S, self._ask_for_it)

    def _has_another_try(self) -> bool:
        self._tries += 1
        return self._tries < MAX_TRIES
