"""A ZeroMQ connection over TCP: greeting, framing, pipes, encoder and decoder.

A pipe is a queue with a high-water mark. A writer learns of reads only in steps of the low-water
mark, half of the high one: so a full pipe stays full until half of it has been read.

A message waits in the pipe until the encoder takes it into a batch, the batch until TCP's send
buffer has room, and its bytes until TCP may send them: in order, all of it. At the other end
the decoder stops when its program takes nothing more, TCP's receive buffer fills, its window
closes, and in the end the sender's pipe is full. Only byte counts travel; which bytes end
a message is noted here.

References:
    ZeroMQ's documentation of ZMQ_SNDHWM, ZMQ_RCVHWM and ZMQ_CONFLATE; that the low-water
    mark is half of the high one was measured.
    ZMTP 3.1, rfc.zeromq.org/spec/37: greeting, version negotiation, NULL mechanism, framing.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any, Final, Generic, Protocol, TypeVar

from dva_sim.kernel.clock import Clock
from dva_sim.network.link import Link
from dva_sim.network.tcp import TcpConnection, TcpEndpoint, TcpOptions

HIGH_WATER_MARK = 1000  # ZeroMQ's default, in messages

T = TypeVar("T")


def _nothing() -> None:
    return None


class Pipe(Generic[T]):
    """Messages between a program and its connection.

    Args:
        mark: High-water mark, in messages.
        conflate: True to keep only the newest message, without a high-water mark.

    Attributes:
        on_room: Called when there is room again after a refusal.
        superseded: Messages that a newer one has replaced.
    """

    def __init__(self, mark: int = HIGH_WATER_MARK, conflate: bool = False) -> None:
        self._mark = mark
        self._low = (mark + 1) // 2
        self._conflate = conflate
        self._items: deque[T] = deque(maxlen=1 if conflate else None)
        self._written = self._read = self._acknowledged = self.superseded = 0
        self._refused = False
        self.on_room: Callable[[], object] = _nothing

    def __len__(self) -> int:
        return len(self._items)

    def __iter__(self) -> Iterator[T]:
        return iter(self._items)

    @property
    def full(self) -> bool:
        """True if the next message would be refused."""
        return not self._conflate and self._written - self._acknowledged >= self._mark

    def put(self, item: T) -> bool:
        """Add a message; False if the mark is reached."""
        if self.full:
            self._refused = True
            return False
        self._written += 1
        self.superseded += self._conflate and len(self._items)
        self._items.append(item)
        return True

    def take(self) -> T | None:
        """Return the oldest message, if there is one."""
        if not self._items:
            return None
        item = self._items.popleft()
        self._read += 1
        if self._read % self._low == 0:
            self._acknowledged = self._read
            if self._refused:
                self._refused = False
                self.on_room()
        return item


class Flow(Protocol):
    """Source of messages that can be paused."""

    def pause(self) -> None:
        """Deliver nothing more: messages wait on the way, and in the end at the sender."""

    def resume(self) -> None:
        """Continue with the waiting messages."""


BATCH = 8192  # size that the encoder hands over, and the decoder reads, at once [B]
SIGNATURE = 10  # size of the beginning of a greeting [B]
GREETING = 64  # size of a whole greeting [B]
READY = 43  # size of the READY command of a DEALER or ROUTER; the shortest has 27 [B]

# Bytes of the other end's greeting that must have arrived, and bytes that are sent then.
_GREETING = (
    (SIGNATURE, 1),  # the major version
    (SIGNATURE + 1, GREETING - SIGNATURE - 1),
    (GREETING, READY),
    (GREETING + READY, 0),
)

Deliver = Callable[[Any], object]
Then = Callable[[], object]


def framed(size: int) -> int:
    """Return bytes on the wire of a frame of `size` bytes [B]."""
    return size + 9 if size > 255 else size + 2


@dataclass(frozen=True, slots=True)
class ZmtpOptions:
    """Options of the socket at one end.

    Attributes:
        mark: High-water mark of its send pipe, in messages.
        conflate: True if that pipe keeps only the newest message.
        tcp: Options of the connection below.
    """

    mark: int = HIGH_WATER_MARK
    conflate: bool = False
    tcp: TcpOptions = field(default_factory=TcpOptions)


class ZmtpEnd:
    """One end of a connection.

    Args:
        tcp: The end of the connection below.
        link: Carries what is sent.
        options: Options of the socket.
        deliver: Callback for each message that arrives, whole and in order.

    Attributes:
        pipe: Messages waiting for the encoder.
        ready: True once the handshake is over at this end.
        closed: True once nothing more is sent or delivered here.
        on_ready: Called when the handshake is over.
        on_end: Called when the other end has gone.
    """

    other: ZmtpEnd

    def __init__(
        self, tcp: TcpEndpoint, link: Link, options: ZmtpOptions, deliver: Deliver
    ) -> None:
        self._tcp = tcp
        self._link = link
        self._deliver = deliver
        self.pipe: Pipe[tuple[Any, int]] = Pipe(options.mark, options.conflate)
        self._asleep = True  # the sending thread has found the pipe empty, and is to be woken
        self._batch = self._rest = self._position = self._heard = 0
        self._arriving: deque[tuple[int, Any]] = deque()  # where each message ends, and what it is
        self._greeting = iter(_GREETING)
        self._next = next(self._greeting)
        self._paused = self._over = False
        self.ready = self.closed = False
        self.on_ready: Then = _nothing
        self.on_end: Then = _nothing
        tcp.on_readable = self._read
        tcp.on_writable = self._flush
        tcp.on_end = self._end

    # --- for the program -----------------------------------------------------------------

    def send(self, payload: Any, size: int) -> bool:
        """Put a message of `size` bytes on the wire [B] into the pipe; see `framed`.

        Returns:
            False if the high-water mark is reached, or the connection has ended.
        """
        if self.closed or not self.pipe.put((payload, size)):
            return False
        if self.ready and self._asleep:
            self._flush()
        return True

    def pause(self) -> None:
        """Stop the decoder, which keeps what it has read: the program takes nothing more."""
        self._paused = True

    def resume(self) -> None:
        """Let the program take messages again."""
        if self._paused:
            self._paused = False
            self._read()
            if self._over and not self._paused:
                self._end()

    def backlog_bytes(self, now: float) -> float:
        """Return bytes that wait to be sent, here and before the link [B]."""
        waiting = sum(size for _, size in self.pipe) + self._rest + self._batch
        return waiting + self._tcp.unsent + self._link.backlog_bytes(now)

    # --- the handshake -------------------------------------------------------------------

    def begin(self) -> None:
        """Begin on TCP: send the signature, and the rest as the other end's greeting arrives."""
        self._say(SIGNATURE)
        self._read()

    def _say(self, count: int) -> None:
        self._position += count
        self._batch += count
        self._flush()

    # --- encoder and decoder ---------------------------------------------------------------

    def _flush(self) -> None:
        """Hand batches to TCP until it has no room, or there are none.

        The sending thread is woken by a socket that is writable, of whose buffer a third is
        free, and by the first message after it had found the pipe empty: that one is tried at
        once, with whatever was held up before, and may find room although less is free.
        """
        self._asleep = False
        while not self.closed:
            if not self._batch:
                self._fill()
            if not self._batch:
                return
            self._batch -= self._tcp.write(self._batch)
            if self._batch or not self._tcp.has_room:
                self._tcp.await_room()
                return

    def _fill(self) -> None:
        """Take messages into a batch; a long one continues in the next."""
        while self.ready and self._batch < BATCH:
            if not self._rest:
                message = self.pipe.take()
                if message is None:
                    self._asleep = True
                    return
                payload, self._rest = message
                self._position += self._rest
                # Only byte counts travel: the other end delivers it once its count gets there.
                self.other._arriving.append((self._position, payload))
            part = min(self._rest, BATCH - self._batch)
            self._rest -= part
            self._batch += part

    def _read(self) -> None:
        """Deliver every whole message of a batch, then read the next batch."""
        arriving = self._arriving
        while not (self._paused or self.closed):
            if arriving and arriving[0][0] <= self._heard:
                self._deliver(arriving.popleft()[1])
                continue
            count = self._tcp.read(BATCH)
            if not count:
                return
            self._heard += count
            while not self.ready and self._heard >= self._next[0]:
                if self._next[1]:
                    self._say(self._next[1])
                    self._next = next(self._greeting)
                else:
                    self.ready = True
                    self.on_ready()
                    self._flush()

    # --- the end ---------------------------------------------------------------------------

    def close(self) -> None:
        """Close the socket without lingering: what TCP has is still delivered, nothing else."""
        if not self.closed:
            self.closed = True
            self._tcp.finish()

    def _end(self) -> None:
        """End once all that came before is read: the other end has gone."""
        self._over = True
        self._read()
        if not (self.closed or self._paused):
            self.closed = True
            self.on_end()


