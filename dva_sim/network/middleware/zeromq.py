"""ZeroMQ, each pattern as its sockets have it: commands in single frames, no topic."""

from __future__ import annotations

import math
import time
from typing import Final, Literal

import zmq
from typing_extensions import override

from dva_sim.kernel.errors import ConfigError
from dva_sim.network.middleware.ends import (
    CommandTransport,
    Receive,
    Rendezvous,
    TransportEnd,
    TransportError,
    connected,
)

HIGH_WATER_MARK: Final = 1000  # ZeroMQ's own [messages]
Pattern = Literal["req-rep", "pub-sub", "conflate"]
_SOCKETS: Final = {
    "req-rep": (zmq.REQ, zmq.REP),
    "pub-sub": (zmq.PUB, zmq.SUB),
    "conflate": (zmq.PUB, zmq.SUB),
}
_Socket = zmq.Socket[bytes]


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
        return connected(end, lambda: end.connect(place.ready_by))

    @override
    def far(self, place: Rendezvous, receive: Receive) -> TransportEnd:
        return _Sockets(self, place, receive, is_near=False)

    def opened(self, context: zmq.Context[_Socket], kind: int) -> _Socket:
        """A socket with these options."""
        socket = context.socket(kind)
        socket.linger = 0
        socket.sndhwm = socket.rcvhwm = self.high_water_mark
        if self.pattern == "conflate" and kind in (zmq.PUB, zmq.SUB):
            socket.conflate = True
        if kind == zmq.SUB:
            socket.subscribe(b"")
        return socket


class _Sockets(TransportEnd):
    """A socket for commands, and one on the next port for pictures."""

    def __init__(
        self, options: ZeroMqTransport, place: Rendezvous, receive: Receive, is_near: bool
    ) -> None:
        self._options = options
        self._receive = receive
        self._context = zmq.Context[_Socket]()
        self._commands_at = f"tcp://{place.far}:{place.port}"
        pictures_at = f"tcp://{place.far}:{place.port + 1}"
        near, far = _SOCKETS[options.pattern]
        self._poller = zmq.Poller()
        self.commands = options.opened(self._context, near if is_near else far)
        self.pictures = options.opened(self._context, zmq.SUB if is_near else zmq.PUB)
        if is_near:
            self.pictures.connect(pictures_at)
        else:
            self.commands.bind(self._commands_at)
            self.pictures.bind(pictures_at)
        self._poller.register(self.pictures if is_near else self.commands, zmq.POLLIN)
        self._is_near = is_near

    def connect(self, ready_by: float) -> None:
        """Wait until the connection stands; a subscription takes a moment longer."""
        events = self.commands.get_monitor_socket(zmq.EVENT_HANDSHAKE_SUCCEEDED)
        self.commands.connect(self._commands_at)
        is_open = events.poll(max(0, int(1000 * (ready_by - time.monotonic()))))
        self.commands.disable_monitor()
        events.close(0)  # the context waits for it
        if not is_open:
            raise TransportError("the robot does not answer")

    @override
    def send(self, data: bytes) -> bool:
        try:
            (self.commands if self._is_near else self.pictures).send(data, zmq.NOBLOCK)
        except zmq.Again:
            return False
        return True

    @override
    def serve(self, until: float) -> None:
        while (left := until - time.monotonic()) > 0:
            if left < 0.001:
                time.sleep(left)  # polling counts whole milliseconds
                return
            heard = [self._hear(socket) for socket, _ in self._poller.poll(int(1000 * left))]
            if any(heard):
                return

    def _hear(self, socket: _Socket) -> bool:
        """Read a message; whether it was the answer to a command."""
        reply = self._receive(socket.recv())
        if socket.type == zmq.REP:
            socket.send(reply or b"")
        return False

    @override
    def close(self) -> None:
        for socket in (self.commands, self.pictures):
            socket.close(0)
        self._context.term()


class _Requests(_Sockets):
    """The operator's end, where one command is under way at a time."""

    def __init__(
        self, options: ZeroMqTransport, place: Rendezvous, receive: Receive, is_near: bool
    ) -> None:
        super().__init__(options, place, receive, is_near)
        self._poller.register(self.commands, zmq.POLLIN)
        self._sent_at = -math.inf  # of the command that is under way [s]
        self._data = b""

    @override
    def send(self, data: bytes) -> bool:
        if self._is_busy() or not super().send(data):
            return False
        self._sent_at = time.monotonic()
        self._data = data
        return True

    @override
    def serve(self, until: float) -> None:
        while self._is_busy() and (now := time.monotonic()) < until:
            late = self._sent_at + self._options.timeout_s
            if now >= late:
                self._ask_again()
            super().serve(min(until, late))
            if not self._is_busy():
                return
        super().serve(until)

    def _is_busy(self) -> bool:
        return self._sent_at > -math.inf

    def _hear(self, socket: _Socket) -> bool:
        if socket is not self.commands:
            return super()._hear(socket)
        socket.recv()
        self._sent_at = -math.inf
        return True

    def _ask_again(self) -> None:
        """Send the same command over a new connection, as a REQ socket cannot otherwise."""
        self._poller.unregister(self.commands)
        self.commands.close(0)
        self.commands = self._options.opened(self._context, zmq.REQ)
        self.commands.connect(self._commands_at)
        self._poller.register(self.commands, zmq.POLLIN)
        self.commands.send(self._data)
        self._sent_at = time.monotonic()
