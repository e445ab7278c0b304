"""A TCP connection over two links: two ends and how they are opened."""

from __future__ import annotations

from collections.abc import Callable

from dva_sim.kernel.clock import Clock
from dva_sim.network.link import Link
from dva_sim.network.tcp.endpoint import TcpEndpoint, _nothing
from dva_sim.network.tcp.parameters import TcpOptions
from dva_sim.network.tcp.retransmission_timer import Timer

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
      the second segment, and when the program has read all, nothing goes back, and the last
      segment is small or ends what was written (RFC 1122, PSH);
    - time-out with variance, floor and doubling (RFC 6298), tail-loss probe and loss by
      time (RFC 8985), rate reduction (RFC 6937), recoveries taken back (RFC 3522);
    - congestion window: ten segments at first (RFC 6928), slow start and Reno (RFC 5681),
      CUBIC (RFC 9438), HyStart by delay, shrinking when idle (RFC 2861), no growth when
      it is not used;
    - Nagle's algorithm where TCP_NODELAY is not set, as ZeroMQ sets it (RFC 896);
    - send buffer in charged bytes, tuned or fixed; receive window, tuned or fixed, with
      probes when it is closed (RFC 9293); giving up after 15 time-outs (tcp_retries2);
    - finishing: what was written is still delivered, what comes late is reset.

    Not modelled: the bytes of selective acknowledgements, F-RTO (RFC 5682), the
    acknowledgement-train part of HyStart, ECN, pacing, segmentation offload, keep-alive, path
    MTU, bytes charged to the receive buffer beyond the payload, the states after finishing.

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
        self._clock = clock
        self._out = out
        self._back = back
        self._options = opener or TcpOptions()
        peer = peer or TcpOptions()
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
        self._then = then
        self._accepted = accepted or _nothing
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
        tried = self._asked
        linear = self._options.syn_linear
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
        """Send the peer's answer to an opening segment, with the time stamp it echoes."""
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
        """Accept the first segment after the answer, which makes the peer established too."""
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
