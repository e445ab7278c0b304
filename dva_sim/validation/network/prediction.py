"""The model plays a condition with what every run is made of: its network, requester and queue.

Only the operator's program stands here, as the measured one has none of a phone's app. It sends on
a fixed grid, or asks and waits for the reply. It ends with its last command: as soon as the next
one would lie beyond the window, and a requester whose reply is still missing when the window ends.
The robot's takes one command at a time, works on it, and answers.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, Literal

from typing_extensions import override

from dva_sim.agents.robot.command_queue import CommandQueue, Letter
from dva_sim.kernel.clock import Clock
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.streams import Streams
from dva_sim.kernel.suggestions import unknown
from dva_sim.network.connections import Connector, Load, ZeromqConfig, is_calm
from dva_sim.network.link import Link, make_link
from dva_sim.network.messaging import Requester
from dva_sim.network.pattern_runs import (
    COMMAND_BYTES,
    REPLY_BYTES,
    Condition,
    Measures,
    RunLog,
    measure_log,
)
from dva_sim.network.tcp import TcpOptions
from dva_sim.network.virtual_network import FRAMING, VirtualNetwork
from dva_sim.network.zmtp import framed
from dva_sim.validation.network.verdicts import OVERLOAD, PACKET_BYTES, is_bounded, load

OPERATOR = "operator"
ROBOT = "robot"
TOPIC = ""  # the measured programs subscribe to everything, and publish one frame
PAYLOAD_BYTES = framed(COMMAND_BYTES) - FRAMING - 2
"""Size of a published command, with which it is as long on the wire as the measured one."""
NUMBER_BYTES = 8
UNBOUNDED = 1 << 30  # a queue, buffer or time that nothing here fills


def message(number: int, size: int) -> bytes:
    """Bytes of a request, or a reply, that are as long on the wire as the measured ones.

    Those have an empty frame before them.
    """
    wire = framed(0) + framed(size)
    return number.to_bytes(NUMBER_BYTES, "little").ljust(wire - FRAMING, b".")


def number_in(data: bytes) -> int:
    """Number of the command of a message."""
    return int.from_bytes(data[:NUMBER_BYTES], "little")


class ModelProgram:
    """Base of the operator's programs.

    Args:
        network: Carries the commands.
        condition: Rate, time-out, window.
        log: Log of the run.

    Attributes:
        ended: End of the program [s]; None while it runs.
    """

    def __init__(self, network: VirtualNetwork, condition: Condition, log: RunLog) -> None:
        self._network = network
        self._condition = condition
        self._log = log
        self._clock = network.clock
        self._period = 1.0 / condition.hz
        self._end = 0.0
        self.ended: float | None = None

    def connect(self) -> None:
        """Connect to the robot, as far as a program does that before its first command."""

    def start(self) -> None:
        """The first command is due now."""
        now = self._log.start = self._clock.now
        self._end = now + self._condition.warm_s + self._condition.dur_s
        self._clock.call_at(self._end, self._stop)
        self._next()

    def _next(self) -> None:
        """Send a command."""
        raise NotImplementedError

    def _issue(self) -> int:
        """Note that a command is issued now; its number."""
        self._log.issued.append(self._clock.now)
        return len(self._log.issued) - 1

    def _schedule(self, due: float, action: Callable[[], object]) -> None:
        """Go on at `due` [s], or end now if that is too late."""
        if due >= self._end - 1e-9:
            self._stop()
        elif self.ended is None:
            self._clock.call_at(due, action)

    def _stop(self) -> None:
        if self.ended is None:
            self.ended = self._clock.now

    def _replied(self, reply: bytes) -> None:
        self._log.replied.append((number_in(reply), self._clock.now))


class Publishing(ModelProgram):
    """Publishes: command k is sent at start + k / hz."""

    @override
    def _next(self) -> None:
        self._send(self._issue())
        due = self._log.start + len(self._log.issued) * self._period
        self._schedule(due, self._next)

    def _send(self, number: int) -> None:
        data = number.to_bytes(NUMBER_BYTES, "little")
        self._network.publish(OPERATOR, TOPIC, data, PAYLOAD_BYTES)


class Dealing(Publishing):
    """Asks on the same grid, without waiting for replies."""

    @override
    def connect(self) -> None:
        self._requests = Requester(
            self._network, OPERATOR, ROBOT, float(UNBOUNDED), attempts=1, window=UNBOUNDED
        )
        self._requests.open()

    @override
    def _send(self, number: int) -> None:
        self._requests.request(message(number, COMMAND_BYTES), self._replied)


class Asking(ModelProgram):
    """Requests: the next command goes at the later of the reply and the last issue + 1 / hz.

    After a time-out the same command goes over a new socket; after the last attempt it is
    given up, and the next command follows.
    """

    @override
    def connect(self) -> None:
        condition = self._condition
        assert condition.timeout_ms is not None
        assert condition.attempts is not None
        self._requests = Requester(
            self._network, OPERATOR, ROBOT, condition.timeout_ms / 1000.0, condition.attempts
        )
        self._requests.on_timeout = lambda: self._log.timeouts.append(self._clock.now)
        self._requests.open()

    @override
    def _next(self) -> None:
        if self.ended is None:
            data = message(self._issue(), COMMAND_BYTES)
            self._requests.request(data, self._answered, self._failed)

    def _answered(self, reply: bytes) -> None:
        self._replied(reply)
        self._go_on()

    def _failed(self) -> None:
        self._log.alerts.append(self._clock.now)
        self._go_on()

    def _go_on(self) -> None:
        self._schedule(max(self._clock.now, self._log.issued[-1] + self._period), self._next)


CONFLATES: dict[str, Literal["none", "publisher", "subscriber", "both"]] = {
    "none": "none",
    "op": "publisher",
    "rob": "subscriber",
    "both": "both",
}
PROGRAMS: dict[str, type[ModelProgram]] = {
    "req-rep": Asking,
    "pub-sub": Publishing,
    "pipelined": Dealing,
}
NEVER_EARLY_S = 1e-6
"""Work takes at least what it should: this decides which comes first, where its end and the
next arrival would fall on the same moment."""

Depth = Literal["auto", "message", "segment", "datagram"]
Played = Literal["message", "segment", "datagram"]

_PATIENCE_S = 120.0  # for a handshake; then nothing is ever sent
LATE_S = 0.0001
"""Median lateness of packets at the emulated link, by its own account [s].

