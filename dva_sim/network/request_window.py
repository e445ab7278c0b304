"""Window of unanswered requests that keeps the command in force youngest.

Too few, and commands become rare; too many, and each waits behind others, on the link or at the
robot. The window follows two estimates, both from the times of answers: the round trip without a
queue, and the rate at which requests are worked on.

References:
    The queue as what a round trip takes beyond the least one: L. S. Brakmo, L. L. Peterson, TCP
    Vegas, IEEE J. Sel. Areas Commun. 13 (1995). Least round trip and greatest rate, each over a
    while: N. Cardwell et al., BBR, ACM Queue 14 (2016).
"""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

MAX_UNANSWERED = 64  # maximum window; a second each way needs 20 at ten commands a second
_FIRST = 4  # initial window [requests]
_QUEUE = 0.5  # backlog above which a queue counts as seen [requests]
_ROUND_TRIP_S = 30.0  # time over which the least round trip counts: paths may become longer [s]
_RATE_S = 10.0  # time over which the greatest rate counts; then one request more is tried [s]


class _Round(NamedTuple):
    """Round of requests: its end [s], least round trip [s], and rate of answers [Hz]."""

    end: float
    least: float
    rate: float


class RequestWindow:
    """Window of unanswered requests for the youngest command in force.

    Until a queue is seen the window grows, twofold each round trip at first, while commands wait
    for it. Once one is seen, it is what the two estimates say, until they are too old.

    Args:
        rate_hz: Wanted commands per second.

    Attributes:
        size: Number of requests that may be unanswered now.
        unanswered: Number of unanswered requests.
    """

    def __init__(self, rate_hz: float) -> None:
        self._period = 1.0 / rate_hz
        self.size = _FIRST
        self.unanswered = 0
        self._rounds: deque[_Round] = deque()
        self._trips: list[float] = []
        self._sent = self._last_of_round = 0
        self._round_began: float | None = None
        self._queue_seen: float | None = None
        self._was_short = False
        self._doubles = True

    @property
    def is_open(self) -> bool:
        """Return True if a request may be sent now; where not, the window was too short."""
        if self.unanswered < self.size:
            return True
        self._was_short = True
        return False

    def sent(self) -> int:
        """Count a request that is sent; return its number."""
        self.unanswered += 1
        self._sent += 1
        return self._sent

    def answered(self, number: int, round_trip: float, now: float) -> None:
        """Take in an answer.

        Args:
            number: Number of its request.
            round_trip: Time from the request to the answer [s].
            now: Time [s].
        """
        self.unanswered -= 1
        self._trips.append(round_trip)
        # A rate needs two answers and time, a round the answers to all that was sent before it.
        is_over = number >= self._last_of_round and len(self._trips) > 1
        if is_over and now != self._round_began:
            self._end_round(now)

    def _end_round(self, now: float) -> None:
        began = self._round_began
        rate = 0.0 if began is None else len(self._trips) / (now - began)
        self._rounds.append(_Round(now, min(self._trips), rate))
        while self._rounds[0].end < now - _ROUND_TRIP_S:
            self._rounds.popleft()
        least = min(each.least for each in self._rounds)
        if self.size * (1.0 - least / self._rounds[-1].least) > _QUEUE:
            self._queue_seen = now
            self._doubles = False
        rates = [each.rate for each in self._rounds if each.end > now - _RATE_S]
        if self._queue_seen is not None and now - self._queue_seen < _RATE_S and max(rates) > 0.0:
            self.size = min(self.size + 1, self._youngest(least, max(rates)))
        elif self._was_short:
            self.size = min(MAX_UNANSWERED, 2 * self.size if self._doubles else self.size + 1)
        self._trips = []
        self._was_short = False
        self._last_of_round = self._sent
        self._round_began = now

    def _youngest(self, round_trip: float, rate: float) -> int:
        """Return the window with the least wait in a queue and half a time between commands."""
        few = max(1, int(round_trip * rate))

        def age(size: int) -> float:
            between = max(round_trip / size, 1.0 / rate, self._period)
            return max(0.0, size / rate - round_trip) + 0.5 * between

        return min((few, few + 1), key=age)
