"""The robot's program: it takes one command at a time, works on it, and answers."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import NamedTuple

from dva_sim.clock import Clock
from dva_sim.network.condition import Condition
from dva_sim.network.measures import RunLog
from dva_sim.network.pipes import ReceivePipe

NEVER_EARLY_S = 1e-6
"""Work takes at least what it should: this decides which comes first, where its end and the
next arrival would fall on the same moment."""


class Command(NamedTuple):
    """A command on its way.

    Attributes:
        number: Which one it is.
        answer: Sends the reply, if one is wanted.
    """

    number: int
    answer: Callable[[int], object] | None


class Robot:
    """Works through what its connections have received, in the order of arrival.

    Args:
        clock: The run's clock.
        condition: Service time, high-water mark, latest-wins.
        log: Is told of each application.
    """

    def __init__(self, clock: Clock, condition: Condition, log: RunLog) -> None:
        self._clock, self._condition, self._log = clock, condition, log
        self._service_s = condition.proc_ms / 1000.0 + NEVER_EARLY_S
        self._order: deque[ReceivePipe[Command]] = deque()
        self._busy = False

    def accept(self) -> ReceivePipe[Command]:
        """The pipe of a new connection."""
        return ReceivePipe(self._condition.hwm, self._condition.conflate in ("rob", "both"))

    def receive(self, pipe: ReceivePipe[Command], command: Command) -> None:
        """A command has arrived.

        The program wakes up when all that came in one piece is there: ZeroMQ's thread decodes
        a whole batch first.
        """
        if not pipe.put(command):
            return
        self._order.append(pipe)
        if not self._busy:
            self._busy = True
            self._clock.call_after(0.0, self._work)

    def _work(self) -> None:
        """Take the next command that no newer one has replaced."""
        while self._order:
            command = self._order.popleft().take()
            if command is not None:
                self._clock.call_after(self._service_s, self._done, command)
                return
        self._busy = False

    def _done(self, command: Command) -> None:
        self._log.applied.append((command.number, self._clock.now))
        if command.answer is not None:
            command.answer(command.number)
        self._work()
