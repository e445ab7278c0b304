"""One open-loop move after the other, each followed by a wait until its result is seen.

References:
    W. R. Ferrell: Remote manipulation with transmission delay. IEEE Trans. Human Factors in
    Electronics HFE-6 (1965): who cannot wait for the picture moves, waits, and moves again.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from dva_sim.agents.steering import Route

SETTLED_FOR = 0.3  # the picture must stand still for so long [s]; assumed
STILL = 0.2  # slower than this share of the move, what is seen stands; assumed
SHORT = 0.5  # no part of a move is shorter: it is made slower instead [s]; assumed
PATIENCE = 3.0  # no motion seen after so many times the usual wait: one moves again; assumed

Pair = tuple[float, float]
Part = tuple[float, float, float]  # how long [s], and two wanted values


class Moves:
    """What a person does who moves and waits.

    Args:
        reaction: Of the person [s].

    Attributes:
        waits: How often it has waited.
    """

    def __init__(self, reaction: float) -> None:
        self._reaction = reaction
        self.waits = 0
        self._parts: list[Part] = []  # the first number is when it ends
        self._peak = 0.0
        self._ended: float | None = None  # since when one waits
        self._was_seen = True
        self._still_since: float | None = None

    def usual_wait(self, delay: float) -> float:
        """How long a wait takes if all goes well, at this delay [s]."""
        return delay + max(self._reaction, SETTLED_FOR)

    @property
    def rests(self) -> bool:
        """Whether no move is being made."""
        return not self._parts

    def halt(self, now: float, peak: float) -> None:
        """Something moves that was no move of this kind: let go at `now` [s], and wait."""
        self.waits += 1
        self._parts, self._peak, self._ended, self._was_seen = [], peak, now, True

    def begin(self, now: float, parts: Sequence[Part], peak: float) -> Pair:
        """Begin a move, and say what is wanted first.

        Args:
            now: [s]
            parts: How long [s], and what is wanted meanwhile; at least one.
            peak: How fast it is at its fastest, in the measure that `next` is told.
        """
        ends, at = [], now
        for lasts, one, other in parts:
            at += lasts
            ends.append((at, one, other))
        self._parts, self._peak, self._ended, self._was_seen = ends, peak, None, False
        return ends[0][1:]

    def next(self, now: float, delay: float, pace: float) -> Pair | None:
        """What is wanted now: a part of the move, or nothing moving; None: it is time for another.

        Args:
            now: [s]
            delay: What the person takes the whole delay to be [s].
            pace: How fast the picture moves, in any one measure.
        """
        still = pace <= STILL * self._peak
        self._was_seen = self._was_seen or not still
        if not still:
            self._still_since = None
        elif self._still_since is None:
            self._still_since = now
        for until, one, other in self._parts:
            if now < until - 1e-6:
                return one, other
        if self._parts:
            self.waits += 1
            self._parts, self._ended = [], now
        return (0.0, 0.0) if self._waits_on(now, delay) else None

    def _waits_on(self, now: float, delay: float) -> bool:
        """Whether the picture has not yet shown the move, or not yet that it is over."""
        if self._ended is None:
            return False
        waited = now - self._ended
        if waited > PATIENCE * self.usual_wait(delay):
            return False
        settled = self._still_since is not None and now - self._still_since >= SETTLED_FOR
        return not (settled and self._was_seen and waited >= self._reaction + delay)


def straight_way(route: Route, here: Pair, along: float, most: float, slack: float) -> float:
    """How far ahead on a route one can go straight [m], at most `most`.

    Args:
        route: [m]
        here: Where one is [m].
        along: How far along the route that is [m].
        most: [m]
        slack: How far the route may lie from the straight line [m].
    """
    way = most
    while way > 2.0 * slack and _apart(route, here, along, way) > slack:
        way *= 0.7
    return way


def _apart(route: Route, here: Pair, along: float, way: float) -> float:
    """How far a route lies from the straight line from here to a place ahead on it [m]."""
    (ax, ay), (bx, by) = here, route.point_at(along + way)
    length = math.hypot(bx - ax, by - ay)
    if length == 0.0:
        return 0.0
    between = [route.point_at(along + share * way) for share in (0.25, 0.5, 0.75)]
    return max(abs((bx - ax) * (y - ay) - (by - ay) * (x - ax)) for x, y in between) / length
