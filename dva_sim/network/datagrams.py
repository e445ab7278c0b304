"""Datagrams, as over UDP: no connection, no order, nothing is sent again.

A message that does not fit into one packet travels in fragments, and is lost if one of them is.

References:
    RFC 768 (UDP), RFC 791 (fragments).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from dva_sim.clock import Clock
from dva_sim.network.link import Link

UDP_HEADER, IP_HEADER = 8, 20  # [B]
FRAGMENT = 1480  # payload of a full IPv4 packet on Ethernet [B]

Deliver = Callable[[Any], object]


class DatagramEnd:
    """One end: what it sends travels over `link` and is taken by `deliver` there.

    Attributes:
        closed: Whether what arrives here is thrown away, and nothing is sent.
    """

    other: DatagramEnd

    def __init__(self, clock: Clock, link: Link, deliver: Deliver) -> None:
        self._clock, self._link, self._deliver = clock, link, deliver
        self.closed = False

    def send(self, payload: Any, size: int) -> bool:
        """Send a message of `size` bytes [B]; False if the socket is closed."""
        if self.closed:
            return False
        now, total = self._clock.now, size + UDP_HEADER
        packets = -(-total // FRAGMENT)
        arrival = self._link.carry_train(now, packets, total + packets * IP_HEADER)
        if arrival is None:
            arrival = self._offer_each(now, total)
        if arrival is not None:
            self._clock.call_at(arrival, self.other.take, payload)
        return True

    def take(self, payload: Any) -> None:
        """A message has arrived."""
        if not self.closed:
            self._deliver(payload)

    def pause(self) -> None:
        """Nobody waits: what a program cannot take is for it to drop."""

    def resume(self) -> None:
        """See `pause`."""

    def backlog_bytes(self, now: float) -> float:
        """Bytes that wait before the link [B]."""
        return self._link.backlog_bytes(now)

    def _offer_each(self, now: float, total: int) -> float | None:
        """Send fragment by fragment: when the last arrives [s], None if one is lost."""
        last, whole = 0.0, True
        while total > 0:
            part = min(total, FRAGMENT)
            total -= part
            arrival = self._link.carry(now, part + IP_HEADER)
            if arrival is None:
                whole = False
            else:
                last = max(last, arrival)
        return last if whole else None


class DatagramConnection:
    """Two sockets that know each other: no handshake, and no promise.

    Args:
        clock: The run's clock.
        out: The link from the opener.
        back: The link to the opener.
        at_peer: Takes what the opener sends.
        at_opener: Takes what the peer sends.
    """

    depth: Final = "datagram"
    keeps: Final = False

    def __init__(
        self, clock: Clock, out: Link, back: Link, at_peer: Deliver, at_opener: Deliver
    ) -> None:
        self.opener = DatagramEnd(clock, out, at_opener)
        self.peer = DatagramEnd(clock, back, at_peer)
        self.opener.other, self.peer.other = self.peer, self.opener

    def open(
        self, then: Callable[[], object], accepted: Callable[[], object] | None = None
    ) -> None:
        """Both may send at once."""
        then()
        if accepted is not None:
            accepted()

    def close(self) -> None:
        """The opener closes its socket: what it has sent still arrives, no answer does."""
        self.opener.closed = True

    def drop(self) -> None:
        """Both are closed."""
        self.opener.closed = self.peer.closed = True
