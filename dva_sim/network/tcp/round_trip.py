"""The round trip as the sender sees it, and the retransmission time-out that follows."""

from __future__ import annotations

from math import ceil, inf

from dva_sim.network.tcp.options import TcpOptions


class RoundTrip:
    """Smoothed round trip, its variation, its minimum.

    RFC 6298 with what Linux adds: the variance part of the time-out has a floor (200 ms)
    instead of the whole; it follows the largest variation seen within a round trip and
    falls by a quarter of the difference once per round trip; a sample far below the
    average, which means that things got better, hardly raises it.

    References:
        RFC 6298; Sarolahti, Kuznetsov: Congestion Control in Linux TCP. USENIX Annual
        Technical Conference, FREENIX Track, 2002 (the variation).

    Attributes:
        smoothed: SRTT [s]; 0 before the first sample.
        minimum: The shortest so far [s].
        timeout: RTO without back-off [s], in whole ticks.
    """

    __slots__ = (
        "_floor",
        "_largest",
        "_options",
        "_round_end",
        "_variation",
        "minimum",
        "smoothed",
        "timeout",
        "variance",
    )

    def __init__(self, options: TcpOptions) -> None:
        self._options = options
        self._floor = options.min_rto / 4
        self.smoothed = self.variance = self._variation = self._largest = 0.0
        self._round_end = 0
        self.minimum = inf
        self.timeout = options.first_rto

    def sample(self, rtt: float, acknowledged: int, sent: int) -> None:
        """Take one measurement.

        Args:
            rtt: The round trip [s].
            acknowledged: First byte not acknowledged.
            sent: First byte not sent: where the next round trip ends.
        """
        if self.smoothed:
            self._follow(rtt, acknowledged, sent)
        else:
            self.smoothed = max(rtt, 1e-6)
            self._variation = rtt / 2
            self.variance = self._largest = max(self._variation, self._floor)
            self._round_end = sent
        spread = 4 * self.variance if self._options.rtt_variance else self._options.min_rto
        timeout, tick = min(self.smoothed + spread, self._options.max_rto), self._options.tick
        self.timeout = ceil(timeout / tick - 1e-6) * tick if tick else timeout

    def shortest(self, rtt: float) -> None:
        """Note a round trip that held no waiting for others [s]."""
        if rtt < self.minimum:
            self.minimum = rtt

    def without_sample(self) -> None:
        """The opening was repeated, so it measured nothing: RFC 6298, rule 5.7."""
        self.timeout = max(self.timeout, 3.0)

    def _follow(self, rtt: float, acknowledged: int, sent: int) -> None:
        error = rtt - self.smoothed
        self.smoothed += error / 8
        surplus = abs(error) - self._variation
        better = error < 0 and surplus > 0
        self._variation += surplus / 32 if better else surplus / 4
        self._largest = max(self._largest, self._variation)
        self.variance = max(self.variance, self._largest)
        if acknowledged > self._round_end:
            self.variance -= (self.variance - self._largest) / 4
            self._round_end, self._largest = sent, self._floor
