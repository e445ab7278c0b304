"""Congestion window: slow start, then Reno or CUBIC; in segments.

References:
    RFC 5681 (slow start, Reno), RFC 9438 (CUBIC), RFC 2861 (after idle); Ha, Rhee: Taming
    the elephants: new TCP slow start. Computer Networks 55(9), 2011 (HyStart, its delay
    part; the thresholds are those of RFC 9406, section 4.3).
"""

from __future__ import annotations

from math import inf

from typing_extensions import override

from dva_sim.network.tcp.parameters import TcpOptions

MIN_WINDOW = 2.0  # ssthresh is never below two segments (RFC 5681, equation 4)


class Reno:
    """Additive increase, halving: RFC 5681.

    Attributes:
        window: Congestion window [segments], not always whole.
        threshold: End of slow start [segments].
    """

    BACKOFF = 0.5

    __slots__ = ("_start", "threshold", "window")

    def __init__(self, options: TcpOptions) -> None:
        self._start = float(options.initial_window)
        self.window = self._start
        self.threshold = inf

    def grow(self, segments: int, now: float, ahead: float) -> None:
        """Grow by segments that have been delivered while the window was in use.

        Args:
            segments: Number of segments.
            now: Current time [s].
            ahead: The shortest round trip [s].
        """
        if self.window < self.threshold:
            before = self.window
            self.window = min(self.window + segments, self.threshold)
            segments -= int(self.window - before)
        if segments > 0 and self.window >= self.threshold:
            self._avoid(segments, now, ahead)

    def reduce(self, now: float) -> float:
        """Lower the threshold after a loss and return it [segments]; callers lower the window."""
        self.threshold = max(float(int(int(self.window) * self.BACKOFF)), MIN_WINDOW)
        self.window = float(int(self.window))
        return self.threshold

    def rests(self, now: float) -> None:
        """Note an acknowledgement while the window was not in use."""

    def after_idle(self, idle: float, timeout: float) -> None:
        """Halve for each `timeout` [s] of the `idle` time [s] in which nothing was sent."""
        floor = min(self._start, self.window)
        self.threshold = max(self.threshold, 0.75 * self.window)
        while idle > timeout and self.window > floor:
            self.window = max(self.window / 2, floor)
            idle -= timeout

    def _avoid(self, segments: int, now: float, ahead: float) -> None:
        self.window += segments / self.window


class Cubic(Reno):
    """The window grows with the cube of the time since the last loss: RFC 9438.

    As in Linux everything is in whole segments: the distance to the curve's plateau is
    rounded down, so a small window reaches the plateau soon and stays there for long, while
    what is delivered meanwhile is saved up for the next step; and the curve is read the
    shortest round trip ahead, where the RFC takes the smoothed one.
    """

    BACKOFF = 0.7
    C = 0.4
    FRIENDLY = 3 * (1 - BACKOFF) / (1 + BACKOFF)

    __slots__ = ("_epoch", "_estimate", "_inflection", "_last", "_peak", "_plateau", "_saved")

    def __init__(self, options: TcpOptions) -> None:
        super().__init__(options)
        self._peak = self._plateau = self._inflection = self._estimate = 0.0
        self._epoch = -1.0
        self._last = 0.0
        self._saved = 0

    @override
    def reduce(self, now: float) -> float:
        # With fast convergence (RFC 9438, section 4.7).
        self._epoch = -1.0
        self._saved = 0
        whole = float(int(self.window))
        falling = whole < self._peak
        self._peak = float(int(whole * (1 + self.BACKOFF) / 2)) if falling else whole
        return super().reduce(now)

    def rests(self, now: float) -> None:
        """Leave out time in which the window is not used (RFC 9438, section 5.8)."""
        if self._epoch >= 0:
            self._epoch += now - self._last
        self._last = now

    def curve(self, elapsed: float) -> float:
        """Return W_cubic, `elapsed` [s] after the epoch's start [segments]: RFC 9438, figure 1."""
        return self._plateau + int(self.C * (elapsed - self._inflection) ** 3)

    def _avoid(self, segments: int, now: float, ahead: float) -> None:
        if self._epoch < 0:
            self._begin(now)
        self._last = now
        self._estimate += self.FRIENDLY * segments / self.window
        target = max(self.curve(now - self._epoch + ahead), int(self._estimate))
        price = self._price(target)
        if self._saved >= price:
            # Credit saved at a higher price is applied gently, as by Linux's tcp_cong_avoid_ai.
            self._saved = 0
            self.window += 1.0
        self._saved += segments
        steps = self._saved // price
        self._saved -= steps * price
        self.window += steps

    def _price(self, target: float) -> int:
        """Return how many delivered segments open the window by one; at least two."""
        if target <= self.window:
            return int(100 * self.window)  # hardly any growth, as in Linux
        return max(2, int(self.window / (target - self.window)))

    def _begin(self, now: float) -> None:
        """Begin a new epoch: where the curve has its inflection (RFC 9438, figure 2)."""
        self._epoch = now
        self._estimate = self.window
        self._plateau = max(self._peak, self.window)
        self._inflection = float(((self._plateau - self.window) / self.C) ** (1 / 3))


