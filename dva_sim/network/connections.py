"""Single sockets: what each kind of ZeroMQ socket does for the patterns."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Final

import zmq

from dva_sim.network.connecting import ZeromqConfig
from dva_sim.network.patterns import OnReply
from dva_sim.network.security import Socket

if TYPE_CHECKING:
    from dva_sim.network.sockets import SocketNetwork

DRAIN: Final = 64  # messages read from one socket before others have their turn

# As plain numbers: the arithmetic of pyzmq's enumerations costs more than a system call.
NOBLOCK: Final = int(zmq.NOBLOCK)
MORE: Final = int(zmq.NOBLOCK | zmq.SNDMORE)
EVENTS: Final = int(zmq.EVENTS)
POLLIN: Final = int(zmq.POLLIN)


def options_of(zeromq: ZeromqConfig) -> dict[int, int]:
    """Socket options by number; what the kernel is to choose is left out."""
    options = {
        zmq.SNDHWM: zeromq.high_water_mark,
        zmq.RCVHWM: zeromq.high_water_mark,
        zmq.SNDBUF: zeromq.send_buffer_bytes,
        zmq.RCVBUF: zeromq.receive_buffer_bytes,
    }
    return {int(option): value for option, value in options.items() if value is not None}


def has_more(socket: Socket) -> bool:
    """Whether something can be read: asking costs a third of trying in vain."""
    return bool(socket.getsockopt(EVENTS) & POLLIN)  # type: ignore[operator]


def next_of(socket: Socket) -> list[bytes] | None:
    """The next message; None if all are read, or the last one has led to closing the socket."""
    return None if socket.closed or not has_more(socket) else receive(socket)


def receive(socket: Socket) -> list[bytes] | None:
    """A message, if there is one: what a REQ socket had may be the copy of a reply."""
    try:
        return socket.recv_multipart(NOBLOCK)
    except zmq.Again:
        return None


class PublisherSocket:
    """An XPUB socket, and what its subscribers want."""

    def __init__(self, socket: Socket) -> None:
        self.socket = socket
        self._topics: set[str] = set()

    def wanted(self, topic: str) -> bool:
        """Whether anybody has subscribed to a topic."""
        self.hear()
        return any(topic.startswith(known) for known in self._topics)

    def hear(self) -> None:
        """Who came or went: XPUB tells of the first subscriber and of the last for a topic."""
        with suppress(zmq.Again):
            while has_more(self.socket):
                said = self.socket.recv(NOBLOCK)
                topic = said[1:].decode(errors="replace")
                if said[:1] == b"\x01" and len(self._topics) < 10_000:
                    self._topics.add(topic)
                elif said[:1] == b"\x00":
                    self._topics.discard(topic)


class SocketWire:
    """One connection to the service of a peer, as far as REQ and DEALER agree."""

    kind: int

    def __init__(self, network: SocketNetwork, node: str, peer: str, on_reply: OnReply) -> None:
        self._network, self._on_reply = network, on_reply
        self._socket = network.client(self.kind, node, peer)
        self._configure()
        network.clock.watch(self._socket, self._replies)

    def _configure(self) -> None:
        """Set the options of this kind of socket."""

    def send(self, tag: int, data: bytes) -> None:
        """See `Wire`."""
        raise NotImplementedError

    def close(self) -> None:
        """See `Wire`."""
        self._network.close_client(self._socket)

    def _replies(self) -> None:
        for _ in range(DRAIN):
            frames = next_of(self._socket)
            if frames is None:
                return
            self._reply(frames)

    def _reply(self, frames: list[bytes]) -> None:
        raise NotImplementedError


class ReqWire(SocketWire):
    """A REQ socket: libzmq itself keeps requests and replies in step."""

    kind = zmq.REQ

    def _configure(self) -> None:
        # A doubled reply must not be taken for the answer to the next request.
        self._socket.setsockopt(zmq.REQ_CORRELATE, 1)
        self._tag = 0

    def send(self, tag: int, data: bytes) -> None:
        """See `Wire`; the last one sent must have been answered."""
        self._tag = tag
        self._network.send(self._socket, [data])

    def _replies(self) -> None:
        """There is one at most: asking whether there are more would delay every command."""
        frames = receive(self._socket)
        if frames is not None:
            self._reply(frames)

    def _reply(self, frames: list[bytes]) -> None:
        if len(frames) == 1:
            self._on_reply(self._tag, frames[0])


class DealerWire(SocketWire):
    """A DEALER socket: the tag travels in front of the request, and comes back."""

    kind = zmq.DEALER

    def send(self, tag: int, data: bytes) -> None:
        """See `Wire`."""
        self._network.send(self._socket, [tag.to_bytes(8, "big"), b"", data])

    def _reply(self, frames: list[bytes]) -> None:
        if len(frames) == 3 and len(frames[0]) == 8 and not frames[1]:
            self._on_reply(int.from_bytes(frames[0], "big"), frames[2])


class SocketSubscription:
    """A SUB socket; see `Subscription`."""

    def __init__(
        self,
        network: SocketNetwork,
        node: str,
        publisher: str,
        topic: str,
        handler: Callable[[Any], object],
    ) -> None:
        self._network, self._handler = network, handler
        self._socket = network.client(zmq.SUB, node, publisher)
        self._socket.subscribe(topic)
        self._paused = False
        network.clock.watch(self._socket, self._hear)

    def close(self) -> None:
        """See `Subscription`."""
        self._network.close_client(self._socket)

    def pause(self) -> None:
        """See `Subscription`: what is not read waits in the socket."""
        self._paused = True
        self._network.clock.unwatch(self._socket)

    def resume(self) -> None:
        """See `Subscription`."""
        if self._paused and not self._socket.closed:
            self._paused = False
            self._network.clock.watch(self._socket, self._hear)

    def _hear(self) -> None:
        for _ in range(DRAIN):
            frames = None if self._paused else next_of(self._socket)
            if frames is None:
                return
            if len(frames) == 2:
                self._handler(frames[1])
            else:
                self._network.counters["publications of another form"] += 1
