"""Manoeuvres of a robot on a mission between two pieces of its path.

It gets out of a jam, steps aside for somebody, or inspects the place of an event.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dva_sim.agents.observation import IN_VIEW, Observation, SeenHazard
from dva_sim.agents.robot.collision_guard import CollisionGuard, Nearby
from dva_sim.agents.route_following import Intent, wrap

Floats = NDArray[np.float64]
Point = tuple[float, float]

STANDSTILL = Intent(0.0, 0.0)
GAIN = 2.0  # turn rate per error of the heading [1/s]
FACING = 0.1  # a robot faces a place if its heading is off by less than this [rad]
MANOEUVRE_MPS = 0.25  # speed of manoeuvres [m/s]; assumed
GET_AWAY = 0.5  # distance driven after a jam before planning again [m]; assumed
HEADINGS = 16  # number of headings compared for a way out
TRIED_WITHIN_RAD = 0.5  # headings this near one that did not help rank last [rad]
REACHED_WITHIN_M = 0.15  # distance at which a place beside the path counts as reached [m]
FREE_FOR = 1.0  # time for which the path must be free before a robot goes on [s]; assumed
MAX_RECOVERY = 12.0  # maximum duration of a way out of a jam [s]; assumed
MAX_ASIDE = 30.0  # maximum duration of stepping aside [s]; assumed
STANDS_BELOW_MPS = 0.05  # slower bodies count as standing [m/s]; assumed
NOBODY_MOVES = 4.0  # others that stand for this long will not pass [s]; assumed
PASSED = 0.10  # gap between the path and others at which it counts as free [m]


class Sensed(NamedTuple):
    """State of a robot as known by its sensors and its map.

    Attributes:
        now: Time [s].
        view: Position, and content of its picture.
        nearby: Others in sight and within reach.
        jammed: True if it drives against something and does not move.
        charge: Share of its battery's charge that is left.
    """

    now: float
    view: Observation
    nearby: tuple[Nearby, ...] = ()
    jammed: bool = False
    charge: float = 1.0

    @property
    def here(self) -> Point:
        """Position [m]."""
        return self.view.x, self.view.y


def turn_to(view: Observation, heading: float, most: float) -> Intent:
    """Turn on the spot towards a heading, no faster than `most` [rad/s]."""
    error = wrap(heading - view.heading)
    return Intent(0.0, min(max(GAIN * error, -most), most))


class Manoeuvre:
    """Manoeuvre that ends by itself.

    Attributes:
        state: State of the mission meanwhile.
        reason: Reason in words.
    """

    state: str
    reason: str

    def step(self, percept: Sensed) -> Intent | None:
        """Return the motion now; None when the manoeuvre is over."""
        raise NotImplementedError


class JamRecovery(Manoeuvre):
    """Way out of a jam: turn on the spot towards free space, and drive a short distance.

    Args:
        percept: Observation at the moment of the jam.
        guard: Guard that knows the free space.
        most_turn: Highest turn rate [rad/s].
        tried: Headings that did not help [rad].
    """

    state = "replanning"
    reason = "jammed"

    def __init__(
        self, percept: Sensed, guard: CollisionGuard, most_turn: float, tried: Sequence[float]
    ) -> None:
        self._guard = guard
        self._turn = most_turn
        self._until = percept.now + MAX_RECOVERY
        self._start = percept.here
        self._turned = False
        self.heading = self._way_out(percept, tried)

    def _way_out(self, percept: Sensed, tried: Sequence[float]) -> float:
        """Return the heading with most free space; of equal ones that with the least turn."""

        def worth(heading: float) -> float:
            pose = (*percept.here, heading)
            free = self._guard.free_way(pose, MANOEUVRE_MPS, 0.0, percept.nearby, 2 * GET_AWAY)
            again = any(abs(wrap(heading - other)) < TRIED_WITHIN_RAD for other in tried)
            return free - 0.1 * abs(wrap(heading - percept.view.heading)) - 5.0 * again

        turns = [2.0 * math.pi * number / HEADINGS for number in range(1, HEADINGS)]
        return max((percept.view.heading + turn for turn in turns), key=worth)

    def step(self, percept: Sensed) -> Intent | None:
        """Turn, then drive; None when far enough away, or when it takes too long."""
        if percept.now > self._until or math.dist(percept.here, self._start) > GET_AWAY:
            return None
        self._turned = self._turned or abs(wrap(self.heading - percept.view.heading)) < FACING
        turn = turn_to(percept.view, self.heading, self._turn)
        return Intent(MANOEUVRE_MPS, turn.turn_rate) if self._turned else turn


class Aside(Manoeuvre):
    """Move out of the way: drive to a place beside the path and wait until others have passed.

    Args:
        percept: Observation when it begins.
        place: Waiting place [m].
        path: Path to keep free, shape `(n, 2)` [m].
        radius: Radius of the robot [m].
        most_turn: Highest turn rate [rad/s].
    """

    state = "waiting"
    reason = "somebody is in the way"

    def __init__(
        self, percept: Sensed, place: Point, path: Floats, radius: float, most_turn: float
    ) -> None:
        self._place = place
        self._way = path
        self._radius = radius
        self._turn = most_turn
        self._until = percept.now + MAX_ASIDE
        self._arrived = False
        self._free_since = math.inf
        self._moved = percept.now

    def step(self, percept: Sensed) -> Intent | None:
        """Drive there, stand, and go on when the way has been free for a moment."""
        self._free_since = (
            min(self._free_since, percept.now) if self._is_free(percept) else math.inf
        )
        if any(math.hypot(other.vx, other.vy) > STANDS_BELOW_MPS for other in percept.nearby):
            self._moved = percept.now
        stays = self._arrived and percept.now - self._moved > NOBODY_MOVES
        if percept.now - self._free_since >= FREE_FOR or percept.now > self._until or stays:
            return None  # the path is free, time is up, or nobody is approaching
        self._arrived = self._arrived or math.dist(percept.here, self._place) < REACHED_WITHIN_M
        if self._arrived:
            return Intent(0.0, 0.0)
        x, y = self._place
        bearing = math.atan2(y - percept.view.y, x - percept.view.x)
        turn = turn_to(percept.view, bearing, self._turn)
        return (
            turn
            if abs(wrap(bearing - percept.view.heading)) > 0.3
            else turn._replace(speed=MANOEUVRE_MPS)
        )

    def _is_free(self, percept: Sensed) -> bool:
        """Return True if nobody is on the path ahead, or will be in a moment."""
        for other in percept.nearby:
            for ahead in (0.0, 1.0, 2.0):
                x = other.x + ahead * other.vx
                y = other.y + ahead * other.vy
                gap = float(np.hypot(*(self._way - (x, y)).T).min())
                if gap < self._radius + other.radius + PASSED:
                    return False
        return True


MATCH_WITHIN = 4.0  # a hazard this near the place of an event is the one reported there [m]
KEEP_OFF = 1.2  # distance from which the place of an event is inspected [m]
LOOK_FROM = 4.0  # distance from which an event in view is inspected [m]; assumed
FIRST_LOOK = 3.0  # time with an empty view before it looks all around [s]; assumed
LOOK_AROUND = 0.4  # turn rate of looking around [rad/s]; assumed
INSPECT_FOR = 120.0  # maximum duration of an inspection [s]; assumed


class Inspection:
    """Inspection of one place.

    Args:
        event: Kind of the event.
        place: Reported position [m].
        sees: Predicate: True if nothing stands between two places.
        most_turn: Highest turn rate [rad/s].
    """

    def __init__(
        self,
        event: str,
        place: Point,
        sees: Callable[[Point, Point], bool],
        most_turn: float,
    ) -> None:
        self._event = event
        self._place = place
        self._sees = sees
        self._most = most_turn
        self._since = self._nothing_since = math.inf
        self._turned = 0.0
        self._heading = 0.0

    def begins(self, percept: Sensed) -> bool:
        """Return True once the robot has reached a place to look from."""
        if self._since == math.inf and self._is_at_view(percept):
            self._since = percept.now
        return self._since < math.inf

    def is_over(self, percept: Sensed) -> bool:
        """Return True if it has looked for long enough."""
        return percept.now - self._since > INSPECT_FOR

    def finding(self, percept: Sensed) -> str:
        """Describe what is in view."""
        what = self._event.replace("_", " ") if self._in_view(percept) else "nothing"
        return f"{what} {IN_VIEW}"

    def step(self, percept: Sensed) -> Intent:
        """Face the event; with nothing in view, first its place, then all around, once."""
        event = self._in_view(percept)
        if event is not None:
            self._nothing_since = math.inf
            return self._face(percept, (event.x, event.y))
        self._nothing_since = min(self._nothing_since, percept.now)
        if percept.now - self._nothing_since < FIRST_LOOK:
            self._heading = percept.view.heading
            return self._face(percept, self._place)
        self._turned += abs(percept.view.heading - self._heading)
        self._heading = percept.view.heading
        return STANDSTILL if self._turned > 2.0 * math.pi else Intent(0.0, LOOK_AROUND)

    def _is_at_view(self, percept: Sensed) -> bool:
        event = self._in_view(percept)
        if event is not None and event.distance <= LOOK_FROM:
            return True
        near = math.dist(percept.here, self._place) < KEEP_OFF
        return near and self._sees(percept.here, self._place)

    def _in_view(self, percept: Sensed) -> SeenHazard | None:
        """Return the event, if it is in the picture."""
        hazards = [
            h
            for h in percept.view.hazards
            if h.kind == self._event and math.dist((h.x, h.y), self._place) < MATCH_WITHIN
        ]
        return min(hazards, key=lambda h: h.distance, default=None)

    def _face(self, percept: Sensed, place: Point) -> Intent:
        bearing = math.atan2(place[1] - percept.view.y, place[0] - percept.view.x)
        if abs(wrap(bearing - percept.view.heading)) < FACING:
            return STANDSTILL
        return turn_to(percept.view, bearing, self._most)
