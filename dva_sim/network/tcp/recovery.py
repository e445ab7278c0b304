"""Loss recovery of an end: its beginning, its end, and whether it was needless.

Segments count as lost by time (RACK), or once three later ones have been acknowledged.

References:
    RFC 8985 (RACK, section 6, and the tail-loss probe's verdict), RFC 6675 (three duplicates),
    RFC 6937 (rate reduction), RFC 5681 and 6298 (after a time-out), RFC 3522 (needless recoveries,
    detected by time stamps).
"""

from __future__ import annotations

from math import inf

from typing_extensions import override

from dva_sim.network.tcp.congestion import RateReduction, Reno
from dva_sim.network.tcp.parameters import TcpOptions
from dva_sim.network.tcp.retransmission_timer import MIN_TIMEOUT_S, RoundTrip
from dva_sim.network.tcp.send_queue import Scoreboard, SentSegment

DUPLICATES = 3  # later segments acknowledged that make one count as lost
_MICROSECOND = 1e-6  # resolution of the clock [s]
_PERSISTS = 16  # recoveries for which a widened window stays wide (RFC 8985, section 6.2)


class ByTime:
    """A segment is lost when one sent later has arrived and its own time is over.

    Its time is the latest round trip and a reordering window: a quarter of the shortest
    round trip, more when segments turn out to have been sent again needlessly, nothing
    during recovery as long as no reordering has been seen.

    Attributes:
        round_trip: Round trip of the latest segment delivered [s].
    """

    __slots__ = (
        "_duplicate_round",
        "_furthest",
        "_latest",
        "_latest_end",
        "_persist",
        "_reordering",
        "_steps",
        "_times",
        "round_trip",
    )

    def __init__(self, times: RoundTrip) -> None:
        self._times = times
        self._latest = -1.0
        self._latest_end = 0
        self._furthest = 0
        self.round_trip = 0.0
        self._reordering = False
        self._steps = 1
        self._persist = 0
        self._duplicate_round = -1

    def delivered(self, sent: SentSegment, now: float, echo: float) -> None:
        """Learn from a segment acknowledged at `now` [s] with a time stamp's `echo` [s]."""
        if sent.end > self._furthest:
            self._furthest = sent.end
        elif sent.end < self._furthest and not sent.repeated:
            # It came after a later segment although it was sent only once: the network reorders.
            self._reordering = True
        taken = now - sent.sent_at
        if sent.repeated:
            # A segment out of order does not update the echoed time stamp, which then says nothing.
            earlier = echo < sent.sent_at and not sent.sacked
            if earlier or taken < self._times.minimum - _MICROSECOND:
                return  # an earlier sending of it has arrived
        self.round_trip = taken
        if (sent.sent_at, sent.end) > (self._latest, self._latest_end):
            self._latest = sent.sent_at
            self._latest_end = sent.end

    def needless(self, acknowledged: int, next_byte: int) -> None:
        """Widen the window, once per round trip: a segment arrived twice."""
        if self._duplicate_round < 0 or acknowledged >= self._duplicate_round:
            self._duplicate_round = next_byte
            self._steps += 1
            self._persist = _PERSISTS

    def recovered(self) -> None:
        """Note that a recovery has ended."""
        self._persist -= 1
        if self._persist <= 0:
            self._steps = 1

    def reordering_window(self, board: Scoreboard, recovering: bool) -> float:
        """Return how much later than a round trip a segment may still arrive [s]."""
        if not self._reordering and (recovering or board.sacked >= DUPLICATES):
            return 0.0
        minimum = self._times.minimum
        window = self._steps * minimum / 4 if minimum < inf else 0.0
        return min(window, self._times.smoothed)

    def detect(self, board: Scoreboard, now: float, recovering: bool) -> float:
        """Mark what is lost at `now` [s].

        Returns:
            How long until the next one would be [s]; 0 if none is in doubt.
        """
        patience = self.round_trip + self.reordering_window(board, recovering)
        latest = self._latest
        latest_end = self._latest_end
        wait = 0.0
        for sent in board.queue:
            if sent.sacked or (sent.lost and not sent.resent):
                continue
            at = sent.sent_at
            if at > latest or (at == latest and sent.end >= latest_end):
                continue
            left = at + patience - now
            if left <= _MICROSECOND:
                board.mark_lost(sent)
            elif left > wait:
                wait = left
        return wait

    def on_timeout(self, board: Scoreboard, now: float) -> None:
        """Mark the first segment and those whose time is over (RFC 8985, section 6.3)."""
        patience = self.round_trip + self.reordering_window(board, True)
        for index, sent in enumerate(board.queue):
            if not sent.sacked and (index == 0 or sent.sent_at + patience <= now + _MICROSECOND):
                board.mark_lost(sent)