class HyStart:
    """End of slow start when the round trip grows, before the queue overflows.

    Rounds go from flight to flight. From a window of 16 segments on, the shortest of the
    round trips of a round, if they are more than eight, is compared with the shortest ever:
    an eighth more (at least 4 ms, at most 16 ms) means that a queue has built up.
    """

    SAMPLES = 8
    LOW_WINDOW = 16
    LEAST = 0.004
    MOST = 0.016

    __slots__ = ("_count", "_end", "_shortest")

    def __init__(self) -> None:
        self._end = -1
        self._count = 0
        self._shortest = inf

    def ends(self, window: float, rtt: float, minimum: float, acknowledged: int, sent: int) -> bool:
        """Return True if slow start should end.

        Args:
            window: Congestion window [segments].
            rtt: One more round trip [s].
            minimum: The shortest so far [s].
            acknowledged: First byte not acknowledged.
            sent: First byte not sent: the end of the next round.
        """
        verdict = False
        if window >= self.LOW_WINDOW:
            self._shortest = min(self._shortest, rtt)
            verdict = self._count == self.SAMPLES and self._grown(minimum)
            self._count = min(self._count + 1, self.SAMPLES)
        if acknowledged > self._end:
            self._end = sent
            self._count = 0
            self._shortest = inf
        return verdict

    def _grown(self, minimum: float) -> bool:
        return self._shortest > minimum + min(max(minimum / 8, self.LEAST), self.MOST)


class Unlimited(Reno):
    """No congestion window at all."""

    __slots__ = ()

    def __init__(self, options: TcpOptions) -> None:
        super().__init__(options)
        self.window = 1e9

    def grow(self, segments: int, now: float, ahead: float) -> None:
        """Do nothing: there is nothing to grow."""

    def reduce(self, now: float) -> float:
        """Return the window: there is nothing to reduce."""
        return self.window


def make_window(options: TcpOptions) -> Reno:
    """Return the congestion window that the options ask for."""
    if not options.congestion_window:
        return Unlimited(options)
    return Cubic(options) if options.congestion == "cubic" else Reno(options)


class RateReduction:
    """Proportional rate reduction: number of segments that may leave during recovery.

    The conservative bound, and one more when the acknowledgement moved the left edge.

    References:
        RFC 6937.
    """

    __slots__ = ("_at_start", "_delivered", "_threshold", "sent")

    def __init__(self, threshold: float, in_flight: int) -> None:
        self._threshold = threshold
        self._at_start = max(1, in_flight)
        self._delivered = self.sent = 0

    def allows(self, delivered: int, in_flight: int, advanced: bool) -> int:
        """Return segments that may leave now.

        Args:
            delivered: Segments newly acknowledged, selectively or not.
            in_flight: Segments on their way by the sender's estimate.
            advanced: True if the left edge moved and no further loss was found.
        """
        self._delivered += delivered
        if in_flight > self._threshold:
            share = -(-self._delivered * self._threshold // self._at_start)
            allowed = share - self.sent
        else:
            allowed = max(self._delivered - self.sent, delivered) + advanced
            allowed = min(self._threshold - in_flight, allowed)
        return max(int(allowed), 0 if self.sent else 1)
