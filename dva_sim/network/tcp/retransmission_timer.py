"""Retransmission timer of an end: the event it waits for, its deadline, and the time-out.

The time-out follows the round trip as the sender sees it. The timer is moved far more often than
it rings, and moving it later costs nothing: the event already scheduled looks, when it is due,
whether the deadline has moved on. Only an earlier deadline needs a new event.

Linux keeps such timers in a wheel of several rings, of which each outer one is eight times
coarser: the longer the wait, the later it may ring, and never early. At 250 ticks a second
a wait of 300 ms ends on a grid of 32 ms.

References:
    RFC 6298, section 5 (when the time-out is started and moved), RFC 8985, sections 6.2
    and 7.2 (doubts about reordering, tail-loss probe), RFC 9293, section 3.8.6.1 (probing
    a closed window). Corbet: Reinventing the timer wheel. LWN.net, 2015; seen in our own
    measurements.
"""

from __future__ import annotations

from collections.abc import Callable
from math import ceil, inf

from dva_sim.kernel.clock import Clock
from dva_sim.network.tcp.parameters import TcpOptions
from dva_sim.network.tcp.send_queue import Scoreboard


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
        timeout = min(self.smoothed + spread, self._options.max_rto)
        tick = self._options.tick
        # The margin keeps a rounding error from adding a whole tick.
        self.timeout = ceil(timeout / tick - 1e-6) * tick if tick else timeout

    def shortest(self, rtt: float) -> None:
        """Note a round trip that held no waiting for others [s]."""
        if rtt < self.minimum:
            self.minimum = rtt

    def without_sample(self) -> None:
        """Go on without a sample, as the opening was repeated: RFC 6298, rule 5.7."""
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
            self._round_end = sent
            self._largest = self._floor


_SLACK_S = 1e-6  # resolution of the clock [s]
_INNERMOST = 64  # ticks that the finest ring covers
_COARSER = 8  # factor by which each further ring is coarser


class Timer:
    """One deadline at a time.

    Args:
        clock: The run's clock.
        action: Called when the deadline has come.
        tick: Grid of the finest ring [s]; 0 = exact.

    Attributes:
        deadline: Deadline [s]; infinite if not set.
    """

    __slots__ = ("_action", "_clock", "_due", "_tick", "deadline")

    def __init__(self, clock: Clock, action: Callable[[], object], tick: float = 0.0) -> None:
        self._clock = clock
        self._action = action
        self._tick = tick
        self.deadline = self._due = inf

    def set(self, deadline: float) -> None:
        """Ring at `deadline` [s] and not before, whatever was set earlier."""
        if self._tick:
            now = self._clock.now
            deadline = next_on_grid(now, max(0.0, deadline - now), self._tick)
        self.deadline = deadline
        if deadline < self._due:
            self._schedule(deadline)

    def stop(self) -> None:
        """Cancel the deadline."""
        self.deadline = inf

    def _schedule(self, due: float) -> None:
        self._due = due
        self._clock.call_at(due, self._look, due)

    def _look(self, due: float) -> None:
        if due != self._due:
            return  # an earlier deadline came between
        self._due = inf
        if self.deadline > due + _SLACK_S:
            if self.deadline < inf:
                self._schedule(self.deadline)
            return
        self.deadline = inf
        self._action()


