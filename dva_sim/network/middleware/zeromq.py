"""ZeroMQ, each pattern as its sockets have it: commands in single frames, no topic."""

from __future__ import annotations

import time
from collections import deque
from contextlib import suppress
from typing import Final, Literal

import zmq
from typing_extensions import override

from dva_sim.kernel.errors import ConfigError
from dva_sim.network.messaging import OnReply, Requester, Wire
from dva_sim.network.middleware.ends import (
    CommandTransport,
    Receive,
    Rendezvous,
    TransportEnd,
    TransportError,
    connected,
)
from dva_sim.network.realtime import LiveClock, ProgramClock, Socket
from dva_sim.network.workload import OPERATOR, ROBOT, UNBOUNDED

HIGH_WATER_MARK: Final = 1000  # ZeroMQ's default [messages]
Pattern = Literal["req-rep", "pub-sub", "conflate"]
_SOCKETS: Final = {
    "req-rep": (zmq.REQ, zmq.REP),
    "pub-sub": (zmq.PUB, zmq.SUB),
    "conflate": (zmq.PUB, zmq.SUB),
}


def plain_socket(
    context: zmq.Context[Socket], kind: int, high_water_mark: int, conflates: bool
) -> Socket:
    """Return a socket for single frames without a topic, which forgets them when it is closed.

    Args:
        high_water_mark: Messages that may wait at this end.
        conflates: True to keep only the newest.
    """
    socket = context.socket(kind)
    socket.linger = 0
    socket.sndhwm = socket.rcvhwm = high_water_mark
    if conflates:
        socket.conflate = True
    if kind == zmq.SUB:
        socket.subscribe(b"")
    return socket


class PlainWire(Wire):
    """A connected REQ or DEALER socket, whose replies come in the order of its requests.

    Args:
        clock: Waits for the replies.
        socket: The socket.
        on_reply: Callback for the tag and the bytes of each reply.
    """

    def __init__(self, clock: LiveClock, socket: Socket, on_reply: OnReply) -> None:
        self._clock = clock
        self._socket = socket
        self._on_reply = on_reply
        self._tags: deque[int] = deque()
        clock.watch(socket, self._hear)

    @override
    def send(self, tag: int, data: bytes) -> None:
        with suppress(zmq.Again):  # without room the request is gone
            self._socket.send(data, zmq.NOBLOCK)
            self._tags.append(tag)
        self._clock.look(self._socket)

    @override
    def close(self) -> None:
        self._clock.unwatch(self._socket)
        self._socket.close(0)

    def _hear(self) -> None:
        self._on_reply(self._tags.popleft(), self._socket.recv())


class ZeroMqTransport(CommandTransport):
    """ZeroMQ over TCP.

    Args:
        pattern: `req-rep`: the next command goes when the last one was answered. `pub-sub`:
            commands queue. `conflate`: of those that wait at either end only the newest is kept.
        timeout_s: After so long without an answer a request is made over a new connection [s].
        high_water_mark: Messages that may wait at each end, unless the newest alone is kept.
    """

    title = "ZeroMQ"

    def __init__(
        self,
        pattern: Pattern = "pub-sub",
        timeout_s: float = 1.0,
        high_water_mark: int = HIGH_WATER_MARK,
    ) -> None:
        if pattern not in _SOCKETS:
            raise ConfigError(f"pattern {pattern!r} should be one of {', '.join(_SOCKETS)}")
        self.pattern = pattern
        self.timeout_s = timeout_s
        self.high_water_mark = high_water_mark

    @override
    def near(self, place: Rendezvous, receive: Receive) -> TransportEnd:
        kind = _Requests if self.pattern == "req-rep" else _Sockets
        end = kind(self, place, receive, is_near=True)
        return connected(end, lambda: end.await_robot(place.ready_by))

    @override
    def far(self, place: Rendezvous, receive: Receive) -> TransportEnd:
        return _Sockets(self, place, receive, is_near=False)

    def opened(self, context: zmq.Context[Socket], kind: int) -> Socket:
        """Return a socket with these options."""
        conflates = self.pattern == "conflate" and kind in (zmq.PUB, zmq.SUB)
        return plain_socket(context, kind, self.high_water_mark, conflates)


class _Sockets(TransportEnd):
    """A socket for commands, and one on the next port for pictures."""

    def __init__(
        self, options: ZeroMqTransport, place: Rendezvous, receive: Receive, is_near: bool
    ) -> None:
        self.options = options
        self._receive = receive
        self.clock = ProgramClock()
        self.context = zmq.Context[Socket]()
        self.commands_at = f"tcp://{place.far}:{place.port}"
        pictures_at = f"tcp://{place.far}:{place.port + 1}"
        near, far = _SOCKETS[options.pattern]
        self.commands = options.opened(self.context, near if is_near else far)
        self.pictures = options.opened(self.context, zmq.SUB if is_near else zmq.PUB)
        if is_near:
            self.pictures.connect(pictures_at)
        else:
            self.commands.bind(self.commands_at)
            self.pictures.bind(pictures_at)
        heard = self.pictures if is_near else self.commands
        self.clock.watch(heard, lambda: self._hear(heard))
        self._sends = self.commands if is_near else self.pictures

    def await_robot(self, ready_by: float) -> None:
        """Wait until the connection stands; a subscription takes a moment longer."""
        events = self.commands.get_monitor_socket(zmq.EVENT_HANDSHAKE_SUCCEEDED)
        self.commands.connect(self.commands_at)
        is_open = events.poll(max(0, int(1000 * (ready_by - time.monotonic()))))
        self.commands.disable_monitor()
        events.close(0)  # the context waits for it
        if not is_open:
            raise TransportError("the robot does not answer")

    @override
    def send(self, data: bytes) -> bool:
        try:
            self._sends.send(data, zmq.NOBLOCK)
        except zmq.Again:
            return False
        return True

    @override
    def serve(self, until: float) -> None:
        self.clock.run(until)

    def _hear(self, socket: Socket) -> None:
        reply = self._receive(socket.recv())
        if socket.type == zmq.REP:
            socket.send(reply or b"")

    @override
    def close(self) -> None:
        self.context.destroy(0)


class _Requests(_Sockets):
    """The operator's end, where one command is under way at a time."""

    def __init__(
        self, options: ZeroMqTransport, place: Rendezvous, receive: Receive, is_near: bool
    ) -> None:
        super().__init__(options, place, receive, is_near)
        self._requester = Requester(self, OPERATOR, ROBOT, options.timeout_s, UNBOUNDED)

    def connect(self, node: str, peer: str, on_reply: OnReply, pipelined: bool) -> PlainWire:
        """Open a connection; after a time-out over a new socket, as REQ cannot otherwise."""
        if self.commands.closed:
            self.commands = self.options.opened(self.context, zmq.REQ)
            self.commands.connect(self.commands_at)
        return PlainWire(self.clock, self.commands, on_reply)

    @override
    def send(self, data: bytes) -> bool:
        self.clock.run(time.monotonic())
        if self._requester.busy:
            return False
        self._requester.request(data, lambda _: self.clock.stop())  # it can send again
        return True
