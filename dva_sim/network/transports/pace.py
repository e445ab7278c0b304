"""Pace of the datagrams: a law of rate, and the round trips it goes by."""

from __future__ import annotations

import math

from dva_sim.network.transports.feedback import Feedback

FIRST_FLIGHT = 10  # datagrams before the first answer: the initial window of RFC 6928


class Aimd:
    """Additive increase, multiplicative decrease of a rate; begins with one per round trip.

    The rate r grows by `increase` datagrams per round trip with each round trip R, so
    r <- r + increase / R, and gives up the share `decrease` at a loss, r <- (1 - decrease) r. With
    increase 1 and decrease 0.5 this is RAP without its fine grain (from memory of the paper). It
    never gives up the last datagram of a round trip. A rate that nobody used says nothing about the
    network, so it does not grow while the gap holds nothing back (RFC 7661 gives the reason).

    Args:
        increase: Datagrams per round trip, with each round trip.
        decrease: Share of the rate that a loss costs.
        tolerance: Queueing in the round trip beyond which it counts as a loss [s].

    References:
        R. Rejaie, M. Handley, D. Estrin: RAP, an end-to-end rate-based congestion control mechanism
        for realtime streams in the Internet. INFOCOM 1999.
        D.-M. Chiu, R. Jain: Analysis of the increase and decrease algorithms for congestion
        avoidance in computer networks. Computer Networks and ISDN Systems 17, 1989.
    """

    def __init__(self, increase: float, decrease: float, tolerance: float = math.inf) -> None:
        self.increase = increase
        self.decrease = decrease
        self.tolerance = tolerance
        self.rate = 0.0
        self._least = math.inf
        self._last = math.inf

    @property
    def gap(self) -> float:
        """Least time between the starts of two datagrams [s]."""
        return 1.0 / self.rate if self.rate else math.inf

    def begin(self, round_trip: float) -> None:
        """Take in the first round trip [s]."""
        self.rate = 1.0 / round_trip
        self._least = self._last = round_trip

    def passed(self, round_trip: float, is_held: bool) -> None:
        """Take in a round trip [s] without loss; `is_held`: the gap held something back in it."""
        self._least = min(self._least, round_trip)
        self._last = round_trip
        if round_trip - self._least > self.tolerance:
            self.lost()
        elif is_held:
            self.rate += self.increase / round_trip

    def lost(self) -> None:
        """Take in a loss; called at most once per round trip."""
        self.rate = max((1.0 - self.decrease) * self.rate, 1.0 / self._last)


class Pace:
    """A law, and the round trips that it goes by.

    Args:
        law: Law that decides how often a datagram may be sent.
        feedback: Source of round trips.

    Attributes:
        held: True if the gap has delayed a message since the round trip began.
    """

    def __init__(self, law: Aimd, feedback: Feedback) -> None:
        self._law = law
        self._feedback = feedback
        self._begun = False
        self._unanswered = 0
        self.held = False
        self._since = 0.0
        self._deaf_until = 0.0

    @property
    def gap(self) -> float:
        """Between two datagrams [s]; unanswered, a first flight, and then one per time-out."""
        if self._begun:
            return self._law.gap
        return self._feedback.round_trips.timeout if self._unanswered >= FIRST_FLIGHT else 0.0

    def sent(self) -> None:
        """Note that a datagram was sent."""
        self._unanswered += 1

    def heard(self, now: float) -> None:
        """Take an acknowledgement at `now` [s]; perhaps a round trip has passed."""
        samples = self._feedback.samples
        smoothed = self._feedback.round_trips.smoothed
        if not samples or smoothed is None:
            return
        if not self._begun:
            self._begun = True
            self._since = now
            self._law.begin(samples[0])
        elif now - self._since >= smoothed:
            self._law.passed(sum(samples) / len(samples), self.held)
            self._restart(now)

    def lost(self, now: float) -> None:
        """Note a loss that is known at `now` [s]."""
        if self._begun and now >= self._deaf_until:
            self._law.lost()
            self._deaf_until = now + (self._feedback.round_trips.smoothed or 0.0)
            self._restart(now)

    def _restart(self, now: float) -> None:
        self._feedback.samples.clear()
        self._since = now
        self.held = False