def next_on_grid(now: float, wait: float, tick: float) -> float:
    """Return when a timer set at `now` [s] for `wait` [s] fires, on a grid of `tick` [s].

    The time is rounded down and the wait up to ticks; the ring is then the next one of the
    wheel, never this one.
    """
    ticks = ceil(wait / tick - 1e-6)
    step = 1
    due = int(now / tick + 1e-6) + ticks
    while ticks >= _INNERMOST * step:
        step *= _COARSER
    return (due // step + 1) * step * tick


MIN_TIMEOUT_S = 0.002
"""Time that Linux adds to the waits for a probe and for a segment in doubt (TCP_TIMEOUT_MIN)."""
TIMEOUT = "timeout"
PROBE = "probe"
REORDER = "reorder"
WINDOW = "window"


class Alarm:
    """Alarm of an end: the earliest of its deadlines.

    Args:
        clock: The run's clock.
        options: Options of this end.
        times: Its round trip.
        ring: Called when the time has come.

    Attributes:
        kind: Kind of deadline: a time-out, a tail-loss probe, the end of a doubt about reordering,
            or a closed window's probe.
        back_off: Number of times the time-out has been doubled.
        doubt: Time at which the next segment in doubt counts as lost [s]; 0 if there is none.
    """

    __slots__ = ("_options", "_timeout_at", "_timer", "_times", "back_off", "doubt", "kind")

    def __init__(
        self, clock: Clock, options: TcpOptions, times: RoundTrip, ring: Callable[[], object]
    ) -> None:
        self._options = options
        self._times = times
        self._timer = Timer(clock, ring, options.tick)
        self.kind = TIMEOUT
        self.back_off = 0
        self._timeout_at = self.doubt = 0.0

    def timeout(self) -> float:
        """Return the retransmission time-out with its back-off [s]."""
        return min(self._times.timeout * 2.0**self.back_off, self._options.max_rto)

    def stop(self) -> None:
        """Cancel all deadlines."""
        self._timer.stop()

    def restart(self, now: float) -> None:
        """Wait for a whole time-out from `now` [s] on."""
        self.kind = TIMEOUT
        self.delay_timeout(now)
        self._timer.set(self._timeout_at)

    def fall_back(self, now: float, board: Scoreboard) -> None:
        """Wait for the time-out of the first segment, counted from when it was sent last."""
        self.kind = TIMEOUT
        self._timeout_at = max(now, board.queue[0].sent_at + self.timeout())
        self._timer.set(self._timeout_at)

    def delay_timeout(self, now: float) -> None:
        """Restart the time-out, as the first segment has just been sent again."""
        self._timeout_at = now + self.timeout()

    def watch(
        self, now: float, board: Scoreboard, advanced: bool, fresh: bool, probing: bool
    ) -> None:
        """Set the alarm for segments under way.

        Args:
            now: Time [s].
            board: The segments, at least one.
            advanced: Something was acknowledged in order.
            fresh: Something new was sent.
            probing: True if a tail-loss probe may be sent.
        """
        if not (advanced or self.doubt) and self._stays_set(fresh, probing):
            return
        if advanced:
            self._timeout_at = now + self.timeout()
        elif self.kind != TIMEOUT or self._timer.deadline == inf:
            self._timeout_at = board.queue[0].sent_at + self.timeout()
        self.kind = TIMEOUT
        at = self._timeout_at
        if self.doubt and self.doubt < at:
            self.kind = REORDER
            at = self.doubt
        elif probing and (advanced or fresh):
            self.kind = PROBE
            at = min(at, now + self._probe_time(len(board.queue)))
        self._timer.set(max(at, now))

    def _stays_set(self, fresh: bool, probing: bool) -> bool:
        """Return True if the timer may stay as set; setting it again would round it differently."""
        if self._timer.deadline == inf:
            return False
        if self.kind == PROBE:
            return probing and not fresh
        return self.kind == TIMEOUT and not (probing and fresh)

    def watch_window(self, now: float) -> None:
        """Wait until a closed window should be probed."""
        if self.kind != WINDOW or self._timer.deadline == inf:
            self.kind = WINDOW
            self._timer.set(now + self.timeout())

    def _probe_time(self, segments: int) -> float:
        """Return the delay by RFC 8985, section 7.2; one segment may meet a delayed answer."""
        if not self._times.smoothed:
            return self._options.first_rto
        patience = self._options.min_rto if segments == 1 else MIN_TIMEOUT_S
        return 2 * self._times.smoothed + patience
