"""Which segments are lost: by time (RACK), or by three later ones acknowledged.

References:
    RFC 8985 (RACK), section 6; RFC 6675 (three duplicates).
"""

from __future__ import annotations

from math import inf

from dva_sim.network.tcp.round_trip import RoundTrip
from dva_sim.network.tcp.scoreboard import Scoreboard, Sent

DUPLICATES = 3
_MICROSECOND = 1e-6  # the clock's step
_PERSISTS = 16  # recoveries for which a widened window stays wide (RFC 8985, section 6.2)


class ByTime:
    """A segment is lost when one sent later has arrived and its own time is over.

    Its time is the latest round trip and a reordering window: a quarter of the shortest
    round trip, more when segments turn out to have been sent again needlessly, nothing
    during recovery as long as no reordering has been seen.

    Attributes:
        round_trip: Of the latest segment delivered [s].
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
        self._latest, self._latest_end, self._furthest = -1.0, 0, 0
        self.round_trip = 0.0
        self._reordering = False
        self._steps, self._persist, self._duplicate_round = 1, 0, -1

    def delivered(self, sent: Sent, now: float, echo: float) -> None:
        """Learn from a segment acknowledged at `now` [s] with a time stamp's `echo` [s]."""
        if sent.end > self._furthest:
            self._furthest = sent.end
        elif sent.end < self._furthest and not sent.repeated:
            self._reordering = True
        taken = now - sent.sent_at
        if sent.repeated:
            # out of order, the time stamp that comes back is an older one and tells nothing
            earlier = echo < sent.sent_at and not sent.sacked
            if earlier or taken < self._times.minimum - _MICROSECOND:
                return  # an earlier sending of it has arrived
        self.round_trip = taken
        if (sent.sent_at, sent.end) > (self._latest, self._latest_end):
            self._latest, self._latest_end = sent.sent_at, sent.end

    def needless(self, acknowledged: int, next_byte: int) -> None:
        """A segment arrived twice: widen the window, once per round trip."""
        if self._duplicate_round < 0 or acknowledged >= self._duplicate_round:
            self._duplicate_round = next_byte
            self._steps += 1
            self._persist = _PERSISTS

    def recovered(self) -> None:
        """A recovery has ended."""
        self._persist -= 1
        if self._persist <= 0:
            self._steps = 1

    def reordering_window(self, board: Scoreboard, recovering: bool) -> float:
        """How much later than a round trip a segment may still come [s]."""
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
        latest, latest_end, wait = self._latest, self._latest_end, 0.0
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

    def detect(self, board: Scoreboard, now: float, recovering: bool) -> float:
        """See `ByTime`; there is nothing to wait for."""
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
        """Everything is lost (RFC 6675, section 5.1)."""
        for sent in board.queue:
            if not sent.sacked:
                board.mark_lost(sent)
