"""The emulated link: when a packet that is offered now comes out, and what moves it then.

A wire is one direction: drop-tail queue, serialisation at the rate, loss, delay with jitter, in
this order. It knows no device and no clock: the forwarder asks it with real packets, and moves them
between the two TUN devices when it says, noting how late it is; tests ask it with scripted ones.

Where packets cannot be emulated a relay of TCP over the loopback takes the forwarder's place, with
delay, jitter and rate. It cannot lose a packet, because the kernel repeats what is lost before the
relay would see it, and TCP's own set-up and acknowledgements do not feel its delay. Each chunk that
it reads counts as one packet of the wire; when the wire's queue is full it reads no more, so that
the sender is held back as by a full send buffer.
"""

from __future__ import annotations

import heapq
import math
import os
import select
import socket
import time
from abc import ABC, abstractmethod
from array import array
from collections import deque
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Generic, TypeVar

import numpy as np
from numpy.random import Generator

from dva_sim.kernel.streams import Streams
from dva_sim.network.pattern_runs import Condition

_BLOCK = 4096


@dataclass(frozen=True)
class WireConfig:
    """What one direction does to packets.

    Attributes:
        delay_s: Propagation delay [s].
        jitter_s: Half-width of a uniform law around the delay [s].
        loss: Share of the packets lost in the long run.
        burst_pkts: Mean length of a run of lost packets (Gilbert-Elliott: all is lost in the
            bad state, nothing in the good one); None is independent losses.
        rate_bps: Serialisation rate [bit/s].
        queue_pkts: Packets that find room, with the one that is being sent.
        reorder: A packet may come out before an earlier one.

    References:
        Gilbert, "Capacity of a burst-noise channel", Bell System Technical Journal 39 (1960).
    """

    delay_s: float = 0.0
    jitter_s: float = 0.0
    loss: float = 0.0
    burst_pkts: float | None = None
    rate_bps: float = math.inf
    queue_pkts: int = 100
    reorder: bool = False

    @classmethod
    def of(cls, condition: Condition) -> WireConfig:
        """What a condition sets; both directions are alike."""
        delay_s = 1e-3 * condition.delay_ms
        return cls(
            delay_s=delay_s,
            jitter_s=condition.jitter_frac * delay_s,
            loss=condition.loss,
            burst_pkts=condition.burst_pkts,
            rate_bps=1e3 * condition.rate_kbit,
            queue_pkts=condition.queue_pkts,
            reorder=condition.reorder,
        )


@dataclass
class Counts:
    """What became of the packets.

    Attributes:
        offered: All of them.
        lost: By chance.
        tail: Because the queue was full.
    """

    offered: int = 0
    lost: int = 0
    tail: int = 0


class EmulatedWire:
    """One direction.

    Args:
        config: What it does.
        streams: All luck of the run.
        name: Of this direction, for its luck: losses and jitter have a stream each.
    """

    def __init__(self, config: WireConfig, streams: Streams, name: str) -> None:
        self.config = config
        self.counts = Counts()
        self._loss = Losses(config.loss, config.burst_pkts, streams[f"emulator/{name}/loss"])
        self._jitter = UniformDraws(streams[f"emulator/{name}/jitter"])
        self._departures: deque[float] = deque()  # of what is in the queue
        self._last_release = -math.inf

    def offer(self, now: float, size: int) -> float | None:
        """When a packet of `size` bytes [B] offered at `now` comes out [s]; None is never."""
        self.counts.offered += 1
        queue = self._departures
        while queue and queue[0] <= now:
            queue.popleft()
        if len(queue) >= self.config.queue_pkts:
            self.counts.tail += 1
            return None
        departure = (queue[-1] if queue else now) + 8 * size / self.config.rate_bps
        queue.append(departure)
        if self._loss.takes_next():
            self.counts.lost += 1
            return None
        return self._release(departure)

    def backlog(self, now: float) -> int:
        """Packets in the queue at `now`, with the one that is being sent."""
        return sum(departure > now for departure in self._departures)

    def _release(self, departure: float) -> float:
        config = self.config
        release = departure + config.delay_s + config.jitter_s * (2 * self._jitter.draw() - 1)
        if not config.reorder:
            release = max(release, self._last_release)
        self._last_release = release
        return release


class UniformDraws:
    """Numbers between 0 and 1, drawn in blocks."""

    def __init__(self, rng: Generator) -> None:
        self._rng = rng
        self._ahead: list[float] = []

    def draw(self) -> float:
        """The next one."""
        if not self._ahead:
            self._ahead = self._rng.random(_BLOCK).tolist()[::-1]
        return self._ahead.pop()


@dataclass
class Losses:
    """Which packets are lost: each by itself, or in runs.

    Attributes:
        share: Lost in the long run.
        burst: Mean length of a run [packets]; None is each packet by itself.
        rng: Luck: one number per packet.
    """

    share: float
    burst: float | None
    rng: Generator
    _bad: bool = field(default=False, init=False)

    def __post_init__(self) -> None:
        self._luck = UniformDraws(self.rng)
        if self.burst is not None:
            self._leave = 1 / self.burst
            self._enter = self.share * self._leave / (1 - self.share)

    def takes_next(self) -> bool:
        """Whether the next packet is lost."""
        luck = self._luck.draw()
        if self.burst is None:
            return luck < self.share
        self._bad = luck >= self._leave if self._bad else luck < self._enter
        return self._bad


