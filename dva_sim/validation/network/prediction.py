"""The model plays a condition: the operator's and the robot's program over a virtual link."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from typing import Any, Literal

from dva_sim.kernel.clock import Clock
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.streams import Streams
from dva_sim.kernel.suggestions import unknown
from dva_sim.network.connections import AnyConnection, Connection, DatagramConnection, Load, is_calm
from dva_sim.network.link import Link, LinkConfig
from dva_sim.network.link.link import make_link
from dva_sim.network.link.losses import Bursts
from dva_sim.network.pattern_runs import (
    COMMAND_BYTES,
    REPLY_BYTES,
    Condition,
    Measures,
    RunLog,
    measure_log,
)
from dva_sim.network.tcp import TcpOptions
from dva_sim.network.zmtp import ZmtpConnection, ZmtpOptions, framed
from dva_sim.validation.network.model_programs import (
    Asking,
    ModelCommand,
    ModelProgram,
    OnGrid,
    Robot,
)
from dva_sim.validation.network.verdicts import OVERLOAD, PACKET_BYTES, is_bounded, load

Depth = Literal["auto", "message", "segment", "datagram"]
Played = Literal["message", "segment", "datagram"]

_PATIENCE_S = 120.0  # for a handshake; then nothing is ever sent
_UNLIMITED_BPS = 1e12
LATE_S = 0.0001
"""How late the emulated link lets a packet go, by its own account; half of them are later.

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
"""What a mechanism of TCP is left out by."""


def predict(
    condition: Condition, seed: int, depth: Depth = "auto", without: Sequence[str] = ()
) -> Measures:
    """What the model says of a condition: the columns of results of one run.

    Args:
        condition: What is set.
        seed: Of the link's luck.
        depth: `message`, `segment` or `datagram`; `auto` takes the cheapest that is exact.
        without: Mechanisms of TCP to leave out, by their names in `WITHOUT`.

    Raises:
        ConfigError: there is no such mechanism.
    """
    session = Session(condition, Streams(seed), depth_for(condition, depth), options(without))
    session.play()
    return measure_log(session.log, condition.warm_s, condition.dur_s)


def depth_for(condition: Condition, depth: Depth = "auto") -> Played:
    """How deep a condition is played.

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
    bursts = condition.burst_pkts
    config = LinkConfig(
        delay_s=condition.delay_ms / 1000.0 + LATE_S,
        jitter_s=condition.delay_ms * condition.jitter_frac / 1000.0,
        loss=condition.loss,
        bursts=None if bursts is None else Bursts(mean_packets=bursts),
        rate_bps=min(1000.0 * condition.rate_kbit, _UNLIMITED_BPS),
        queue_packets=condition.queue_pkts,
        reorder=condition.reorder,
    )
    up = make_link(config, "up", streams, "link/up")
    return up, make_link(config, "down", streams, "link/down")


class Session:
    """One run: two programs, a link, and as many connections as are opened.

    Args:
        condition: What is set.
        streams: The link's luck.
        depth: How deep the connections are played.
        tcp: Options of TCP at both ends beside those of the condition.

    Attributes:
        log: What happens.
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
        """See `Socket`: a publisher without subscriber, or at its mark, sends nothing.

        A request that is made during the handshake waits for its end.
        """
        if not self._ready:
            self._waiting = number if self._asks else None
        elif self._joined:
            self._connection.opener.send(number, self._size)

    def reopen(self) -> None:
        """See `Socket`."""
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
        """What is set on the operator's and on the robot's socket."""
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
