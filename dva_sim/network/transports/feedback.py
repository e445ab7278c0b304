"""Acknowledgements as the sender reads them: round trips, losses, and when to give up.

Each datagram is acknowledged by its number, and an acknowledgement repeats those before it, so
that a lost one costs nothing. A datagram is lost when three later ones were acknowledged (the
threshold of RFC 5681), or when nothing was heard for as long as RFC 6298 says.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

REORDERED = 3  # later datagrams acknowledged that make one count as lost: RFC 5681
FIRST_TIMEOUT = 1.0  # time-out before the first measurement [s]: RFC 6298
MIN_TIMEOUT = 1.0  # shortest time-out [s]: RFC 6298
MAX_TIMEOUT = 60.0  # longest time-out [s]: RFC 6298
REPEATED = 32  # datagrams covered by an acknowledgement: the bits of a word; assumed
Echo = tuple[int, float]  # a datagram's number, and since when it had been there [s]


class RoundTrips:
    """Smoothed round trip and time-out.

    Attributes:
        smoothed: [s], or None before the first sample.

    References:
        RFC 6298.
    """

    def __init__(self) -> None:
        self.smoothed: float | None = None
        self._variation = 0.0
        self._backoff = 1.0

    @property
    def timeout(self) -> float:
        """Time to wait for feedback before giving up [s]."""
        if self.smoothed is None:
            return min(FIRST_TIMEOUT * self._backoff, MAX_TIMEOUT)
        plain = max(self.smoothed + 4.0 * self._variation, MIN_TIMEOUT)
        return min(plain * self._backoff, MAX_TIMEOUT)

    def add(self, sample: float) -> None:
        """Learn from a round trip [s]."""
        if self.smoothed is None:
            self.smoothed = sample
            self._variation = 0.5 * sample
        else:
            self._variation += 0.25 * (abs(sample - self.smoothed) - self._variation)
            self.smoothed += 0.125 * (sample - self.smoothed)
        self._backoff = 1.0

    def back_off(self) -> None:
        """Back off after a time-out: wait twice as long the next time."""
        self._backoff *= 2.0


class Feedback:
    """Unacknowledged datagrams.

    Attributes:
        round_trips: Statistics of round trips.
        lost: Number considered lost.
        samples: Round trips since somebody emptied the list [s].
    """

    def __init__(self) -> None:
        self.round_trips = RoundTrips()
        self.lost = 0
        self._pending: dict[int, float] = {}  # in order of sending
        self._passed_by: dict[int, int] = {}
        self._heard = 0.0
        self.samples: list[float] = []

    @property
    def deadline(self) -> float:
        """Time at which everything pending is given up, unless feedback arrives [s]."""
        if not self._pending:
            return math.inf
        oldest = next(iter(self._pending.values()))
        return max(oldest, self._heard) + self.round_trips.timeout

    def sent(self, now: float, number: int) -> None:
        """Note that datagram `number` was sent at `now` [s]."""
        self._pending[number] = now

    def acknowledged(self, now: float, echoes: Sequence[Echo]) -> list[int]:
        """Take an acknowledgement.

        Args:
            now: [s]
            echoes: Numbers of datagrams, oldest first, each with how long the other side had it
                before it answered [s].

        Returns:
            Datagrams that are lost, as this one shows.
        """
        gone: list[int] = []
        for number, hold in echoes:
            sent = self._pending.pop(number, None)
            if sent is not None:
                self._heard = now
                self.samples.append(now - sent - hold)
                self.round_trips.add(self.samples[-1])
                # Earlier datagrams count as lost once enough later ones were acknowledged.
                earlier = [n for n in self._pending if n < number]
                for n in earlier:
                    self._passed_by[n] = self._passed_by.get(n, 0) + 1
                gone += self._drop(n for n in earlier if self._passed_by[n] >= REORDERED)
        return gone

    def give_up(self) -> list[int]:
        """Give up everything pending after the time-out."""
        self.round_trips.back_off()
        return self._drop(self._pending)

    def _drop(self, numbers: Iterable[int]) -> list[int]:
        gone = list(numbers)
        for number in gone:
            del self._pending[number]
            self._passed_by.pop(number, None)
        self.lost += len(gone)
        return gone
