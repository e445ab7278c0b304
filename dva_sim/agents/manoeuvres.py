"""Short things that a robot on a mission does between two pieces of its way."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dva_sim.agents.camera import Observation
from dva_sim.agents.collision_guard import CollisionGuard
from dva_sim.agents.nearby import Nearby
from dva_sim.agents.operator.strategies import Intent
from dva_sim.agents.steering import wrap

Floats = NDArray[np.float64]
Point = tuple[float, float]

STAND = Intent(0.0, 0.0)
GAIN = 2.0  # of turning towards a heading [1/s]
FACING = 0.1  # nearer than this one faces it [rad]
SLOWLY = 0.25  # speed of manoeuvres [m/s]; assumed
GET_AWAY = 0.5  # way driven after a jam before planning anew [m]; assumed
HEADINGS = 16  # looked at for a way out
TRIED = 0.5  # a heading so near one that did not help is not tried again [rad]
THERE = 0.15  # a place beside the way is reached from here [m]
FREE_FOR = 1.0  # the way must be free for so long before a robot goes on [s]; assumed
LONGEST_RECOVERY, LONGEST_ASIDE = 12.0, 30.0  # [s]; assumed
STILL, NOBODY_MOVES = 0.05, 4.0  # who stands [m/s] for so long will not pass [s]; assumed
PASSED = 0.10  # gap left between the way and who has passed [m]


class Seen(NamedTuple):
    """What a robot knows at a moment, by its sensors and its map.

    Attributes:
        now: [s]
        view: Where it is, and what is in its picture.
        nearby: Who is in sight and within reach.
        jammed: Whether it drives against something and does not move.
        charge: Share of its battery's charge that is left.
    """

    now: float
    view: Observation
    nearby: tuple[Nearby, ...] = ()
    jammed: bool = False
    charge: float = 1.0

    @property
    def here(self) -> Point:
        """Where it is [m]."""
        return self.view.x, self.view.y


def turn_to(view: Observation, heading: float, most: float) -> Intent:
    """Turn on the spot towards a heading, no faster than `most` [rad/s]."""
    error = wrap(heading - view.heading)
    return Intent(0.0, min(max(GAIN * error, -most), most))


class Manoeuvre:
    """Something that ends by itself.

    Attributes:
        state: Of the mission meanwhile.
        reason: In words.
    """

    state: str
    reason: str

    def step(self, seen: Seen) -> Intent | None:
        """What to do now; None when it is over."""
        raise NotImplementedError


class Recovery(Manoeuvre):
    """Out of a jam: turn on the spot to where the way is free, and drive off a little.

    Args:
        seen: The moment of the jam.
        guard: Knows what is free.
        most_turn: Highest turn rate [rad/s].
        tried: Headings that did not help [rad].
    """

    state, reason = "replanning", "jammed"

    def __init__(
        self, seen: Seen, guard: CollisionGuard, most_turn: float, tried: Sequence[float]
    ) -> None:
        self._guard, self._turn, self._until = guard, most_turn, seen.now + LONGEST_RECOVERY
        self._start, self._turned = seen.here, False
        self.heading = self._way_out(seen, tried)

    def _way_out(self, seen: Seen, tried: Sequence[float]) -> float:
        """The freest heading; the less to turn, the better where several are free."""

        def worth(heading: float) -> float:
            pose = (*seen.here, heading)
            free = self._guard.free_way(pose, SLOWLY, 0.0, seen.nearby, 2 * GET_AWAY)
            again = any(abs(wrap(heading - other)) < TRIED for other in tried)
            return free - 0.1 * abs(wrap(heading - seen.view.heading)) - 5.0 * again

        turns = [2.0 * math.pi * number / HEADINGS for number in range(1, HEADINGS)]
        return max((seen.view.heading + turn for turn in turns), key=worth)

    def step(self, seen: Seen) -> Intent | None:
        """Turn, then drive; over when far enough away, or when it takes too long."""
        if seen.now > self._until or math.dist(seen.here, self._start) > GET_AWAY:
            return None
        self._turned = self._turned or abs(wrap(self.heading - seen.view.heading)) < FACING
        turn = turn_to(seen.view, self.heading, self._turn)
        return Intent(SLOWLY, turn.turn_rate) if self._turned else turn


class Aside(Manoeuvre):
    """Out of the way: drive to a place beside it and wait until the others have passed.

    Args:
        seen: The moment it begins.
        place: Where to wait [m].
        way: What to leave free, shape `(n, 2)` [m].
        radius: Of the robot [m].
        most_turn: Highest turn rate [rad/s].
    """

    state, reason = "waiting", "somebody is in the way"

    def __init__(
        self, seen: Seen, place: Point, way: Floats, radius: float, most_turn: float
    ) -> None:
        self._place, self._way, self._radius = place, way, radius
        self._turn, self._until = most_turn, seen.now + LONGEST_ASIDE
        self._arrived, self._free_since, self._moved = False, math.inf, seen.now

    def step(self, seen: Seen) -> Intent | None:
        """Drive there, stand, and go on when the way has been free for a moment."""
        self._free_since = min(self._free_since, seen.now) if self._is_free(seen) else math.inf
        if any(math.hypot(other.vx, other.vy) > STILL for other in seen.nearby):
            self._moved = seen.now
        stays = self._arrived and seen.now - self._moved > NOBODY_MOVES
        if seen.now - self._free_since >= FREE_FOR or seen.now > self._until or stays:
            return None
        self._arrived = self._arrived or math.dist(seen.here, self._place) < THERE
        if self._arrived:
            return Intent(0.0, 0.0)
        x, y = self._place
        bearing = math.atan2(y - seen.view.y, x - seen.view.x)
        turn = turn_to(seen.view, bearing, self._turn)
        return turn if abs(wrap(bearing - seen.view.heading)) > 0.3 else turn._replace(speed=SLOWLY)

    def _is_free(self, seen: Seen) -> bool:
        """Whether nobody is on the way ahead, or will be in a moment."""
        for other in seen.nearby:
            for ahead in (0.0, 1.0, 2.0):
                x, y = other.x + ahead * other.vx, other.y + ahead * other.vy
                gap = float(np.hypot(*(self._way - (x, y)).T).min())
                if gap < self._radius + other.radius + PASSED:
                    return False
        return True