FORWARDER_PRIORITY = 20  # real-time, above the programs'
_LARGEST = 65_536
_MOST_AT_ONCE = 32  # packets of one device before what is due is looked at again
_VERSION_4 = 4

Told = dict[str, float | int]
T = TypeVar("T")


class EmulatedLink(ABC, Generic[T]):
    """What joins both ends while they run: what is on its way, and comes out when it is due.

    Args:
        wires: From the operator to the robot, and back.
    """

    def __init__(self, wires: tuple[EmulatedWire, EmulatedWire]) -> None:
        self._wires = wires
        self._due: list[tuple[float, int, T, bytes]] = []
        self._number = 0
        self._late = array("d")

    @abstractmethod
    def run(self, watched: Sequence[int], deadline: float) -> int | None:
        """Forward until one of the watched file descriptors has something to say.

        Returns:
            That one; None when the deadline has passed.
        """

    @abstractmethod
    def close(self) -> None:
        """Let go of devices and sockets."""

    @abstractmethod
    def _put(self, out: T, data: bytes) -> None:
        """Hand on what is due."""

    def told(self) -> Told:
        """The columns of the emulator; chunks of a relay count as packets."""
        return tell(self._wires, self._late)

    def _offer(self, wire: EmulatedWire, size: int, out: T, data: bytes) -> None:
        """Let a wire of the link decide when something of so many bytes comes out, if at all."""
        release = wire.offer(time.monotonic(), size)
        if release is not None:
            self._number += 1
            heapq.heappush(self._due, (release, self._number, out, data))

    def _release(self, now: float, deadline: float) -> float:
        """Hand on everything that is due; when there is something to do next [s]."""
        while self._due and self._due[0][0] <= now:
            release, _, out, data = heapq.heappop(self._due)
            self._put(out, data)
            now = time.monotonic()
            self._late.append(now - release)
        return min(deadline, self._due[0][0]) if self._due else deadline


class Forwarder(EmulatedLink[int]):
    """Both directions of an emulated link.

    Args:
        tuns: Devices of the operator's and of the robot's namespace.
        wires: From the operator to the robot, and back.
    """

    def __init__(self, tuns: tuple[int, int], wires: tuple[EmulatedWire, EmulatedWire]) -> None:
        super().__init__(wires)
        self._ways = {tuns[0]: (wires[0], tuns[1]), tuns[1]: (wires[1], tuns[0])}

    def run(self, watched: Sequence[int], deadline: float) -> int | None:
        """See `EmulatedLink`."""
        tuns = list(self._ways)
        while (now := time.monotonic()) < deadline:
            until = self._release(now, deadline)
            pause = max(0.0, until - time.monotonic())
            ready = select.select([*tuns, *watched], [], [], pause)[0]
            for file in ready:
                if file not in self._ways:
                    return int(file)
                self._take(file)
        return None

    def close(self) -> None:
        """See `EmulatedLink`."""
        for tun in self._ways:
            os.close(tun)

    def _take(self, tun: int) -> None:
        """Offer what waits in a device to its wire; what is not IPv4 is not forwarded."""
        wire, out = self._ways[tun]
        with suppress(OSError):  # nothing waits, or the namespace has just ended
            for _ in range(_MOST_AT_ONCE):
                packet = os.read(tun, _LARGEST)
                if not packet or packet[0] >> 4 != _VERSION_4:
                    continue
                self._offer(wire, len(packet), out, packet)

    def _put(self, out: int, data: bytes) -> None:
        with suppress(OSError):  # a namespace that has just ended takes nothing more
            os.write(out, data)


def tell(wires: tuple[EmulatedWire, EmulatedWire], late: Sequence[float]) -> Told:
    """The columns of the emulator from counts and from the lateness of releases [s]."""
    told: Told = {}
    for way, wire in zip(("ab", "ba"), wires, strict=True):
        counts = wire.counts
        told[f"emu_pkts_{way}"] = counts.offered
        told[f"emu_lost_{way}"] = counts.lost
        told[f"emu_tail_{way}"] = counts.tail
    shares = np.percentile(late, (50, 99, 100)) if len(late) else (np.nan,) * 3
    for name, value in zip(("p50", "p99", "max"), shares, strict=True):
        told[f"emu_late_{name}_ms"] = 1e3 * float(value)
    return told


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


class Proxy(EmulatedLink[RelayedStream]):
    """Relays connections to the robot.

    Args:
        wires: From the operator to the robot, and back.
        target: Of the robot, such as `tcp://127.0.0.1:4000`.
    """

    def __init__(self, wires: tuple[EmulatedWire, EmulatedWire], target: str) -> None:
        super().__init__(wires)
        host, _, port = target.removeprefix("tcp://").rpartition(":")
        self._target = (host, int(port))
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._streams: list[RelayedStream] = []

    @property
    def address(self) -> str:
        """Where the operator connects."""
        return f"tcp://127.0.0.1:{self._listener.getsockname()[1]}"

    def run(self, watched: Sequence[int], deadline: float) -> int | None:
        """See `EmulatedLink`."""
        while (now := time.monotonic()) < deadline:
            until = self._release(now, deadline)
            self._forget_closed()
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

    def close(self) -> None:
        """See `EmulatedLink`."""
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
        self._offer(stream.wire, len(chunk) + _HEADERS_BYTES, stream, chunk)

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
