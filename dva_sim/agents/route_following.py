"""Following a route: where one is on it, which way is ahead, and how to steer there.

Robots on missions, operators who drive and people who walk stand on this.

References:
    R. C. Coulter: Implementation of the pure pursuit path tracking algorithm.
    CMU-RI-TR-92-01, 1992.
    T. B. Sheridan: Telerobotics, Automation, and Human Supervisory Control. MIT Press, 1992
    (driving under delay).
"""

from __future__ import annotations

import math
from bisect import bisect_right
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dva_sim.agents.observation import Observation
from dva_sim.agents.population import Person

REACH = 2.0  # on a route in a building, one looks for one's place so far ahead of the last [m]
BENT = 1.5  # way along a route to what one moves straight; around a right angle, up to 1.41


def wrap(angle: float) -> float:
    """The same angle in (-pi, pi] [rad]."""
    return math.remainder(angle, 2.0 * math.pi)


class Ahead(NamedTuple):
    """The target on the route as seen from a pose.

    Attributes:
        bearing: Direction to the look-ahead point, relative to the heading [rad].
        distance: Distance to it [m].
        remaining: Way left on the route [m].
        offset: Distance from the route [m].
    """

    bearing: float
    distance: float
    remaining: float
    offset: float


class _Leg(NamedTuple):
    """A straight piece: its beginning [m], the way to its end [m], that squared, and its length."""

    x: float
    y: float
    dx: float
    dy: float
    square: float
    length: float


def _leg(ax: float, ay: float, bx: float, by: float) -> _Leg:
    dx, dy = bx - ax, by - ay
    square = dx * dx + dy * dy
    return _Leg(ax, ay, dx, dy, square, math.sqrt(square))


class Route:
    """A polyline to follow, and how far along it one has come.

    One's place on it is the nearest one that can have been reached; who has not moved is where it
    was. It is not behind the piece where one was, and ahead of that no farther along the route than
    one may have come since, and `reach`. So it does not matter how finely a route is cut nor how
    seldom one looks, and a later part of a route that folds back beside an earlier one is not taken
    for it.

    Args:
        points: Corners, shape `(n, 2)` [m], n >= 2.
        reach: How far ahead, beyond what one may have come [m]. A corner may be cut by so much of
            the route; where laps lie on each other, it should be well below a lap.
    """

    def __init__(self, points: NDArray[np.float64], reach: float = REACH) -> None:
        self._points = [(float(x), float(y)) for x, y in points]
        steps = np.hypot(*np.diff(points, axis=0).T)
        self._legs = [_leg(*start, *end) for start, end in pairwise(self._points)]
        self._at: list[float] = [0.0, *np.cumsum(steps).tolist()]
        self._segment, self._along, self._seen = 0, 0.0, self._points[0]
        self._offset: float | None = None  # of the place seen last; None: not looked for yet
        self._reach = reach
        self.points = points

    @property
    def length(self) -> float:
        """Whole way [m]."""
        return self._at[-1]

    @property
    def left(self) -> float:
        """Way left from the beginning of the piece that one was on when one last looked [m]."""
        return self._at[-1] - self._at[self._segment]

    def ahead(self, x: float, y: float, heading: float, look_ahead: float) -> Ahead:
        """What to aim at from a pose; never steps back along the route.

        Args:
            x: Position [m].
            y: Position [m].
            heading: Heading [rad].
            look_ahead: How far ahead on the route the target lies [m].
        """
        along, offset = self._project(x, y)
        tx, ty = self.point_at(along + look_ahead)
        bearing = wrap(math.atan2(ty - y, tx - x) - heading)
        distance = math.hypot(tx - x, ty - y)
        return Ahead(bearing, distance, self.length - along, offset)

    def remaining(self, x: float, y: float) -> float:
        """Way left from the place on the route where one is who is here [m], as `ahead` tells."""
        return self.length - self._project(x, y)[0]

    def advance(self, x: float, y: float) -> None:
        """Keep track of how far one has come who is here [m], as `ahead` does."""
        self._project(x, y)

    def _project(self, x: float, y: float) -> tuple[float, float]:
        """Nearest place within reach of the last one: (way along the route, distance) [m]."""
        last_x, last_y = self._seen
        if x == last_x and y == last_y and self._offset is not None:
            return self._along, self._offset
        at, legs, nearest, found = self._at, self._legs, math.inf, (0.0, math.inf, 0.0)
        end = self._along + self._reach + BENT * math.hypot(x - last_x, y - last_y)
        for i in range(self._segment, len(legs)):
            begins = at[i]
            if begins > end:
                break
            ax, ay, dx, dy, square, length = legs[i]
            share = ((x - ax) * dx + (y - ay) * dy) / square if square else 0.0
            share = 0.0 if share < 0.0 else 1.0 if share > 1.0 else share
            if at[i + 1] > end:
                share = min(share, (end - begins) / (at[i + 1] - begins))
            away_x, away_y = ax + share * dx - x, ay + share * dy - y
            far = away_x * away_x + away_y * away_y
            if far < nearest:
                nearest, found = far, (begins + share * length, away_x, away_y)
                self._segment = i
        self._seen, self._along, self._offset = (x, y), found[0], math.hypot(found[1], found[2])
        return self._along, self._offset

    def point_at(self, along: float) -> tuple[float, float]:
        """The place a given way along the route [m]; beyond its end, the end."""
        i = min(bisect_right(self._at, along), len(self._legs)) - 1
        ax, ay, dx, dy, _, _ = self._legs[i]
        length = self._at[i + 1] - self._at[i]
        share = (along - self._at[i]) / length if length else 1.0
        share = 0.0 if share < 0.0 else 1.0 if share > 1.0 else share
        return ax + share * dx, ay + share * dy


