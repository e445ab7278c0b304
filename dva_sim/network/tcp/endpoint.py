"""One end of a TCP connection, as its program sees it."""

from __future__ import annotations

from collections.abc import Callable

from dva_sim.kernel.clock import Clock
from dva_sim.network.link import Link
from dva_sim.network.tcp.parameters import TcpOptions
from dva_sim.network.tcp.receiver import BLOCKS, Receiver
from dva_sim.network.tcp.sender import Sender

RESET_BYTES = 40  # IPv4 + TCP without options


def _nothing() -> None:
    return None


class TcpEndpoint:
    """One end of a connection: byte counts in, byte counts out.

    Args:
        clock: The run's clock.
        options: Options of this end.
        link: Carries what this end sends.
        greet: Called when a segment arrives before this end is established.

    Attributes:
        on_readable: Called when bytes in order have arrived; `read` may be called inside.
        on_writable: Called when the send buffer has room again (a third of it is free)
            after a `write` that could not take everything, or `await_room`.
        on_end: Called once when the other end has finished, has reset the connection,
            or has not answered for so long that it is given up.
        sender: The sending half, with its counters.
        established: The opening is over at this end.
        gone: This end has forgotten the connection.
    """

    def __init__(
        self,
        clock: Clock,
        options: TcpOptions,
        link: Link,
        greet: Callable[[], object] = _nothing,
    ) -> None:
        self._clock = clock
        self._link = link
        self._greet = greet
        self._headers = options.headers
        self.on_readable: Callable[[], object] = _nothing
        self.on_writable: Callable[[], object] = _nothing
        self.on_end: Callable[[], object] = _nothing
        self.sender = Sender(clock, options, self._emit, self.reset)
        self._receiver = Receiver(clock, options, self.sender.times, self.acknowledge)
        self._other = self
        self.established = self.gone = self._finished = self._ended = self._deaf = False

    def join(self, other: TcpEndpoint) -> None:
        """Name the other end."""
        self._other = other

    @property
    def readable(self) -> int:
        """Bytes in order that wait to be read [B]."""
        in_order = min(self._receiver.next, self._other.sender.end_mark)
        return int(in_order) - self._receiver.read_to

    @property
    def unsent(self) -> int:
        """Bytes written that were never put on the link [B]."""
        return self.sender.total - self.sender.next

    @property
    def window_edge(self) -> int:
        """First byte that this end has no room for, as first announced."""
        return self._receiver.edge

    @property
    def congestion_window(self) -> float:
        """Congestion window [segments]."""
        return self.sender.window.window

    def write(self, count: int) -> int:
        """Hand over up to `count` bytes [B]; returns how many the send buffer took."""
        if self.gone or self._finished or not self.established:
            return 0
        return self.sender.write(count)

    @property
    def has_room(self) -> bool:
        """True if a third of the send buffer is free; less may suffice for a `write`."""
        return self.sender.buffer.has_room

    def await_room(self) -> None:
        """Ask for `on_writable`."""
        self.sender.buffer.blocked = True

    def read(self, count: int) -> int:
        """Take up to `count` bytes in order [B]; returns how many. Opens the receive window."""
        return self._receiver.read(min(count, self.readable))

    def finish(self) -> None:
        """Close the program's socket: what is written is still delivered, then the end.

        Later segments are discarded and answered by a reset (`on_end` at the other end).
        """
        if self.gone or self._finished:
            return
        self._finished = True
        if self.readable or not self.established:
            # RFC 1122, section 4.2.2.13: closing with unread data resets the connection.
            self.refuse()
        else:
            self.sender.finish()

    def vanish(self) -> None:
        """Disappear without sending even a reset."""
        self._deaf = True
        self._forget()

    def _forget(self) -> None:
        self.gone = True
        self.sender.stop()
        self._receiver.stop()

    def reset(self) -> None:
        """Reset a connection that has broken."""
        if not self.gone:
            self._forget()
            self._tell_end()

    def arrive(
        self,
        start: int,
        end: int,
        acknowledged: int,
        edge: int,
        blocks: tuple[tuple[int, int], ...],
        duplicate: bool,
        stamp: float,
        echo: float,
        pushes: bool,
    ) -> None:
        """Take a segment; its arguments are what `Sender` and `Receiver` name so."""
        if self._deaf:
            return
        if not (self.established or self.gone):
            self._greet()
        if self.gone or (self._finished and start < min(end, self._other.sender.end_mark)):
            if end > start:
                self.refuse()
            return
        now = self._clock.now
        receiver = self._receiver
        sender = self.sender
        if stamp > receiver.stamp and start <= receiver.acknowledged:
            receiver.stamp = stamp
        fresh = end > start and receiver.take(start, end, now, pushes)
        if start < 0:
            receiver.urgent = True
        sender.acknowledge(now, acknowledged, edge, blocks, duplicate=duplicate, echo=echo)
        if receiver.must_acknowledge():
            self.acknowledge()
        if fresh:
            self._offer()
        if receiver.pending:
            receiver.wait(now)
        if sender.buffer.blocked and sender.reopens():
            self.on_writable()

    def _offer(self) -> None:
        """Tell the program of new bytes, and of the end if it has come."""
        if self._finished:
            return
        if self.readable:
            self.on_readable()
        if self._receiver.next > self._other.sender.end_mark:
            self._tell_end()

    def _tell_end(self) -> None:
        if not (self._ended or self._finished):
            self._ended = True
            self.on_end()

    def _emit(self, start: int, end: int, now: float, pushes: bool = False) -> None:
        """Send a segment; `end` equal to `start` means an acknowledgement only."""
        receiver = self._receiver
        duplicate = receiver.duplicate
        receiver.leaves(now, end > start)
        arrival = self._link.carry(now, end - start + self._headers)
        if arrival is None:
            return
        blocks = tuple(receiver.blocks[:BLOCKS])
        header = receiver.next, receiver.edge, blocks, duplicate, now, receiver.stamp, pushes
        self._clock.call_at(arrival, self._other.arrive, start, end, *header)

    def acknowledge(self) -> None:
        """Send an acknowledgement without data."""
        if not self.gone:
            at = self.sender.next
            self._emit(at, at, self._clock.now)

    def refuse(self) -> None:
        """Reset the connection at both ends."""
        self._forget()
        now = self._clock.now
        arrival = self._link.carry(now, RESET_BYTES)
        if arrival is not None:
            self._clock.call_at(arrival, self._other.reset)
