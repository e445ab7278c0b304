"""The model plays a condition: the operator's and the robot's program over a virtual link.

The operator's program sends on a fixed grid, or asks and waits for the reply. It ends with its last
command: as soon as the next one would lie beyond the window, and a requester whose reply is still
missing when the window ends. The robot's takes one command at a time, works on it, and answers.
"""

from __future__ import annotations

import dataclasses
import math
from collections import deque
from collections.abc import Callable, Sequence
from typing import Any, Literal, NamedTuple

from typing_extensions import override

from dva_sim.kernel.clock import Clock
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.streams import Streams
from dva_sim.kernel.suggestions import unknown
from dva_sim.network.connections import AnyConnection, Connection, DatagramConnection, Load, is_calm
from dva_sim.network.link import Link, make_link
from dva_sim.network.pattern_runs import (
    COMMAND_BYTES,
    REPLY_BYTES,
    Condition,
    Measures,
    RunLog,
    measure_log,
)
from dva_sim.network.tcp import TcpOptions
from dva_sim.network.zmtp import ReceivePipe, ZmtpConnection, ZmtpOptions, framed
from dva_sim.validation.network.verdicts import OVERLOAD, PACKET_BYTES, is_bounded, load


class ModelProgram:
    """Base of both programs.

    Args:
        clock: The run's clock.
        condition: Rate, time-out, window.
        log: Log of the run.
        socket: Sends the commands.

    Attributes:
        ended: End of the program [s]; None while it runs.
    """

    def __init__(self, clock: Clock, condition: Condition, log: RunLog, socket: Session) -> None:
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

    @override
    def replied(self, number: int) -> None:
        # A closed socket delivers nothing.
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
        number: Number of the command.
        answer: Sends the reply, if one is wanted.
    """

    number: int
    answer: Callable[[int], object] | None


class Robot:
    """Works through what its connections have received, in the order of arrival.

    Args:
        clock: The run's clock.
        condition: Service time, high-water mark, latest-wins.
        log: Log that receives each application.
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


Depth = Literal["auto", "message", "segment", "datagram"]
Played = Literal["message", "segment", "datagram"]

_PATIENCE_S = 120.0  # for a handshake; then nothing is ever sent
LATE_S = 0.0001
"""Median lateness of packets at the emulated link, by its own account [s].

It decides what comes first where delays and periods are round: acknowledgements do not return
at the very moment of the next command.
"""
_SUBSCRIPTION = 1  # bytes of a subscription to everything
_UNBOUNDED = 1 << 30  # a buffer that nothing here fills [B]

WITHOUT: dict[str, dict[str, Any]] = {
    "send buffer": {"send_buffer": _UNBOUNDED},
    "variance of the round trip": {"rtt_variance": False},
    "tail-loss probe": {"tail_probe": False},
    "RACK": {"rack": False},
    "congestion window": {"congestion_window": False},
    "delayed acknowledgement": {"delayed_ack": 0.0},
    "granularity of timers": {"tick": 0.0},
    "cost of the handshake": {"handshake": False},
}
"""Change that leaves a mechanism of TCP out."""


def predict(
    condition: Condition, seed: int, depth: Depth = "auto", without: Sequence[str] = ()
) -> Measures:
    """Predict a condition: the result columns of one run.

    Args:
        seed: Random seed of the link.
        depth: `message`, `segment` or `datagram`; `auto` takes the cheapest that is exact.
        without: Mechanisms of TCP to leave out, by their names in `WITHOUT`.

    Raises:
        ConfigError: there is no such mechanism.
    """
    session = Session(condition, Streams(seed), depth_for(condition, depth), options(without))
    session.play()
    return measure_log(session.log, condition.warm_s, condition.dur_s)


def depth_for(condition: Condition, depth: Depth = "auto") -> Played:
    """Depth at which a condition is simulated.

    Messages are enough where the link is calm, the robot keeps up, no buffer matters, and
    what is under way fits into TCP's initial window.
    """
    if depth != "auto":
        return depth
    offered = Load(8 * condition.hz * (COMMAND_BYTES + PACKET_BYTES))
    calm = all(is_calm(link, offered) for link in make_links(condition, Streams(0)))
    eased = load(condition) < OVERLOAD and not is_bounded(condition)
    under_way = condition.hz * 2 * condition.delay_ms / 1000.0
    fits = condition.pattern == "req-rep" or under_way <= TcpOptions().initial_window
    return "message" if calm and eased and fits else "segment"


def options(without: Sequence[str]) -> dict[str, Any]:
    """TCP's options that leave some mechanisms out.

    Raises:
        ConfigError: there is no such mechanism.
    """
    found: dict[str, Any] = {}
    for name in without:
        if name not in WITHOUT:
            raise ConfigError(unknown("mechanism", name, WITHOUT))
        found |= WITHOUT[name]
    return found