class View(NamedTuple):
    """What a driver knows of the robot that it drives.

    Attributes:
        now: The driver's own clock [s].
        seen: The newest frame perceived, as the driver judges it.
        delay: What the driver takes the whole delay to be, from an intent to its effect seen [s].
    """

    now: float
    seen: Observation
    delay: float


class Intent(NamedTuple):
    """What a driver wants the robot to do now: speed [m/s], turn rate [rad/s]."""

    speed: float
    turn_rate: float


@dataclass(frozen=True)
class Reach:
    """What the robot, or the cursor, can do.

    Attributes:
        speed: At most [m/s].
        turn_rate: At most, either way [rad/s].
        radius: Of its sharpest curve [m]; 0: it turns on the spot.
    """

    speed: float
    turn_rate: float
    radius: float = 0.0

    def turn(self, turn_rate: float) -> Intent:
        """Turn at a rate [rad/s], as nearly on the spot as the robot can."""
        return Intent(min(abs(turn_rate) * self.radius, self.speed), turn_rate)


SHORTEST = 1e-3  # a delay, or a share of noise, below this counts as this


def gain_at(limit: float, margin: float, delay: float) -> float:
    """The gain at which a person closes a loop [1/s]: gain x delay stays within its margin.

    A loop of gain K on an integrator, with delay tau, is stable below K tau = pi/2.

    Args:
        limit: The person's own [1/s], however short the delay.
        margin: The person's own.
        delay: [s]
    """
    return min(limit, margin / max(delay, SHORTEST))


NEAREST_LOOK, FARTHEST_LOOK = 0.8, 1.8  # look-ahead inside a building [m]
TURN_FROM, TURN_UNTIL = 0.9, 0.25  # bearing at which one stops to turn, and drives on [rad]
IN_CURVES = 0.8  # share of the highest turn rate that one plans a curve with


class PurePursuit:
    """Aims at a point ahead on the route, the farther the longer the delay.

    The look-ahead is at least the way covered during the delay over the person's caution (0.3):
    on a straight route the pursuit is stable up to 0.52. Where a building allows no such
    look-ahead, the person slows down instead. Where the route bends sharply it stops to turn.

    Args:
        person: Whose gain, caution and pace it steers with.
        reach: Limits of the robot.
    """

    def __init__(self, person: Person, reach: Reach) -> None:
        self.person, self.reach = person, reach
        self._turning = False

    def drive(self, route: Route, view: View, stop_before: float) -> Intent:
        """What to ask a robot for, to follow a route.

        Args:
            route: The way to go.
            view: What is seen, and when.
            stop_before: Where to stop: so far before the end of the route [m].
        """
        person, reach, seen = self.person, self.reach, view.seen
        delay = max(view.delay, SHORTEST)
        wanted = person.pace * reach.speed
        look = min(max(wanted * delay / person.caution, NEAREST_LOOK), FARTHEST_LOOK)
        ahead = route.ahead(seen.x, seen.y, seen.heading, look)
        limit = TURN_UNTIL if self._turning else TURN_FROM
        self._turning = abs(ahead.bearing) > limit
        is_there = ahead.remaining < stop_before
        if is_there and reach.radius > 0.0:
            return Intent(0.0, 0.0)  # a car cannot turn towards what it has come to see
        if self._turning or is_there:
            gain = gain_at(person.crossover, person.margin, delay)
            return reach.turn(self._clamp(gain * ahead.bearing))
        speed = min(wanted, person.caution * look / delay, ahead.remaining / (2.0 * delay + 1.0))
        return self._along(route, view, ahead, look, speed)

    def _along(self, route: Route, view: View, ahead: Ahead, look: float, speed: float) -> Intent:
        """Towards the point ahead on an arc, slower where that would be too sharp.

        Args:
            route: The way to go.
            view: What is seen, and when.
            ahead: The point ahead.
            look: How far ahead on the route it lies [m].
            speed: As fast as one may [m/s].
        """
        curvature = 2.0 * math.sin(ahead.bearing) / max(ahead.distance, 0.2)
        most = IN_CURVES * self.reach.turn_rate
        if abs(curvature) * speed > most:
            speed = most / abs(curvature)
        return Intent(speed, self._clamp(curvature * speed))

    def _clamp(self, turn_rate: float) -> float:
        most = self.reach.turn_rate
        return -most if turn_rate < -most else most if turn_rate > most else turn_rate
