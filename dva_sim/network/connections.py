"""Connections between two nodes: ZeroMQ at one of two depths, or datagrams, and their choice.

**By message**, a reliable ordered stream: what TCP does to an application. A lost packet holds up
everything behind it until it is sent again. It is exact without loss and below the link's rate,
good with little loss; it has no congestion window and no segments (those: `zmtp`).

**Datagrams**, as over UDP: no connection, no order, nothing is sent again. A message that does not
fit into one packet travels in fragments, and is lost if one of them is.

References:
    RFC 6298 (retransmission time-out), RFC 8985 section 7 (tail-loss probe), RFC 768 (UDP),
    RFC 791 (fragments).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Annotated, Any, Final, Literal

from pydantic import Field

from dva_sim.kernel.clock import Clock
from dva_sim.kernel.config import AlsoCalled, Config, Key
from dva_sim.network.link import Link
from dva_sim.network.tcp import TcpOptions
from dva_sim.network.zmtp import HIGH_WATER_MARK, ZmtpConnection, ZmtpOptions

MSS = 1448  # payload of a full Ethernet segment with TCP time stamps [B]
HEADERS = 52  # IPv4 + TCP with time stamps [B]
MIN_RTO = 0.2  # minimum of the variance part of the retransmission time-out [s]
FIRST_RTO = 1.0  # time-out before the first measurement [s]
MAX_RTO = 60.0  # longest time-out [s]
MAX_IN_FLIGHT = 1000  # maximum messages under way: ZeroMQ's default high-water mark

Deliver = Callable[[Any], object]


def _offer_each(link: Link, now: float, size: int, largest: int, header: int) -> tuple[float, int]:
    """Send packet by packet; return the latest arrival [s] and the size that was lost [B]."""
    arrival = 0.0
    missing = 0
    while size > 0:
        part = min(size, largest)
        size -= part
        at = link.carry(now, part + header)
        if at is None:
            missing += part
        elif at > arrival:
            arrival = at
    return arrival, missing


class Stream:
    """One direction of a connection.

    Args:
        clock: The run's clock.
        forward: Carries the data.
        backward: Carries the acknowledgements (their size is neglected).
        deliver: Callback for each payload, once and in order.

    Attributes:
        deliver: Callback for each message; may be replaced at any time.
    """

    def __init__(self, clock: Clock, forward: Link, backward: Link, deliver: Deliver) -> None:
        self._clock = clock
        self._forward = forward
        self._backward = backward
        self.deliver = deliver
        self._next_seq = self._next_delivered = 0
        self._waiting: dict[int, Any] = {}
        self._last_arrival = 0.0
        self._srtt: float | None = None
        self._rttvar = 0.0
        self.retransmitted = 0
        self.closed = False

    def send(self, payload: Any, size: int) -> bool:
        """Send a message of `size` bytes [B].

        Returns:
            False if the stream is closed or its send queue is full; nothing is sent then.
        """
        seq = self._next_seq
        if self.closed or seq - self._next_delivered >= MAX_IN_FLIGHT:
            return False
        self._next_seq = seq + 1
        clock = self._clock
        now = clock.now
        packets = -(-size // MSS)
        arrival = self._forward.carry_train(now, packets, size + packets * HEADERS)
        if arrival is None:
            self._transmit(seq, payload, size, 0)
            return True
        self._measure(arrival - now + self._backward.delay)
        if arrival < self._last_arrival:
            arrival = self._last_arrival  # behind what had to be sent again
        self._last_arrival = arrival
        clock.call_at(arrival, self._arrive, seq, payload)
        return True

    def close(self) -> None:
        """Forget what is under way: nothing more is delivered."""
        self.closed = True
        self._waiting.clear()

    def _transmit(self, seq: int, payload: Any, size: int, tries: int) -> None:
        """Offer the message's packets to the link; those lost are offered again later."""
        if self.closed:
            return
        now = self._clock.now
        arrival, missing = _offer_each(self._forward, now, size, MSS, HEADERS)
        if missing:
            self.retransmitted += 1
            wait = self._recovery_time(tries)
            self._clock.call_at(now + wait, self._transmit, seq, payload, missing, tries + 1)
            return
        # Packets sent again may arrive before later ones; a stream delivers in order only.
        last = self._last_arrival = max(self._last_arrival, arrival)
        if tries == 0:
            self._measure(arrival - now + self._backward.delay)
            arrival = last
        self._clock.call_at(arrival, self._arrive, seq, payload)

    def _arrive(self, seq: int, payload: Any) -> None:
        if self.closed:
            return
        if seq != self._next_delivered:
            self._waiting[seq] = payload  # something before it is still missing
            return
        self._next_delivered += 1
        self.deliver(payload)
        while self._next_delivered in self._waiting:
            ready = self._waiting.pop(self._next_delivered)
            self._next_delivered += 1
            self.deliver(ready)

    def _measure(self, rtt: float) -> None:
        """Measure a round trip: RFC 6298, equations 2.2 and 2.3."""
        srtt = self._srtt
        if srtt is None:
            self._srtt = rtt
            self._rttvar = rtt / 2
            return
        self._rttvar += (abs(srtt - rtt) - self._rttvar) / 4
        self._srtt = srtt + (rtt - srtt) / 8

    def _recovery_time(self, tries: int) -> float:
        """Return the time to repair a loss [s]: by the tail-loss probe, then doubling time-outs."""
        if self._srtt is None:
            return min(MAX_RTO, FIRST_RTO * 2.0**tries)
        rto = self._srtt + max(MIN_RTO, 4 * self._rttvar)
        if tries == 0:
            return min(rto, 2 * self._srtt + 0.01)
        return float(min(MAX_RTO, rto * 2.0 ** (tries - 1)))


