"""What an end does about losses: when it recovers, how far, and whether it was needless.

References:
    RFC 8985 (RACK and the tail-loss probe's verdict), RFC 6937 (rate reduction), RFC 5681
    and 6298 (after a time-out), RFC 3522 (needless recoveries, told by time stamps).
"""

from __future__ import annotations

from math import inf

from dva_sim.network.tcp.congestion import RateReduction, Reno
from dva_sim.network.tcp.losses import ByCount, ByTime
from dva_sim.network.tcp.options import TcpOptions
from dva_sim.network.tcp.round_trip import RoundTrip
from dva_sim.network.tcp.scoreboard import Scoreboard

OPEN, RECOVERY, LOSS = "open", "recovery", "loss"


class Recovery:
    """Open, recovering from losses found by acknowledgements, or from a time-out.

    Args:
        options: Of this end.
        times: Its round trip.
        window: Its congestion window.
        board: What it has under way.

    Attributes:
        state: `open`, `recovery` or `loss`.
        losses: The judge of what is lost.
        probe_end: First byte beyond the last tail-loss probe; -1 if none is open.
    """

    __slots__ = (
        "_before",
        "_board",
        "_first_repeat",
        "_limited",
        "_probe_repeats",
        "_reduction",
        "_undo",
        "_until",
        "_window",
        "losses",
        "probe_end",
        "state",
    )

    def __init__(
        self, options: TcpOptions, times: RoundTrip, window: Reno, board: Scoreboard
    ) -> None:
        self._window, self._board = window, board
        self._limited, self._undo = options.congestion_window, options.undo
        self.losses = ByTime(times) if options.rack else ByCount(times)
        self.state, self._until = OPEN, 0
        self._before = window.window, window.threshold
        self._first_repeat: float = inf
        self._reduction = RateReduction(0.0, 0)
        self.probe_end, self._probe_repeats = -1, False

    def repeated(self, now: float) -> None:
        """A segment held to be lost is sent again at `now` [s]."""
        self._first_repeat = min(self._first_repeat, now)

    def sent(self) -> None:
        """A segment leaves, new or again."""
        self._reduction.sent += 1

    def probed(self, end: int, repeats: bool) -> None:
        """A tail-loss probe has been sent, up to byte `end`, new or again."""
        self.probe_end, self._probe_repeats = end, repeats

    def judge_probe(self, now: float, acknowledged: int, news: bool, duplicate: bool) -> None:
        """Did the probe mend a loss by itself? RFC 8985, section 7.4.

        Args:
            now: [s].
            acknowledged: First byte that is missing at the other end.
            news: The acknowledgement moved the left edge or selects something.
            duplicate: Something has arrived twice there.
        """
        if acknowledged < self.probe_end:
            return
        if self._probe_repeats and not duplicate:
            if acknowledged > self.probe_end:
                self._mended(now)
            elif news:
                return  # either sending of it may have arrived
        self.probe_end = -1

    def progress(self, acknowledged: int, echo: float) -> None:
        """The left edge moved: is the recovery over, or was it needless?"""
        if self.state == OPEN:
            return
        over = acknowledged >= self._until
        needless = self._undo and echo < self._first_repeat
        if needless and (over or self.state == LOSS or not self._board.resent):
            window, threshold = self._before
            self._window.window = max(self._window.window, window)
            self._window.threshold = max(self._window.threshold, threshold)
            self._board.forgive()
            self.state = OPEN
        elif over:
            if self.state == RECOVERY and self._limited:
                self._window.window = self._window.threshold
            self.losses.recovered()
            self.state = OPEN

    def find(self, now: float, next_byte: int) -> float:
        """Look for losses; returns when one in doubt is to be looked at again [s], or 0."""
        board = self._board
        wait = self.losses.detect(board, now, self.state != OPEN)
        if board.lost and self.state == OPEN:
            self._begin(RECOVERY, next_byte)
            self._reduction = RateReduction(self._window.reduce(now), len(board.queue))
        return now + wait if wait else 0.0

    def hold(self, delivered: int, whole: bool) -> bool:
        """Keep the congestion window down while recovering; returns whether it does.

        Args:
            delivered: Segments newly acknowledged.
            whole: The left edge moved and nothing more was found lost.
        """
        if self.state == RECOVERY and self._limited:
            in_flight = self._board.in_flight
            allowed = self._reduction.allows(delivered, in_flight, whole)
            self._window.window = float(in_flight + allowed)
        return self.state == RECOVERY

    def time_out(self, now: float, first: int, next_byte: int) -> None:
        """RFC 5681, equation 4, once per window; RFC 8985, section 6.3."""
        if self.state == OPEN or first >= self._until:
            self._begin(LOSS, next_byte)
            self._window.reduce(now)
        self.state, self._until = LOSS, next_byte
        self.losses.on_timeout(self._board, now)
        if self._limited:
            self._window.window = float(self._board.in_flight + 1)

    def _begin(self, state: str, next_byte: int) -> None:
        self._before = self._window.window, self._window.threshold
        self.state, self._until, self.probe_end = state, next_byte, -1
        board = self._board
        if not (board.resent or board.queue[0].repeated):
            self._first_repeat = inf  # otherwise the one of the recovery before still counts

    def _mended(self, now: float) -> None:
        if self.state == OPEN and self._limited:
            self._window.window = min(self._window.window, self._window.reduce(now))