class ZmtpConnection:
    """Two ends between two nodes, opened by a handshake.

    The opener is ready after three round trips, the peer half a round trip later.

    Args:
        clock: The run's clock.
        out: The link from the opener.
        back: The link to the opener.
        at_peer: Callback for messages from the opener.
        at_opener: Callback for messages from the peer.
        opener: Options of the opener's socket.
        peer: Options of the peer's socket.
    """

    depth: Final = "segment"
    keeps: Final = True

    def __init__(
        self,
        clock: Clock,
        out: Link,
        back: Link,
        at_peer: Deliver,
        at_opener: Deliver,
        opener: ZmtpOptions | None = None,
        peer: ZmtpOptions | None = None,
    ) -> None:
        opener = opener or ZmtpOptions()
        peer = peer or ZmtpOptions()
        self._tcp = TcpConnection(clock, out, back, opener.tcp, peer.tcp)
        self.opener = ZmtpEnd(self._tcp.opener, out, opener, at_opener)
        self.peer = ZmtpEnd(self._tcp.peer, back, peer, at_peer)
        self.opener.other = self.peer
        self.peer.other = self.opener

    def open(self, then: Then, accepted: Then = _nothing) -> None:
        """Shake hands; `then()` when the opener is ready, `accepted()` when the peer is."""
        self.opener.on_ready = then
        self.peer.on_ready = accepted
        self._tcp.open(self.opener.begin, self.peer.begin)

    def close(self) -> None:
        """Close the opener's socket; what TCP has of it still arrives at the peer."""
        self.opener.close()

    def drop(self) -> None:
        """Break the connection: what is under way is lost."""
        self.opener.closed = self.peer.closed = True
        self._tcp.close()
