"""A reliable ordered stream over a link, message by message: what TCP does to an application.

A lost packet holds up everything behind it until it is sent again. This is the
message-level model: exact without loss and below the link's rate, good with little loss;
it has no congestion window and no segments.

References:
    RFC 6298 (retransmission time-out), RFC 8985 section 7 (tail-loss probe).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from dva_sim.kernel.clock import Clock
from dva_sim.network.link import Link

MSS = 1448  # payload of a full Ethernet segment with TCP time stamps [B]
HEADERS = 52  # IPv4 + TCP with time stamps [B]
MIN_RTO, FIRST_RTO, MAX_RTO = 0.2, 1.0, 60.0
MAX_IN_FLIGHT = 1000  # ZeroMQ's default high-water mark, in messages

Deliver = Callable[[Any], object]


class Stream:
    """One direction of a connection.

    Args:
        clock: The run's clock.
        forward: Carries the data.
        backward: Carries the acknowledgements (their size is neglected).
        deliver: Takes each payload, once and in order.

    Attributes:
        deliver: The same; may be replaced at any time.
    """

    def __init__(self, clock: Clock, forward: Link, backward: Link, deliver: Deliver) -> None:
        self._clock, self._forward, self._backward = clock, forward, backward
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
        now, packets = clock.now, -(-size // MSS)
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
        arrival, missing = self._offer_each(now, size)
        if missing:
            self.retransmitted += 1
            wait = self._recovery_time(tries)
            self._clock.call_at(now + wait, self._transmit, seq, payload, missing, tries + 1)
            return
        # A remnant sent again may arrive before what had been lost around it: in order only.
        last = self._last_arrival = max(self._last_arrival, arrival)
        if tries == 0:
            self._measure(arrival - now + self._backward.delay)
            arrival = last
        self._clock.call_at(arrival, self._arrive, seq, payload)

    def _offer_each(self, now: float, size: int) -> tuple[float, int]:
        """Offer a message packet by packet: when the last one arrives [s], and the bytes lost."""
        arrival, missing = 0.0, 0
        while size > 0:
            part = min(size, MSS)
            size -= part
            at = self._forward.carry(now, part + HEADERS)
            if at is None:
                missing += part
            elif at > arrival:
                arrival = at
        return arrival, missing

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
        """RFC 6298, equations 2.2 and 2.3."""
        srtt = self._srtt
        if srtt is None:
            self._srtt, self._rttvar = rtt, rtt / 2
            return
        self._rttvar += (abs(srtt - rtt) - self._rttvar) / 4
        self._srtt = srtt + (rtt - srtt) / 8

    def _recovery_time(self, tries: int) -> float:
        """When a loss is mended: by the tail-loss probe first, then by the time-out, doubling."""
        if self._srtt is None:
            return min(MAX_RTO, FIRST_RTO * 2.0**tries)
        rto = self._srtt + max(MIN_RTO, 4 * self._rttvar)
        if tries == 0:
            return min(rto, 2 * self._srtt + 0.01)
        return float(min(MAX_RTO, rto * 2.0 ** (tries - 1)))


class StreamEnd:
    """One end of a connection.

    Args:
        out: Carries what is sent.
        link: What that goes over.

    Attributes:
        send: Sends a message of a size on the wire [B]; see `Stream`.
    """

    def __init__(self, out: Stream, link: Link) -> None:
        self._out, self._link = out, link
        self.send = out.send

    @property
    def closed(self) -> bool:
        """Whether nothing is sent any more."""
        return self._out.closed

    def pause(self) -> None:
        """Nothing waits here: what a program cannot take is for it to drop."""

    def resume(self) -> None:
        """See `pause`."""

    def backlog_bytes(self, now: float) -> float:
        """Bytes that wait before the link [B]."""
        return self._link.backlog_bytes(now)


class Connection:
    """Two streams between two nodes, opened by a handshake of three round trips.

    The round trips are TCP's one and the two of ZeroMQ's greeting and security handshake.

    Args:
        clock: The run's clock.
        out: The link from the opener.
        back: The link to the opener.
        at_peer: Takes what the opener sends.
        at_opener: Takes what the peer sends.
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
        self.opener, self.peer = StreamEnd(self._to_peer, out), StreamEnd(self._to_opener, back)

    def open(
        self, then: Callable[[], object], accepted: Callable[[], object] | None = None
    ) -> None:
        """Shake hands; `then()` when the opener is ready, `accepted()` when the peer is."""
        self._then, self._accepted = then, accepted
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
        """The last word of the opener's handshake has reached the peer."""
        self._to_peer.deliver = self._handlers[0]
        assert self._accepted is not None
        self._accepted()


def _nothing() -> None:
    return None