class _PlainEnd:
    """End without a buffer of its own: data waits before its link."""

    _link: Link

    def pause(self) -> None:
        """Do nothing: the program has to drop what it cannot take."""

    def resume(self) -> None:
        """Do nothing; see `pause`."""

    def backlog_bytes(self, now: float) -> float:
        """Return bytes that wait before the link [B]."""
        return self._link.backlog_bytes(now)


class StreamEnd(_PlainEnd):
    """One end of a connection.

    Args:
        out: Carries what is sent.
        link: Link that carries this direction.

    Attributes:
        send: Sends a message of a size on the wire [B]; see `Stream`.
    """

    def __init__(self, out: Stream, link: Link) -> None:
        self._out = out
        self._link = link
        self.send = out.send

    @property
    def closed(self) -> bool:
        """True if nothing is sent any more."""
        return self._out.closed


class Connection:
    """Two streams between two nodes, opened by a handshake of three round trips.

    The round trips are TCP's one and the two of ZeroMQ's greeting and security handshake.

    Args:
        clock: The run's clock.
        out: The link from the opener.
        back: The link to the opener.
        at_peer: Callback for messages from the opener.
        at_opener: Callback for messages from the peer.
    """

    HANDSHAKE_ROUND_TRIPS = 3
    HANDSHAKE_BYTES = 64
    depth: Final = "message"
    keeps: Final = True

    def __init__(
        self, clock: Clock, out: Link, back: Link, at_peer: Deliver, at_opener: Deliver
    ) -> None:
        self._handlers = at_peer, at_opener
        self._then: Callable[[], object] = _nothing
        self._accepted: Callable[[], object] | None = None
        self._hops_left = 2 * self.HANDSHAKE_ROUND_TRIPS
        self._to_peer = Stream(clock, out, back, self._greets_back)
        self._to_opener = Stream(clock, back, out, self._greets_on)
        self.opener = StreamEnd(self._to_peer, out)
        self.peer = StreamEnd(self._to_opener, back)

    def open(
        self, then: Callable[[], object], accepted: Callable[[], object] | None = None
    ) -> None:
        """Shake hands; `then()` when the opener is ready, `accepted()` when the peer is."""
        self._then = then
        self._accepted = accepted
        self._to_peer.send(None, self.HANDSHAKE_BYTES)

    def close(self) -> None:
        """Drop everything under way in both directions."""
        self._to_peer.close()
        self._to_opener.close()

    drop = close

    def _greets_back(self, _: object) -> None:
        self._hops_left -= 1
        self._to_opener.send(None, self.HANDSHAKE_BYTES)

    def _greets_on(self, _: object) -> None:
        self._hops_left -= 1
        if self._hops_left:
            self._to_peer.send(None, self.HANDSHAKE_BYTES)
            return
        self._to_peer.deliver, self._to_opener.deliver = self._handlers
        if self._accepted is not None:
            self._to_peer.deliver = self._is_accepted
            self._to_peer.send(None, self.HANDSHAKE_BYTES)
        self._then()

    def _is_accepted(self, _: object) -> None:
        """Note that the end of the opener's handshake has reached the peer."""
        self._to_peer.deliver = self._handlers[0]
        assert self._accepted is not None
        self._accepted()


