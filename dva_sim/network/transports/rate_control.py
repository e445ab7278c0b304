"""Laws of rate: how often a datagram may be sent; small state machines without a clock.

A law gets three inputs: the first round trip it may count on, that a round trip has passed
without loss, and that something was lost (once per round trip at most). It answers with the gap
between two datagrams. A rate that nobody used says nothing about the network, so none grows
further while the gap holds nothing back (RFC 7661 gives the reason, for TCP).

What could be read of each law, and what could not, stands with the law. Where the paper's law could
not be read, the law is **in the manner of** the protocol: what it aims at is the paper's, the
formula and every number in it are not, and the numbers are the user's to set.
"""

from __future__ import annotations

import math
from typing import Protocol

from typing_extensions import override


class RateLaw(Protocol):
    """Law that limits how often a datagram may be sent."""

    @property
    def gap(self) -> float:
        """Least time between the starts of two datagrams [s]."""

    def begin(self, round_trip: float) -> None:
        """The first round trip is known [s]."""

    def passed(self, round_trip: float, held: bool) -> None:
        """A round trip [s] has passed without loss; did the gap hold anything back in it?"""

    def lost(self) -> None:
        """Something was lost; told once per round trip."""


class Aimd:
    """Additive increase, multiplicative decrease of a rate; begins with one per round trip.

    The rate r grows by `increase` datagrams per round trip with each round trip R, so
    r <- r + increase / R, and gives up the share `decrease` at a loss, r <- (1 - decrease) r. With
    increase 1 and decrease 0.5 this is RAP without its fine grain (from memory of the paper).

    Args:
        increase: Datagrams per round trip, with each round trip.
        decrease: Share of the rate that a loss costs.

    References:
        R. Rejaie, M. Handley, D. Estrin: RAP, an end-to-end rate-based congestion control mechanism
        for realtime streams in the Internet. INFOCOM 1999.
        D.-M. Chiu, R. Jain: Analysis of the increase and decrease algorithms for congestion
        avoidance in computer networks. Computer Networks and ISDN Systems 17, 1989.
    """

    def __init__(self, increase: float, decrease: float) -> None:
        self.increase, self.decrease = increase, decrease
        self.rate = 0.0

    @property
    def gap(self) -> float:
        """Implement `RateLaw`."""
        return 1.0 / self.rate if self.rate else math.inf

    def begin(self, round_trip: float) -> None:
        """Implement `RateLaw`."""
        self.rate = 1.0 / round_trip

    def passed(self, round_trip: float, held: bool) -> None:
        """Implement `RateLaw`."""
        if held:
            self.rate += self.increase / round_trip

    def lost(self) -> None:
        """Implement `RateLaw`."""
        self.rate *= 1.0 - self.decrease


class ThreeTerms(Aimd):
    """In the manner of the trinomial protocol: a rate of three terms in the time since a loss.

    n round trips R after a loss that left the rate r0, the rate is
    r = r0 + (linear n + square n^2) / R, and the next loss leaves (1 - decrease) r.

    **What could be read**: that it is rate-based over UDP and adapts the gap between packets; that
    it catches up with bandwidth within a short time while its rate stays smooth; that it is said
    to be friendly to TCP, fair within the protocol and efficient; and that it cites the binomial
    laws, SIMD (increase with the square of the time since a loss, multiplicative decrease), RAP.
    **The gap**: the law itself, its three terms and their constants. That the terms are the three
    powers of the time since a loss is ours: constant and linear as in AIMD, square as in SIMD.
    **Simplification**: it steps once per round trip, not with each acknowledgement.

    With square 0, decrease b and linear 3 b / (2 - b) the rate is that of TCP's square-root law
    for the same share of losses (the deterministic saw-tooth).

    Args:
        linear: Datagrams per round trip, with each round trip since the loss.
        square: Coefficient of the square of that time in round trips.
        decrease: Share of the rate that a loss costs.

    References:
        P. X. Liu, M. Meng, X. Ye, J. Gu: An UDP-based protocol for Internet robots. World
        Congress on Intelligent Control and Automation 2002, DOI 10.1109/WCICA.2002.1022068.
        P. X. Liu, M. Q.-H. Meng, S. X. Yang: Data communications for Internet robots. Autonomous
        Robots 15, 2003, DOI 10.1023/A:1026160302776.
        An end-to-end transmission architecture for the remote control of robots over IP networks.
        IEEE/ASME Transactions on Mechatronics 10(5), 2005, DOI 10.1109/TMECH.2005.856110. (Of all
        three only abstracts and lists of references could be read.)
        S. Jin, L. Guo, I. Matta, A. Bestavros: TCP-friendly SIMD congestion control and its
        convergence behavior. ICNP 2001. D. Bansal, H. Balakrishnan: Binomial congestion control
        algorithms. INFOCOM 2001. M. Mathis, J. Semke, J. Mahdavi, T. Ott: The macroscopic behavior
        of the TCP congestion avoidance algorithm. Computer Communication Review 27(3), 1997.
    """

    def __init__(self, linear: float, square: float, decrease: float) -> None:
        super().__init__(linear, decrease)
        self.linear, self.square, self._passed = linear, square, 0

    @override
    def passed(self, round_trip: float, held: bool) -> None:
        if held:
            self._passed += 1
            odd = 2 * self._passed - 1  # from one square to the next
            self.rate += (self.linear + self.square * odd) / round_trip

    @override
    def lost(self) -> None:
        super().lost()
        self._passed = 0


class LeastRoundTrip:
    """In the manner of BTP: as often as possible while the round trip stays at its least.

    While a round trip is not longer than the least one seen by more than `tolerance`, the gap
    shrinks to gap / narrow; when it is, or something is lost, it grows to gap * widen, up to
    `longest`.

    **What could be read**: that it is bilateral, with two flows (the dissertation); that it has a
    congestion control of its own, with which it reaches the least round trip and the least time
    between arrivals for the bandwidth there is, beside TCP flows; that its forerunner ETP decides
    by a state machine how to make both small.
    **The gap**: that state machine, its thresholds and its constants; and how it holds its own
    where others keep the queue full, so that no round trip is near the least. Here it then falls
    back to the longest gap.
    **Simplification**: two states, one step per round trip.

    Args:
        tolerance: Queueing that is taken for none [s].
        widen: Factor of the gap where there is more.
        narrow: Divisor of the gap where there is not.
        longest: Gap [s].

    References:
        R. Wirz, R. Marin, M. Ferre, J. Barrio, J. M. Claver, J. Ortego: Bidirectional transport
        protocol for teleoperated robots. IEEE Transactions on Industrial Electronics 56(9), 2009,
        DOI 10.1109/TIE.2009.2025291.
        The same: Efficient transport protocol for networked haptics applications. EuroHaptics 2008,
        DOI 10.1007/978-3-540-69057-3_1. (Of both only the abstracts could be read.)
    """

    def __init__(self, tolerance: float, widen: float, narrow: float, longest: float) -> None:
        self.tolerance, self.widen, self.narrow = tolerance, widen, narrow
        self.longest, self.least = longest, math.inf
        self.gap = math.inf

    def begin(self, round_trip: float) -> None:
        """Implement `RateLaw`."""
        self.least, self.gap = round_trip, min(round_trip, self.longest)

    def passed(self, round_trip: float, held: bool) -> None:
        """Implement `RateLaw`."""
        self.least = min(self.least, round_trip)
        if round_trip - self.least > self.tolerance:
            self.lost()
        elif held:
            self.gap /= self.narrow

    def lost(self) -> None:
        """Implement `RateLaw`."""
        self.gap = min(self.gap * self.widen, self.longest)