It decides what comes first where delays and periods are round: acknowledgements do not return
at the very moment of the next command.
"""

WITHOUT: dict[str, dict[str, Any]] = {
    "send buffer": {"send_buffer": UNBOUNDED},
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
    run = PredictedRun(condition, Streams(seed), depth_for(condition, depth), without)
    run.play()
    return measure_log(run.log, condition.warm_s, condition.dur_s)


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


def tcp_options(condition: Condition, without: Sequence[str]) -> TcpOptions:
    """TCP's options at both ends, with some mechanisms left out.

    Raises:
        ConfigError: there is no such mechanism.
    """
    changes: dict[str, Any] = {"congestion": condition.cc}
    for name in without:
        if name not in WITHOUT:
            raise ConfigError(unknown("mechanism", name, WITHOUT))
        changes |= WITHOUT[name]
    return replace(TcpOptions(), **changes)


def make_links(condition: Condition, streams: Streams) -> tuple[Link, Link]:
    """The emulated link from the operator to the robot, and the one back."""
    config = condition.link(LATE_S)
    up = make_link(config, "up", streams, "link/up")
    return up, make_link(config, "down", streams, "link/down")


class PredictedRun:
    """One run: the operator's program, a virtual network, and a robot's queue.

    Args:
        streams: Random streams of the link.
        depth: Depth of the simulated connections.
        without: Mechanisms of TCP to leave out.

    Attributes:
        log: Log of the run.
    """

    def __init__(
        self, condition: Condition, streams: Streams, depth: Played, without: Sequence[str]
    ) -> None:
        self._condition = condition
        self.log = RunLog()
        self._clock = Clock()
        up, down = make_links(condition, streams)
        self._network = VirtualNetwork(
            self._clock,
            lambda source, to: (up, down) if source == OPERATOR else (down, up),
            connector=_connector(condition, depth, without),
        )
        self._network.on_open = self._opened
        self._program = PROGRAMS[condition.pattern](self._network, condition, self.log)
        service = condition.proc_ms / 1000.0 + NEVER_EARLY_S
        published = condition.pattern == "pub-sub"
        self._queue = CommandQueue(
            self._clock,
            lambda: service,
            self._applied,
            latest_wins=condition.conflate in ("rob", "both"),
            limit=condition.hwm if published else UNBOUNDED,
        )
        self._network.serve(ROBOT, self._queue.request)
        if published:
            # The operator connects: who answers is there when its first packet has arrived.
            self._clock.call_at(condition.delay_ms / 1000.0, self._subscribe)
        self._program.connect()

    def play(self) -> None:
        """Let time pass until the operator's program has ended."""
        if not self._condition.wait_hs:
            self._program.start()
        while self._program.ended is None and (self.log.issued or self._clock.now < _PATIENCE_S):
            self._clock.run(self._clock.now + 1.0)
        ended = self._program.ended or 0.0
        self.log.applied = [item for item in self.log.applied if item[1] <= ended]
        self.log.replied = [item for item in self.log.replied if item[1] <= ended]

    def _opened(self, node: str, peer: str) -> None:
        """A connection stands: after the first the operator's program starts, a publisher later."""
        if not math.isnan(self.log.handshake_s):
            return
        condition = self._condition
        now = self._clock.now
        self.log.handshake_s = now - (condition.delay_ms / 1000.0 if node == ROBOT else 0.0)
        if condition.wait_hs:
            due = self.log.handshake_s + condition.subscription_wait_s
            self._clock.call_at(due, self._program.start)

    # --- the robot ---------------------------------------------------------------------------

    def _subscribe(self) -> None:
        self._queue.flow = self._network.subscribe(ROBOT, OPERATOR, TOPIC, self._queue.published)

    def _applied(self, letter: Letter) -> None:
        number = number_in(letter.data)
        self.log.applied.append((number, self._clock.now))
        if letter.answer is not None:
            letter.answer(message(number, REPLY_BYTES))


def _connector(condition: Condition, depth: Played, without: Sequence[str]) -> Connector:
    """Connections with the options of the condition's sockets."""
    zeromq = ZeromqConfig(
        high_water_mark=condition.hwm,
        send_buffer_bytes=condition.sndbuf,
        receive_buffer_bytes=condition.rcvbuf,
        conflate=CONFLATES[condition.conflate],
    )
    tcp = tcp_options(condition, without)
    if depth == "datagram":
        return Connector("datagrams", zeromq=zeromq, tcp=tcp)
    return Connector(depth=depth, zeromq=zeromq, tcp=tcp)
