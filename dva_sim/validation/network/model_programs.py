"""The operator's programs: one sends on a fixed grid, the other asks and waits for the reply.

They end with their last command: as soon as the next one would lie beyond the window, and a
requester whose reply is still missing when the window ends.

The robot's program: it takes one command at a time, works on it, and answers.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import NamedTuple, Protocol

from dva_sim.kernel.clock import Clock
from dva_sim.network.pattern_runs import Condition, RunLog
from dva_sim.network.zmtp import ReceivePipe


class Socket(Protocol):
    """What a program does with the operator's socket."""

    def send(self, number: int) -> None:
        """Send a command."""

    def reopen(self) -> None:
        """Close it without lingering and open another one."""


class ModelProgram:
    """What both programs have in common.

    Args:
        clock: The run's clock.
        condition: Rate, time-out, window.
        log: Is told what happens.
        socket: Sends the commands.

    Attributes:
        ended: When the program ended [s]; None as long as it runs.
    """

    def __init__(self, clock: Clock, condition: Condition, log: RunLog, socket: Socket) -> None:
        self._clock, self._condition, self._log, self._socket = clock, condition, log, socket
        self._period = 1.0 / condition.hz
        self._end = 0.0
        self.ended: float | None = None

    def start(self) -> None:
        """The first command is due now."""
        now = self._log.start = self._clock.now
        self._end = now + self._condition.warm_s + self._condition.dur_s
        self._next()

    def replied(self, number: int) -> None:
        """A reply has arrived."""
        self._log.replied.append((number, self._clock.now))

    def _next(self) -> None:
        raise NotImplementedError

    def _schedule(self, due: float, action: Callable[[], object]) -> None:
        """Go on at `due` [s], or end now if that is too late."""
        if due >= self._end - 1e-9:
            self.ended = self._clock.now
        else:
            self._clock.call_at(due, action)


class OnGrid(ModelProgram):
    """Publishes, or asks without waiting: command k is sent at start + k / hz."""

    def _next(self) -> None:
        log = self._log
        log.issued.append(self._clock.now)
        self._socket.send(len(log.issued) - 1)
        self._schedule(log.start + len(log.issued) * self._period, self._next)


class Asking(ModelProgram):
    """Requests: the next command goes at the later of the reply and the last issue + 1 / hz.

    After a time-out the same command goes over a new socket; after the last attempt it is
    given up, and the next command follows.
    """

    _waiting: tuple[int | None, int] = (None, 0)  # for the reply to which command, which attempt

    def _next(self) -> None:
        if self.ended is None:
            self._log.issued.append(self._clock.now)
            self._attempt(1)

    def _attempt(self, attempt: int) -> None:
        assert self._condition.timeout_ms is not None
        number = len(self._log.issued) - 1
        self._socket.send(number)
        deadline = self._clock.now + self._condition.timeout_ms / 1000.0
        self._waiting = number, attempt
        if deadline > self._end:
            self._clock.call_at(self._end, self._give_up, number)
        else:
            self._clock.call_at(deadline, self._expire, number, attempt)

    def replied(self, number: int) -> None:
        """See `ModelProgram`; a socket that was closed delivers nothing."""
        super().replied(number)
        self._waiting = None, 0
        self._go_on()

    def _expire(self, number: int, attempt: int) -> None:
        if self._waiting != (number, attempt):
            return
        self._log.timeouts.append(self._clock.now)
        self._socket.reopen()
        assert self._condition.attempts is not None
        if attempt < self._condition.attempts:
            self._attempt(attempt + 1)
            return
        self._log.alerts.append(self._clock.now)
        self._go_on()

    def _go_on(self) -> None:
        last = self._log.issued[-1]
        self._schedule(max(self._clock.now, last + self._period), self._next)

    def _give_up(self, number: int) -> None:
        """The window is over and the reply is not there."""
        if self._waiting[0] == number:
            self.ended = self._clock.now


NEVER_EARLY_S = 1e-6
"""Work takes at least what it should: this decides which comes first, where its end and the
next arrival would fall on the same moment."""


class ModelCommand(NamedTuple):
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
        self._order: deque[ReceivePipe[ModelCommand]] = deque()
        self._busy = False

    def accept(self) -> ReceivePipe[ModelCommand]:
        """The pipe of a new connection."""
        return ReceivePipe(self._condition.hwm, self._condition.conflate in ("rob", "both"))

    def receive(self, pipe: ReceivePipe[ModelCommand], command: ModelCommand) -> None:
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

    def _done(self, command: ModelCommand) -> None:
        self._log.applied.append((command.number, self._clock.now))
        if command.answer is not None:
            command.answer(command.number)
        self._work()