class ByCount(ByTime):
    """A segment is lost when three that follow it have been acknowledged selectively."""

    __slots__ = ()

    @override
    def detect(self, board: Scoreboard, now: float, recovering: bool) -> float:
        later = board.sacked
        for sent in board.queue:
            if sent.sacked:
                later -= 1
            elif later < DUPLICATES:
                break
            elif not sent.lost:
                board.mark_lost(sent)
        return 0.0

    def on_timeout(self, board: Scoreboard, now: float) -> None:
        """Take everything for lost (RFC 6675, section 5.1)."""
        for sent in board.queue:
            if not sent.sacked:
                board.mark_lost(sent)


OPEN = "open"
RECOVERY = "recovery"
LOSS = "loss"


class Recovery:
    """State of recovery: open, recovering from losses found by acknowledgements, or a time-out.

    Args:
        options: Options of this end.
        times: Its round trip.
        window: Its congestion window.
        board: Segments under way.

    Attributes:
        state: `open`, `recovery` or `loss`.
        losses: Rule by which segments count as lost.
        probe_end: First byte beyond the last tail-loss probe; -1 if none is open.
    """

    __slots__ = (
        "_before",
        "_board",
        "_first_repeat",
        "_limited",
        "_probe_repeats",
        "_reduction",
        "_timed_out",
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
        self._window = window
        self._board = board
        self._limited = options.congestion_window
        self._undo = options.undo
        self.losses = ByTime(times) if options.rack else ByCount(times)
        self.state = OPEN
        self._until = 0
        self._timed_out = -1
        self._before = window.window, window.threshold
        self._first_repeat: float = inf
        self._reduction = RateReduction(0.0, 0)
        self.probe_end = -1
        self._probe_repeats = False

    def repeated(self, now: float) -> None:
        """Note that a segment held to be lost is sent again at `now` [s]."""
        self._first_repeat = min(self._first_repeat, now)

    def doubted(self) -> None:
        """Take an acknowledgement that selects something, or tells of a duplicate.

        Outside of a recovery Linux forgets by it when the last one had sent something again; so
        what a needless time-out has sent twice does not hide that the next is needless, too.
        """
        if self.state == OPEN:
            self._first_repeat = inf

    def sent(self) -> None:
        """Note that a segment leaves, new or again."""
        self._reduction.sent += 1

    def probed(self, end: int, repeats: bool) -> None:
        """Note that a tail-loss probe has been sent, up to byte `end`, new or again."""
        self.probe_end = end
        self._probe_repeats = repeats

    def judge_probe(self, now: float, acknowledged: int, news: bool, duplicate: bool) -> None:
        """Judge whether the probe mended a loss by itself: RFC 8985, section 7.4.

        Args:
            now: Time [s].
            acknowledged: First byte that is missing at the other end.
            news: The acknowledgement moved the left edge or selects something.
            duplicate: Something has arrived twice there.
        """
        if acknowledged < self.probe_end:
            return
        if self._probe_repeats and not duplicate:
            if acknowledged > self.probe_end:
                if self.state == OPEN and self._limited:
                    self._window.window = min(self._window.window, self._window.reduce(now))
            elif news:
                return  # either sending of it may have arrived
        self.probe_end = -1

    def progress(self, acknowledged: int, echo: float) -> None:
        """Judge, as the left edge moved, whether the recovery is over, or was needless."""
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
        """Look for losses; return when a segment in doubt must be checked again [s], or 0."""
        board = self._board
        wait = self.losses.detect(board, now, self.state != OPEN)
        if board.lost and self.state == OPEN:
            self._begin(RECOVERY, next_byte)
            self._reduction = RateReduction(self._window.reduce(now), len(board.queue))
        return now + wait + MIN_TIMEOUT_S if wait else 0.0

    def hold(self, delivered: int, whole: bool) -> bool:
        """Keep the congestion window down while recovering; return True if it does.

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
        """Time out by RFC 5681, equation 4: not for a segment that was sent again already.

        Nor within a recovery, whose threshold is that of the same window. RFC 8985, section 6.3.
        """
        is_another = self.state == LOSS and first > self._timed_out
        if self.state == OPEN or is_another or first >= self._until:
            self._begin(LOSS, next_byte)
            self._window.reduce(now)
        self._timed_out = first
        self.state = LOSS
        self._until = next_byte
        self.losses.on_timeout(self._board, now)
        if self._limited:
            self._window.window = float(self._board.in_flight + 1)

    def _begin(self, state: str, next_byte: int) -> None:
        self._before = self._window.window, self._window.threshold
        self.state = state
        self._until = next_byte
        self.probe_end = -1
        board = self._board
        if not (board.resent or board.queue[0].repeated):
            self._first_repeat = inf  # otherwise that of the recovery before still counts
