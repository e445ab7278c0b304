"""One end of a TCP connection, as its program sees it.

A TCP connection over two links: two ends and how they are opened.
"""

from __future__ import annotations

from collections.abc import Callable

from dva_sim.kernel.clock import Clock
from dva_sim.network.link import Link
from dva_sim.network.tcp.parameters import TcpOptions
from dva_sim.network.tcp.receiver import BLOCKS, Receiver
from dva_sim.network.tcp.retransmission_timer import Timer
from dva_sim.network.tcp.sender import Sender

RESET_BYTES = 40  # IPv4 + TCP without options


def _nothing() -> None:
    return None


class TcpEndpoint:
    """One end of a connection: byte counts in, byte counts out.

    Args:
        clock: The run's clock.
        options: Of this end.
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
        self._clock, self._link, self._greet = clock, link, greet
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
        """[segments]."""
        return self.sender.window.window

    def write(self, count: int) -> int:
        """Hand over up to `count` bytes [B]; returns how many the send buffer took."""
        if self.gone or self._finished or not self.established:
            return 0
        return self.sender.write(count)

    @property
    def has_room(self) -> bool:
        """Whether a third of the send buffer is free; less may do for a `write`."""
        return self.sender.buffer.has_room

    def await_room(self) -> None:
        """Ask for `on_writable`."""
        self.sender.buffer.blocked = True

    def read(self, count: int) -> int:
        """Take up to `count` bytes in order [B]; returns how many. Opens the receive window."""
        return self._receiver.read(min(count, self.readable))

    def finish(self) -> None:
        """The program closes its socket: what is written is still delivered, then the end.

        What still arrives is thrown away and answered by a reset (`on_end` at the other end).
        """
        if self.gone or self._finished:
            return
        self._finished = True
        if self.readable or not self.established:
            self.refuse()
        else:
            self.sender.finish()

    def vanish(self) -> None:
        """As if it had never been: not even a reset is sent."""
        self._deaf = True
        self._forget()

    def _forget(self) -> None:
        self.gone = True
        self.sender.stop()
        self._receiver.stop()

    def reset(self) -> None:
        """The connection has broken."""
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
    ) -> None:
        """A segment arrives; its arguments are what `Sender` and `Receiver` name so."""
        if self._deaf:
            return
        if not (self.established or self.gone):
            self._greet()
        if self.gone or (self._finished and start < min(end, self._other.sender.end_mark)):
            if end > start:
                self.refuse()
            return
        now, receiver, sender = self._clock.now, self._receiver, self.sender
        if stamp > receiver.stamp and start <= receiver.acknowledged:
            receiver.stamp = stamp
        fresh = end > start and receiver.take(start, end, now)
        if start < 0:
            receiver.urgent = True
        sender.acknowledge(now, acknowledged, edge, blocks, duplicate, echo)
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

    def _emit(self, start: int, end: int, now: float) -> None:
        """Send a segment; `end` equal to `start` means an acknowledgement only."""
        receiver = self._receiver
        duplicate = receiver.duplicate
        receiver.leaves(now, end > start)
        arrival = self._link.carry(now, end - start + self._headers)
        if arrival is None:
            return
        blocks = tuple(receiver.blocks[:BLOCKS])
        known = receiver.next, receiver.edge, blocks, duplicate
        self._clock.call_at(arrival, self._other.arrive, start, end, *known, now, receiver.stamp)

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


OPENING_BYTES = 60  # a SYN: IPv4, TCP and its options
SYNACK_RETRIES = 5  # tcp_synack_retries


class TcpConnection:
    """Two ends, joined by two links.

    Only byte counts travel. What is modelled, of Linux as it talks to Linux:

    - opening in three segments, repeated after 1 s four times, then doubling (RFC 9293,
      6298; tcp_syn_linear_timeouts), the answer to it likewise but doubling at once;
    - cumulative, selective and duplicate acknowledgement (RFC 9293, 2018, 2883), time
      stamps (RFC 7323);
    - delayed acknowledgement: 40 ms, at once for the first segments, after trouble, for
      the second segment, and when the program has read all and nothing goes back (RFC 1122);
    - time-out with variance, floor and doubling (RFC 6298), tail-loss probe and loss by
      time (RFC 8985), rate reduction (RFC 6937), recoveries taken back (RFC 3522);
    - congestion window: ten segments at first (RFC 6928), slow start and Reno (RFC 5681),
      CUBIC (RFC 9438), HyStart by delay, shrinking when idle (RFC 2861), no growth when
      it is not used;
    - send buffer in charged bytes, tuned or fixed; receive window, tuned or fixed, with
      probes when it is closed (RFC 9293); giving up after 15 time-outs (tcp_retries2);
    - finishing: what was written is still delivered, what comes late is reset.

    Not modelled: Nagle (ZeroMQ switches it off), the bytes of selective acknowledgements,
    F-RTO (RFC 5682), the acknowledgement-train part of HyStart, ECN, pacing, segmentation
    offload, keep-alive, path MTU, bytes charged to the receive buffer beyond the payload,
    the states after finishing.

    Args:
        clock: The run's clock.
        out: The link from the opener.
        back: The link to the opener.
        opener: Options of the end that opens.
        peer: Options of the other end.

    Attributes:
        opener: The end that opens.
        peer: The other end.
    """

    def __init__(
        self,
        clock: Clock,
        out: Link,
        back: Link,
        opener: TcpOptions | None = None,
        peer: TcpOptions | None = None,
    ) -> None:
        self._clock, self._out, self._back = clock, out, back
        self._options, peer = opener or TcpOptions(), peer or TcpOptions()
        self.opener = TcpEndpoint(clock, self._options, out)
        self.peer = TcpEndpoint(clock, peer, back, self._accept)
        self.opener.join(self.peer)
        self.peer.join(self.opener)
        self._then: Callable[[], object] = _nothing
        self._accepted: Callable[[], object] = _nothing
        self._asked = self._answered = 0
        self._asked_at = self._answered_at = 0.0
        self._asking = Timer(clock, self._ask, self._options.tick)
        self._answering = Timer(clock, self._answer, peer.tick)

    def open(
        self, then: Callable[[], object], accepted: Callable[[], object] | None = None
    ) -> None:
        """Shake hands: `then()` when the opener may write, `accepted()` when the peer may."""
        self._then, self._accepted = then, accepted or _nothing
        if self._options.handshake:
            self._ask()
        else:
            self._establish(self.opener, self.peer, None, 0)
            self._accept()
            then()

    def close(self) -> None:
        """Forget everything: nothing more is sent, delivered or called."""
        self._asking.stop()
        self._answering.stop()
        self.opener.vanish()
        self.peer.vanish()

    def _ask(self) -> None:
        """Send the opening segment, again and again."""
        tried, linear = self._asked, self._options.syn_linear
        if self.opener.gone:
            return
        if tried > self._options.syn_retries + linear:
            self.opener.reset()
            return
        self._asked += 1
        self._asked_at = now = self._clock.now
        self._asking.set(now + self._options.first_rto * 2.0 ** max(0, tried - linear))
        arrival = self._out.carry(now, OPENING_BYTES)
        if arrival is not None:
            self._clock.call_at(arrival, self._asked_for, now)

    def _asked_for(self, stamp: float) -> None:
        if not (self.peer.gone or self.peer.established):
            self._answering.stop()
            self._answer(stamp)

    def _answer(self, stamp: float = 0.0) -> None:
        """The peer's answer to an opening segment, with the time stamp it echoes."""
        if self.peer.gone or self._answered > SYNACK_RETRIES + self._asked:
            return
        stamp = stamp or self._asked_at
        now = self._clock.now
        self._answering.set(now + self._options.first_rto * 2.0**self._answered)
        self._answered += 1
        self._answered_at = now
        arrival = self._back.carry(now, OPENING_BYTES)
        if arrival is not None:
            self._clock.call_at(arrival, self._answered_to, stamp)

    def _answered_to(self, stamp: float) -> None:
        if self.opener.gone:
            self.opener.refuse()
            return
        first = not self.opener.established
        if first:
            self._asking.stop()
            rtt = self._clock.now - stamp
            self._establish(self.opener, self.peer, rtt, self._asked - 1)
        self.opener.acknowledge()
        if first:
            self._then()

    def _accept(self) -> None:
        """The first segment after the answer makes the peer established too."""
        self._answering.stop()
        once = self._answered == 1
        rtt = self._clock.now - self._answered_at if once else None
        self._establish(self.peer, self.opener, rtt, max(0, self._answered - 1))
        self._accepted()

    @staticmethod
    def _establish(
        end: TcpEndpoint, other: TcpEndpoint, round_trip: float | None, repeated: int
    ) -> None:
        end.established = True
        end.sender.established(round_trip, repeated, other.window_edge)
