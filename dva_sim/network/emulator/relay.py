"""A relay of TCP over the loopback, in place of emulated packets where namespaces are forbidden.

It has delay, jitter and rate. It cannot lose a packet, because the kernel repeats what is lost
before the relay would see it, and TCP's own set-up and acknowledgements do not feel its delay. Each
chunk that it reads counts as one packet of the link; when the link's queue is full it reads no
more, so that the sender is held back as by a full send buffer.
"""

from __future__ import annotations

import select
import socket
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field

from typing_extensions import override

from dva_sim.network.emulator.forwarder import EmulatedLink, Links
from dva_sim.network.emulator.report import LinkFlow

CHUNK_BYTES = 1448
_HEADERS_BYTES = 52
_LOOK_AGAIN_S = 0.001  # interval of checks whether a full queue has room


@dataclass(eq=False)
class RelayedStream:
    """One direction of one connection.

    Attributes:
        source: Socket that bytes come from.
        sink: Socket that bytes go to.
        flow: Its link decides when.
        waiting: Bytes that are due and not yet taken.
        open: More may come from the source.
        closing: Nothing more comes after what waits.
    """

    source: socket.socket
    sink: socket.socket
    flow: LinkFlow
    waiting: bytearray = field(default_factory=bytearray)
    open: bool = True
    closing: bool = False

    def has_room(self, now: float) -> bool:
        """Return True if more may be read at a time of the link [s]."""
        if not self.open or self.waiting:
            return False
        return self.flow.link.has_room(now, CHUNK_BYTES + _HEADERS_BYTES)

    def flush(self) -> None:
        """Hand on what is due, and the end of the stream after it."""
        try:
            with suppress(BlockingIOError):
                while self.waiting:
                    del self.waiting[: self.sink.send(self.waiting)]
            if self.closing and not self.waiting:
                self.sink.shutdown(socket.SHUT_WR)
        except OSError:  # the other end has closed: nothing of this stream is wanted any more
            self.waiting.clear()
            self.open = False


class Proxy(EmulatedLink[RelayedStream]):
    """Relays connections to the robot.

    Args:
        links: From the operator to the robot, and back.
        target: Address of the robot, such as `tcp://127.0.0.1:4000`.
    """

    def __init__(self, links: Links, target: str) -> None:
        super().__init__(links)
        host, _, port = target.removeprefix("tcp://").rpartition(":")
        self._target = (host, int(port))
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._streams: list[RelayedStream] = []

    @property
    def address(self) -> str:
        """Address to which the operator connects."""
        return f"tcp://127.0.0.1:{self._listener.getsockname()[1]}"

    @override
    def run(self, watched: Sequence[int], deadline: float) -> int | None:
        while (now := time.monotonic()) < deadline:
            until = self._release(now, deadline)
            self._forget_closed()
            if any(stream.open and not stream.has_room(self._time) for stream in self._streams):
                until = min(until, now + _LOOK_AGAIN_S)
            pause = max(0.0, until - time.monotonic())
            sources = {s.source: s for s in self._streams if s.has_room(self._time)}
            sinks = {s.sink: s for s in self._streams if s.waiting}
            files: list[socket.socket | int] = [self._listener, *sources, *watched]
            readable, writable, _ = select.select(files, list(sinks), [], pause)
            for sink in writable:
                sinks[sink].flush()
            for file in readable:
                if isinstance(file, int):
                    return file
                if file is self._listener:
                    self._accept()
                else:
                    self._take(sources[file])
        return None

    @override
    def close(self) -> None:
        self._listener.close()
        for stream in self._streams:
            stream.source.close()

    def _accept(self) -> None:
        near, _ = self._listener.accept()
        far = socket.create_connection(self._target)
        for end in (near, far):
            end.setblocking(False)
            end.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._streams += [
            RelayedStream(near, far, self._flows[0]),
            RelayedStream(far, near, self._flows[1]),
        ]

    def _take(self, stream: RelayedStream) -> None:
        """Read a chunk; an empty one is the end of the stream, and crosses the wire as well."""
        if not stream.has_room(self._time):
            return  # another stream of this direction has just filled the queue
        try:
            chunk = stream.source.recv(CHUNK_BYTES)
        except OSError:
            chunk = b""
        stream.open = bool(chunk)
        self._offer(stream.flow, len(chunk) + _HEADERS_BYTES, stream, chunk)

    def _put(self, out: RelayedStream, data: bytes) -> None:
        out.waiting += data
        out.closing = not data
        out.flush()

    def _forget_closed(self) -> None:
        """Close connections whose two streams have ended."""
        for stream in [s for s in self._streams if s.closing and not s.waiting]:
            back = next(s for s in self._streams if s.source is stream.sink)
            if back.closing or not back.open:
                for ended in (stream, back):
                    self._streams.remove(ended)
                    ended.source.close()
                return
