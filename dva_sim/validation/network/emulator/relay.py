"""Where packets cannot be emulated: a relay of TCP over the loopback, with delay, jitter and rate.

It cannot lose a packet, because the kernel repeats what is lost before the relay would see it,
and TCP's own set-up and acknowledgements do not feel its delay. Each chunk that it reads counts
as one packet of the wire; when the wire's queue is full it reads no more, so that the sender is
held back as by a full send buffer.
"""

from __future__ import annotations

import heapq
import select
import socket
import time
from array import array
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field

from dva_sim.validation.network.emulator.wire import EmulatedWire, Told, tell

CHUNK_BYTES = 1448
_HEADERS_BYTES = 52
_LOOK_AGAIN_S = 0.001  # whether a full queue has room


@dataclass(eq=False)
class RelayedStream:
    """One direction of one connection.

    Attributes:
        source: Where bytes come from.
        sink: Where they go.
        wire: Decides when.
        waiting: Bytes that are due and not yet taken.
        open: More may come from the source.
        closing: Nothing more comes after what waits.
    """

    source: socket.socket
    sink: socket.socket
    wire: EmulatedWire
    waiting: bytearray = field(default_factory=bytearray)
    open: bool = True
    closing: bool = False

    def has_room(self, now: float) -> bool:
        """Whether more may be read."""
        room = self.wire.backlog(now) < self.wire.config.queue_pkts
        return self.open and not self.waiting and room

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


class Proxy:
    """Relays connections to the robot.

    Args:
        wires: From the operator to the robot, and back.
        target: Of the robot, such as `tcp://127.0.0.1:4000`.
    """

    def __init__(self, wires: tuple[EmulatedWire, EmulatedWire], target: str) -> None:
        host, _, port = target.removeprefix("tcp://").rpartition(":")
        self._target = (host, int(port))
        self._wires = wires
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._streams: list[RelayedStream] = []
        self._due: list[tuple[float, int, RelayedStream, bytes]] = []
        self._number = 0
        self._late = array("d")

    @property
    def address(self) -> str:
        """Where the operator connects."""
        return f"tcp://127.0.0.1:{self._listener.getsockname()[1]}"

    def run(self, watched: Sequence[int], deadline: float) -> int | None:
        """See `Forwarder.run`."""
        while (now := time.monotonic()) < deadline:
            self._release(now)
            until = min(deadline, self._due[0][0] if self._due else deadline)
            if any(stream.open and not stream.has_room(now) for stream in self._streams):
                until = min(until, now + _LOOK_AGAIN_S)
            pause = max(0.0, until - time.monotonic())
            sources = {s.source: s for s in self._streams if s.has_room(now)}
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

    def told(self) -> Told:
        """The columns of the emulator; chunks count as packets."""
        return tell(self._wires, self._late)

    def close(self) -> None:
        """Close everything."""
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
            RelayedStream(near, far, self._wires[0]),
            RelayedStream(far, near, self._wires[1]),
        ]

    def _take(self, stream: RelayedStream) -> None:
        """Read a chunk; an empty one is the end of the stream, and crosses the wire as well."""
        if not stream.has_room(time.monotonic()):
            return  # another stream of this direction has just filled the queue
        try:
            chunk = stream.source.recv(CHUNK_BYTES)
        except OSError:
            chunk = b""
        stream.open = bool(chunk)
        release = stream.wire.offer(time.monotonic(), len(chunk) + _HEADERS_BYTES)
        if release is not None:
            self._number += 1
            heapq.heappush(self._due, (release, self._number, stream, chunk))

    def _release(self, now: float) -> None:
        while self._due and self._due[0][0] <= now:
            release, _, stream, chunk = heapq.heappop(self._due)
            stream.waiting += chunk
            stream.closing = not chunk
            stream.flush()
            now = time.monotonic()
            self._late.append(now - release)
        self._forget_closed()

    def _forget_closed(self) -> None:
        """Close connections whose two streams have ended."""
        for stream in [s for s in self._streams if s.closing and not s.waiting]:
            back = next(s for s in self._streams if s.source is stream.sink)
            if back.closing or not back.open:
                for ended in (stream, back):
                    self._streams.remove(ended)
                    ended.source.close()
                return
