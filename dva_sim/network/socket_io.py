"""Reading from ZeroMQ sockets and sending to them without waiting, as cheaply as pyzmq can."""

from __future__ import annotations

from contextlib import suppress
from typing import Final

import zmq

from dva_sim.network.realtime import Socket, has_more

# As plain numbers: the arithmetic of pyzmq's enumerations costs more than a system call.
NOBLOCK: Final = int(zmq.NOBLOCK)
MORE: Final = int(zmq.NOBLOCK | zmq.SNDMORE)
MAX_PARTS: Final = 2000  # of a message; the route of a request through proxies is part of it
DROPPED_AT_ONCE: Final = 2000  # parts of a message that has too many
HEARD_AT_ONCE: Final = 256  # subscriptions: others may send them faster than they can be read

# Without what pyzmq adds to each call for other kinds of sockets.
recv: Final = zmq.backend.Socket.recv
send: Final = zmq.backend.Socket.send


def read_next(socket: Socket) -> list[bytes] | None:
    """Return the next message; None if all are read, or the last one closed the socket."""
    return None if socket.closed or not has_more(socket) else receive(socket)


def receive(socket: Socket) -> list[bytes] | None:
    """Return a message, if there is one: what a REQ socket had may be the copy of a reply."""
    try:
        parts, last = receive_parts(socket)
        if last.more:
            drop_rest(socket)
        return parts
    except zmq.Again:
        return None


def receive_parts(socket: Socket) -> tuple[list[bytes], zmq.Frame]:
    """Return a received message: its parts, and the last frame read, which names the sender's key.

    A frame says whether it is the last one at half the price of asking the socket, as
    `recv_multipart` does. Where it is not, the message has more parts than are read: see
    `drop_rest`. Raises `zmq.Again` if there is none.
    """
    frame = recv(socket, NOBLOCK, False)
    parts = [frame.bytes]
    while frame.more and len(parts) < MAX_PARTS:
        frame = recv(socket, NOBLOCK, False)
        parts.append(frame.bytes)
    return parts, frame


def drop_rest(socket: Socket) -> bool:
    """Drop further parts of a message, of which there may be millions: True if it is read."""
    return any(not recv(socket, NOBLOCK, False).more for _ in range(DROPPED_AT_ONCE))


def cut(socket: Socket) -> str:
    """Disconnect a socket from the endpoint that it connected to last, and return that one.

    A poll takes the first part of a publication out of its connection. One message is read
    before, as libzmq aborts the process when the other parts are gone by the next read.
    """
    last = socket.getsockopt(zmq.LAST_ENDPOINT)
    assert isinstance(last, bytes)
    endpoint = last.rstrip(b"\0").decode()
    if socket.getsockopt(zmq.TYPE) == zmq.SUB:
        receive(socket)
    with suppress(zmq.ZMQError):  # it may have been cut before
        if endpoint:
            socket.disconnect(endpoint)
    return endpoint


class PublisherSocket:
    """An XPUB socket and the topics of its subscribers."""

    def __init__(self, socket: Socket) -> None:
        self.socket = socket
        self._topics: set[str] = set()

    def wanted(self, topic: str) -> bool:
        """Return True if a topic has a subscriber."""
        self.hear()
        return any(topic.startswith(subscribed) for subscribed in self._topics)

    def hear(self) -> None:
        """Note subscriptions: XPUB reports the first and the last subscriber of a topic."""
        with suppress(zmq.Again):
            for _ in range(HEARD_AT_ONCE):
                if not has_more(self.socket):
                    return
                data = self.socket.recv(NOBLOCK)
                topic = data[1:].decode(errors="replace")
                if data[:1] == b"\x01" and len(self._topics) < 10_000:
                    self._topics.add(topic)
                elif data[:1] == b"\x00":
                    self._topics.discard(topic)