def make_links(condition: Condition, streams: Streams) -> tuple[Link, Link]:
    """The emulated link from the operator to the robot, and the one back."""
    config = condition.link(LATE_S)
    up = make_link(config, "up", streams, "link/up")
    return up, make_link(config, "down", streams, "link/down")


class Session:
    """One run: two programs, a link, and as many connections as are opened.

    Args:
        streams: Random streams of the link.
        depth: Depth of the simulated connections.
        tcp: Options of TCP at both ends beside those of the condition.

    Attributes:
        log: Log of the run.
    """

    def __init__(
        self, condition: Condition, streams: Streams, depth: Played, tcp: dict[str, Any]
    ) -> None:
        self._condition, self._depth, self._tcp = condition, depth, tcp
        self.clock, self.log = Clock(), RunLog()
        self._links = make_links(condition, streams)
        self._robot = Robot(self.clock, condition, self.log)
        self._program = self._make_program()
        self._joined = condition.pattern != "pub-sub"
        self._size = framed(0) + framed(COMMAND_BYTES) if self._asks else framed(COMMAND_BYTES)
        self._reply = framed(0) + framed(REPLY_BYTES) if self._asks else framed(REPLY_BYTES)
        self._ready = False
        self._waiting: int | None = None
        self._connect()

    @property
    def _asks(self) -> bool:
        return self._condition.pattern == "req-rep"

    def _make_program(self) -> ModelProgram:
        kind = Asking if self._asks else OnGrid
        return kind(self.clock, self._condition, self.log, self)

    def play(self) -> None:
        """Let time pass until the operator's program has ended."""
        if not self._condition.wait_hs:
            self._program.start()
        while self._program.ended is None and (self.log.issued or self.clock.now < _PATIENCE_S):
            self.clock.run(self.clock.now + 1.0)
        ended = self._program.ended or 0.0
        self.log.applied = [item for item in self.log.applied if item[1] <= ended]
        self.log.replied = [item for item in self.log.replied if item[1] <= ended]

    # --- the operator's socket -------------------------------------------------------------

    def send(self, number: int) -> None:
        """Send a command: a publisher without subscriber, or at its mark, sends nothing.

        A request that is made during the handshake waits for its end.
        """
        if not self._ready:
            self._waiting = number if self._asks else None
        elif self._joined:
            self._connection.opener.send(number, self._size)

    def reopen(self) -> None:
        """Close the socket without lingering and open another one."""
        self._connection.close()
        self._ready = False
        self._connect()

    # --- connections -------------------------------------------------------------------------

    def _connect(self) -> None:
        """A new connection, whose handshake begins now."""
        pipe = self._robot.accept()

        def at_robot(number: int) -> None:
            self._robot.receive(pipe, ModelCommand(number, answer))

        def answer(number: int) -> None:
            if self._condition.pattern != "pub-sub":
                connection.peer.send(number, self._reply)

        def at_operator(number: int | None) -> None:
            if number is None:
                self._joined = True
            elif connection is self._connection:
                self._program.replied(number)

        def accepted() -> None:
            if self._condition.pattern == "pub-sub":
                connection.peer.send(None, framed(_SUBSCRIPTION))

        def ready() -> None:
            if connection is self._connection:
                self._handshaken()

        connection = self._connection = self._make(at_robot, at_operator)
        pipe.flow = connection.peer
        connection.open(ready, accepted)

    def _make(
        self, at_robot: Callable[[int], object], at_operator: Callable[[int | None], object]
    ) -> AnyConnection:
        out, back = self._links
        if self._depth == "segment":
            ends = self._ends()
            return ZmtpConnection(self.clock, out, back, at_robot, at_operator, *ends)
        kind = Connection if self._depth == "message" else DatagramConnection
        return kind(self.clock, out, back, at_robot, at_operator)

    def _ends(self) -> tuple[ZmtpOptions, ZmtpOptions]:
        """Socket options of the operator and of the robot."""
        condition = self._condition
        both = TcpOptions(congestion=condition.cc)
        operator = dataclasses.replace(both, **{"send_buffer": condition.sndbuf} | self._tcp)
        robot = dataclasses.replace(both, **{"receive_buffer": condition.rcvbuf} | self._tcp)
        keeps_last = condition.conflate in ("op", "both")
        return (
            ZmtpOptions(condition.hwm, keeps_last, operator),
            ZmtpOptions(condition.hwm, False, robot),
        )

    def _handshaken(self) -> None:
        """A handshake of the operator's is over: after the first it starts, a publisher later."""
        self._ready = True
        if self._waiting is not None:
            self.send(self._waiting)
            self._waiting = None
        if math.isnan(self.log.handshake_s):
            self.log.handshake_s = self.clock.now
            if self._condition.wait_hs:
                wait = self._condition.subscription_wait_s
                self.clock.call_after(wait, self._program.start)