def _nothing() -> None:
    return None


UDP_HEADER = 8  # [B]
IP_HEADER = 20  # [B]
FRAGMENT = 1480  # payload of a full IPv4 packet on Ethernet [B]


class DatagramEnd(_PlainEnd):
    """One end: what it sends travels over `link` and is taken by `deliver` there.

    Attributes:
        closed: True once incoming data is discarded and nothing is sent.
    """

    other: DatagramEnd

    def __init__(self, clock: Clock, link: Link, deliver: Deliver) -> None:
        self._clock = clock
        self._link = link
        self._deliver = deliver
        self.closed = False

    def send(self, payload: Any, size: int) -> bool:
        """Send a message of `size` bytes [B]; False if the socket is closed."""
        if self.closed:
            return False
        now = self._clock.now
        total = size + UDP_HEADER
        packets = -(-total // FRAGMENT)
        arrival = self._link.carry_train(now, packets, total + packets * IP_HEADER)
        if arrival is None:
            last, missing = _offer_each(self._link, now, total, FRAGMENT, IP_HEADER)
            arrival = None if missing else last
        if arrival is not None:
            self._clock.call_at(arrival, self.other.take, payload)
        return True

    def take(self, payload: Any) -> None:
        """Take a message that has arrived."""
        if not self.closed:
            self._deliver(payload)


class DatagramConnection:
    """Two sockets that exchange datagrams: no handshake, no guarantee of delivery.

    Args:
        clock: The run's clock.
        out: The link from the opener.
        back: The link to the opener.
        at_peer: Callback for messages from the opener.
        at_opener: Callback for messages from the peer.
    """

    depth: Final = "datagram"
    keeps: Final = False

    def __init__(
        self, clock: Clock, out: Link, back: Link, at_peer: Deliver, at_opener: Deliver
    ) -> None:
        self.opener = DatagramEnd(clock, out, at_opener)
        self.peer = DatagramEnd(clock, back, at_peer)
        self.opener.other = self.peer
        self.peer.other = self.opener

    def open(
        self, then: Callable[[], object], accepted: Callable[[], object] | None = None
    ) -> None:
        """Let both send at once."""
        then()
        if accepted is not None:
            accepted()

    def close(self) -> None:
        """Close the opener's socket: what it has sent still arrives, no answer does."""
        self.opener.closed = True

    def drop(self) -> None:
        """Close both ends."""
        self.opener.closed = self.peer.closed = True


TransportKind = Literal["zeromq", "datagrams"]
Depth = Literal["auto", "message", "segment"]
AnyConnection = Connection | ZmtpConnection | DatagramConnection

BUSY = 0.8  # share of a link's rate up to which nothing piles up before it; assumed

_Buffer = Annotated[int, Field(ge=2_048, le=100_000_000)] | None


class ZeromqConfig(Config):
    """Options set on every ZeroMQ socket.

    Attributes:
        high_water_mark: Messages that a pipe holds, at both ends.
        send_buffer_bytes: TCP send buffer (`ZMQ_SNDBUF`); by default the kernel's size.
        receive_buffer_bytes: TCP receive buffer (`ZMQ_RCVBUF`); by default the kernel's size.
        conflate: Ends that keep only the newest published message in their queue (`ZMQ_CONFLATE`).
    """

    high_water_mark: Annotated[
        int, Field(ge=1, le=1_000_000), AlsoCalled("hwm"), Key("high-water mark")
    ] = HIGH_WATER_MARK
    send_buffer_bytes: Annotated[_Buffer, Key("send buffer")] = None
    receive_buffer_bytes: Annotated[_Buffer, Key("receive buffer")] = None
    conflate: Annotated[
        Literal["none", "publisher", "subscriber", "both"], Key("kept of what waits")
    ] = "none"

    @property
    def conflates_sender(self) -> bool:
        """True if publishers keep only the newest message for each subscriber."""
        return self.conflate in ("publisher", "both")

    @property
    def conflates_receiver(self) -> bool:
        """True if subscribers keep only the newest message."""
        return self.conflate in ("subscriber", "both")

    @property
    def is_bounded(self) -> bool:
        """True if a buffer may be full, or replaced, earlier than by default."""
        buffers = self.send_buffer_bytes, self.receive_buffer_bytes
        set_by_hand = self.high_water_mark != HIGH_WATER_MARK or buffers != (None, None)
        return set_by_hand or self.conflates_sender


@dataclass(frozen=True)
class Load:
    """Greatest load offered to one direction of a link.

    Attributes:
        rate_bps: Mean rate in the long run, with all headers [bit/s].
        burst: Largest burst [B].
    """

    rate_bps: float = 0.0
    burst: int = 0


class Connector:
    """Factory for the connections of a network.

    With depth `auto` a connection is modelled message by message where that is exact, and
    segment by segment where anything might be lost, come out of turn or pile up; see
    `is_calm`.

    Args:
        transport: `zeromq` or `datagrams`.
        depth: `message`, `segment`, or `auto`; datagrams have only one.
        zeromq: Options of the sockets.
        load: Load offered to a link.
        tcp: Further options of TCP at both ends.

    Attributes:
        deepest: The depth of the connections so far: `message`, `segment` as soon as one needed
            it, or `datagram`.
        conflates_receiver: True if subscribers keep only the newest message.
    """

    def __init__(
        self,
        transport: TransportKind = "zeromq",
        depth: Depth = "auto",
        zeromq: ZeromqConfig | None = None,
        load: Load | None = None,
        tcp: TcpOptions | None = None,
    ) -> None:
        self._transport = transport
        self._depth = depth
        self._tcp = tcp or TcpOptions()
        self._zeromq = zeromq or ZeromqConfig()
        self._load = load or Load()
        self.conflates_receiver = self._zeromq.conflates_receiver
        self.deepest = "datagram" if transport == "datagrams" else "message"

    def connect(
        self,
        clock: Clock,
        links: tuple[Link, Link],
        at_peer: Deliver,
        at_opener: Deliver,
        publishes: bool = False,
    ) -> AnyConnection:
        """Return a connection that is still to be opened.

        Args:
            clock: The run's clock.
            links: From the opener, and to it.
            at_peer: Callback for messages from the opener.
            at_opener: Callback for messages from the peer.
            publishes: True if the peer publishes to the opener.
        """
        ends = clock, *links, at_peer, at_opener
        depth = self.depth(*links)
        if depth == "datagram":
            return DatagramConnection(*ends)
        if depth == "message":
            return Connection(*ends)
        self.deepest = depth
        conflate = publishes and self._zeromq.conflates_sender
        return ZmtpConnection(*ends, self._options(), self._options(conflate))

    def depth(self, out: Link, back: Link) -> str:
        """Choose how a connection over two links is modelled."""
        if self._transport == "datagrams":
            return "datagram"
        if self._depth != "auto":
            return self._depth
        calm = is_calm(out, self._load) and is_calm(back, self._load)
        return "message" if calm and not self._zeromq.is_bounded else "segment"

    def _options(self, conflate: bool = False) -> ZmtpOptions:
        zeromq = self._zeromq
        tcp = replace(
            self._tcp,
            send_buffer=zeromq.send_buffer_bytes or self._tcp.send_buffer,
            receive_buffer=zeromq.receive_buffer_bytes or self._tcp.receive_buffer,
        )
        return ZmtpOptions(zeromq.high_water_mark, conflate, tcp)


def is_calm(link: Link, load: Load) -> bool:
    """Return True if whole messages over a link behave like their segments under TCP.

    The link may not lose, delay at random or reorder anything; its rate must be known and used
    by at most four fifths; and twice the largest burst must fit into the queue.
    """
    if not link.is_ideal() or link.rate_bps is None:
        return False
    return load.rate_bps <= BUSY * link.rate_bps and 2 * load.burst <= link.room
