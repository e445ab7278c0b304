"""Plays a condition with the components of every run: network, requester and queue.

Both programs are those that are measured (`dva_sim.network.workload`); the robot's takes one
command at a time from its queue. A run ends with the last command: as soon as the next one would
lie beyond the window, and a requester whose reply is still missing when the window ends.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Literal

from dva_sim.agents.robot.command_queue import CommandQueue, Letter
from dva_sim.kernel.clock import Clock
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.streams import Streams
from dva_sim.kernel.suggestions import unknown
from dva_sim.network.connections import Connector, Load, ZeromqConfig, is_calm
from dva_sim.network.link import Link, make_link
from dva_sim.network.pattern_runs import (
    COMMAND_BYTES,
    REPLY_BYTES,
    Condition,
    Measures,
    RunLog,
    make_operator,
    measure_log,
)
from dva_sim.network.tcp import TcpOptions
from dva_sim.network.virtual_network import FRAMING, VirtualNetwork
from dva_sim.network.workload import (
    OPERATOR,
    ROBOT,
    UNBOUNDED,
    Note,
    NoteKind,
    NumberedBytes,
    RobotWorkload,
)
from dva_sim.network.zmtp import framed
from dva_sim.validation.network.verdicts import OVERLOAD, PACKET_BYTES, is_bounded, load

PUBLISHED = NumberedBytes(framed(COMMAND_BYTES) - FRAMING - 2, 0)
REQUESTED = NumberedBytes(
    *(framed(0) + framed(size) - FRAMING for size in (COMMAND_BYTES, REPLY_BYTES))
)
"""Messages that are as long on the wire as the measured ones; requests have an empty frame."""

CONFLATES: dict[str, Literal["none", "publisher", "subscriber", "both"]] = {
    "none": "none",
    "op": "publisher",
    "rob": "subscriber",
    "both": "both",
}
NEVER_EARLY_S = 1e-6
"""Work takes at least what it should: this decides which comes first, where its end and the
next arrival would fall on the same moment."""

Depth = Literal["auto", "message", "segment", "datagram"]
Played = Literal["message", "segment", "datagram"]

_PATIENCE_S = 120.0  # maximum duration of a handshake; without it nothing is sent [s]
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
    return measure_log(run.play(), condition.warm_s, condition.dur_s)


def depth_for(condition: Condition, depth: Depth = "auto") -> Played:
    """Return the depth at which a condition is simulated.

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
    """Return TCP's options at both ends, with some mechanisms left out.

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
    """Return the emulated link from the operator to the robot, and the one back."""
    config = condition.link(LATE_S)
    up = make_link(config, "up", streams, "link/up")
    return up, make_link(config, "down", streams, "link/down")


class PredictedRun:
    """A predicted run of the operator's program, a virtual network, and a robot's queue.

    Args:
        streams: Random streams of the link.
        depth: Depth of the simulated connections.
        without: Mechanisms of TCP to leave out.
    """

    def __init__(
        self, condition: Condition, streams: Streams, depth: Played, without: Sequence[str]
    ) -> None:
        self._condition = condition
        self._notes: list[Note] = []
        self._is_open = self._is_begun = False
        self._clock = Clock()
        up, down = make_links(condition, streams)
        self._network = VirtualNetwork(
            self._clock,
            lambda source, to: (up, down) if source == OPERATOR else (down, up),
            connector=_connector(condition, depth, without),
        )
        self._network.on_open = self._opened
        service = condition.proc_ms / 1000.0 + NEVER_EARLY_S
        published = condition.pattern == "pub-sub"
        form = PUBLISHED if published else REQUESTED
        self._robot = RobotWorkload(form, self._note)
        self._queue = CommandQueue(
            self._clock,
            lambda: service,
            self._serve,
            latest_wins=condition.conflate in ("rob", "both"),
            limit=condition.hwm if published else UNBOUNDED,
        )
        self._network.serve(ROBOT, self._queue.request)
        if published:
            # The operator connects: who answers is there when its first packet has arrived.
            self._clock.call_at(condition.delay_ms / 1000.0, self._subscribe)
        self._note(NoteKind.OPENED, 0)
        self._operator = make_operator(condition, self._network, form, self._note)

    def play(self) -> RunLog:
        """Run until the operator's program has ended; return the log."""
        if not self._condition.wait_hs:
            self._begin()
        while self._operator.ended is None and (self._is_begun or self._clock.now < _PATIENCE_S):
            self._clock.run(self._clock.now + 1.0)
        ended = self._operator.ended or 0.0
        return RunLog.of(note for note in self._notes if note.time <= ended)

    def _note(self, kind: NoteKind, number: int, at: float | None = None) -> None:
        self._notes.append(Note(kind, number, self._clock.now if at is None else at))

    def _opened(self, node: str, peer: str) -> None:
        """Take a connection: after the first the operator's program starts, a publisher later."""
        if self._is_open:
            return
        self._is_open = True
        condition = self._condition
        late = condition.delay_ms / 1000.0 if node == ROBOT else 0.0
        ready = self._clock.now - late
        self._note(NoteKind.READY, 0, ready)
        if condition.wait_hs:
            self._clock.call_at(ready + condition.subscription_wait_s, self._begin)

    def _begin(self) -> None:
        self._is_begun = True
        self._operator.start(self._clock.now + self._condition.warm_s + self._condition.dur_s)

    def _subscribe(self) -> None:
        self._queue.flow = self._network.subscribe(ROBOT, OPERATOR, "", self._queue.published)

    def _serve(self, letter: Letter) -> None:
        reply = self._robot.obey(letter.data)
        if letter.answer is not None and reply is not None:
            letter.answer(reply)


def _connector(condition: Condition, depth: Played, without: Sequence[str]) -> Connector:
    """Return connections with the options of the condition's sockets."""
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
