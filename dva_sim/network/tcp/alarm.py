"""The one retransmission timer of an end: what it waits for, and until when.

References:
    RFC 6298, section 5 (when the time-out is started and moved), RFC 8985, sections 6.2
    and 7.2 (doubts about reordering, tail-loss probe), RFC 9293, section 3.8.6.1 (probing
    a closed window).
"""

from __future__ import annotations

from collections.abc import Callable
from math import inf

from dva_sim.clock import Clock
from dva_sim.network.tcp.options import TcpOptions
from dva_sim.network.tcp.round_trip import RoundTrip
from dva_sim.network.tcp.scoreboard import Scoreboard
from dva_sim.network.tcp.timer import Timer

TIMEOUT, PROBE, REORDER, WINDOW = "timeout", "probe", "reorder", "window"


class Alarm:
    """Waits for whatever comes first.

    Args:
        clock: The run's clock.
        options: Of this end.
        times: Its round trip.
        ring: Called when the time has come.

    Attributes:
        kind: What it waits for: a time-out, the moment for a tail-loss probe, the end of
            a doubt about reordering, or a closed window's probe.
        back_off: How many times the time-out has been doubled.
        doubt: When the next segment in doubt is held to be lost [s]; 0 if none is.
    """

    __slots__ = ("_options", "_timeout_at", "_timer", "_times", "back_off", "doubt", "kind")

    def __init__(
        self, clock: Clock, options: TcpOptions, times: RoundTrip, ring: Callable[[], object]
    ) -> None:
        self._options, self._times = options, times
        self._timer = Timer(clock, ring, options.tick)
        self.kind, self.back_off = TIMEOUT, 0
        self._timeout_at = self.doubt = 0.0

    def timeout(self) -> float:
        """Retransmission time-out with its back-off [s]."""
        return min(self._times.timeout * 2.0**self.back_off, self._options.max_rto)

    def stop(self) -> None:
        """Wait for nothing."""
        self.kind = TIMEOUT
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
        """The first segment has just been sent again: its time-out begins anew."""
        self._timeout_at = now + self.timeout()

    def watch(
        self, now: float, board: Scoreboard, advanced: bool, fresh: bool, probing: bool
    ) -> None:
        """Set the alarm for segments under way.

        Args:
            now: [s].
            board: The segments, at least one.
            advanced: Something was acknowledged in order.
            fresh: Something new was sent.
            probing: Whether a tail-loss probe may be sent.
        """
        if not (advanced or self.doubt) and self._stands(fresh, probing):
            return
        if advanced:
            self._timeout_at = now + self.timeout()
        elif self.kind != TIMEOUT or self._timer.deadline == inf:
            self._timeout_at = board.queue[0].sent_at + self.timeout()
        self.kind, at = TIMEOUT, self._timeout_at
        if self.doubt and self.doubt < at:
            self.kind, at = REORDER, self.doubt
        elif probing and (advanced or fresh):
            self.kind, at = PROBE, min(at, now + self._probe_time(len(board.queue)))
        self._timer.set(max(at, now))

    def _stands(self, fresh: bool, probing: bool) -> bool:
        """Whether what is set may stay: to set it again would round it differently."""
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
        """RFC 8985, section 7.2: a single segment may meet a delayed acknowledgement."""
        if not self._times.smoothed:
            return self._options.first_rto
        patience = self._options.min_rto if segments == 1 else 0.0
        return 2 * self._times.smoothed + patience
