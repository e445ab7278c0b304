"""Questions of a robot to the DVA about permissions, and the messages that wait for answers."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from dva_sim.agents.device import AgentDevice
from dva_sim.agents.robot.command_queue import MAX_OF_OTHERS, Letter
from dva_sim.agents.robot.controller import INQUIRY_WAIT_S, Decision, RobotController
from dva_sim.agents.robot.decision_log import ASKS, NO_ANSWER
from dva_sim.protocol import messages as m

PER_CONNECTION = (
    2  # maximum waiting messages of a connection: devices send one at a time, perhaps repeated
)
PER_TIMEOUT = 3.0  # a message waits at least the time-out of a request divided by this


@dataclass(eq=False)
class Waiting:
    """Message that waits until the DVA has confirmed what its sender may do.

    Attributes:
        letter: The message.
        reader: Sender, if the message requests sensor data; None if it requests an action.
        asked: True if the open query was sent after the message had arrived.
    """

    letter: Letter
    reader: str | None
    asked: bool = False


class Confirmations:
    """Asks the DVA the questions of a robot's controller, and holds messages until it has answered.

    Args:
        device: The robot's device.
        controller: The robot's controller.
        decide: Callback for the answer of the DVA.
        conclude: Callback for a message that has waited; it does not wait again.
        happened: Callback when a question is asked, and when one has failed.
    """

    def __init__(
        self,
        device: AgentDevice,
        controller: RobotController,
        decide: Callable[[m.Reply], Decision],
        conclude: Callable[[Letter], object],
        happened: Callable[[str], object],
    ) -> None:
        self._device = device
        self._inquiry = controller.inquiry
        self._decide = decide
        self._conclude = conclude
        self._happened = happened
        self._waiting: list[Waiting] = []
        self._will_ask = False

    def ask(self) -> None:
        """Ask the next question now, or as soon as the rate limit allows."""
        clock = self._device.clock
        question = self._inquiry.next(clock.now)
        if question is not None:
            self._happened(ASKS)
            self._device.recorder.counters["asked the DVA who holds a robot"] += 1
            for wait in self._waiting_for(question):
                wait.asked = True
            self._device.ask(self._device.dva, question, self._answered, self._failed)
            return
        due = self._inquiry.due(clock.now)
        if due < math.inf and not self._will_ask:
            self._will_ask = True
            clock.call_at(due, self._ask_again)

    def keep(self, letter: Letter, message: m.Message) -> bool:
        """Queue a message until the DVA has answered; False if the queue is full."""
        of_peer = sum(wait.letter.peer == letter.peer for wait in self._waiting)
        if of_peer >= PER_CONNECTION or len(self._waiting) >= MAX_OF_OTHERS:
            return False
        reader = message.source if isinstance(message.body, m.DevSub) else None
        waiting = Waiting(letter, reader)
        self._waiting.append(waiting)
        patience = max(INQUIRY_WAIT_S, self._device.timeout / PER_TIMEOUT)
        self._device.clock.call_after(patience, self._release, [waiting])
        return True

    def forget(self) -> None:
        """Drop all waiting messages, since the computer starts again."""
        self._waiting.clear()

    def _waiting_for(self, question: m.GetGrant) -> list[Waiting]:
        reader = question.holder if question.level is not None else None
        return [wait for wait in self._waiting if wait.reader == reader]

    def _answered(self, reply: m.Reply) -> None:
        if self._device.silent:  # the computer hangs or has no power, so it receives nothing
            self._failed()
            return
        question = self._inquiry.asked
        of = self._waiting_for(question) if question is not None else []
        settled = [wait for wait in of if wait.asked]
        # Only messages older than the question are settled: a later one may refer to a later grant.
        if not self._decide(reply).waits:
            self._release(settled)
        self.ask()

    def _failed(self) -> None:
        self._happened(NO_ANSWER)
        self._inquiry.unanswered()
        self.ask()

    def _ask_again(self) -> None:
        self._will_ask = False
        self.ask()

    def _release(self, those: list[Waiting]) -> None:
        for wait in those:
            if wait in self._waiting:
                self._waiting.remove(wait)
                self._conclude(wait.letter)
