"""Pace of the datagrams: a law of congestion control, and the round trips it goes by."""

from __future__ import annotations

from dva_sim.network.transports.feedback import Feedback
from dva_sim.network.transports.rate_control import RateLaw

FIRST_FLIGHT = 10  # datagrams before the first answer: the initial window of RFC 6928


class Pace:
    """A law, and the round trips that it goes by.

    Args:
        law: Law that decides how often a datagram may be sent.
        feedback: Source of round trips.

    Attributes:
        held: True if the gap has delayed a message since the round trip began.
    """

    def __init__(self, law: RateLaw, feedback: Feedback) -> None:
        self._law, self._feedback = law, feedback
        self._begun, self._unanswered, self.held = False, 0, False
        self._since, self._deaf_until = 0.0, 0.0

    @property
    def gap(self) -> float:
        """Between two datagrams [s]; unanswered, a first flight, and then one per time-out."""
        if self._begun:
            return self._law.gap
        return self._feedback.round_trips.timeout if self._unanswered >= FIRST_FLIGHT else 0.0

    def sent(self) -> None:
        """A datagram was sent."""
        self._unanswered += 1

    def heard(self, now: float) -> None:
        """An acknowledgement has come at `now` [s]; perhaps a round trip has passed."""
        samples, smoothed = self._feedback.samples, self._feedback.round_trips.smoothed
        if not samples or smoothed is None:
            return
        if not self._begun:
            self._begun, self._since = True, now
            self._law.begin(samples[0])
        elif now - self._since >= smoothed:
            self._law.passed(sum(samples) / len(samples), self.held)
            self._restart(now)

    def lost(self, now: float) -> None:
        """Something is lost, as is known at `now` [s]."""
        if self._begun and now >= self._deaf_until:
            self._law.lost()
            self._deaf_until = now + (self._feedback.round_trips.smoothed or 0.0)
            self._restart(now)

    def _restart(self, now: float) -> None:
        self._feedback.samples.clear()
        self._since, self.held = now, False
