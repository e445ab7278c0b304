"""Following a route: position on it, distance and direction ahead, and steering.

It is shared by robots on missions, operators who drive, and people who walk.

References:
    R. C. Coulter: Implementation of the pure pursuit path tracking algorithm.
    CMU-RI-TR-92-01, 1992.
    T. B. Sheridan: Telerobotics, Automation, and Human Supervisory Control. MIT Press, 1992
    (driving under delay).
"""

from __future__ import annotations

import math
from bisect import bisect_right
from copy import copy
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dva_sim.agents.observation import Observation
from dva_sim.agents.population import Person
from dva_sim.kernel.makers import maker

REACH = 2.0  # design: distance ahead in which the next position on a route is looked for [m]
BENT = 1.5  # design: way along a route to what one moves straight; around a right angle, up to 1.41


def wrap(angle: float) -> float:
    """Wrap an angle to (-pi, pi] [rad]."""
    return math.remainder(angle, 2.0 * math.pi)


class Ahead(NamedTuple):
    """The target on the route as seen from a pose.

    Attributes:
        bearing: Direction to the look-ahead point, relative to the heading [rad].
        distance: Distance to it [m].
        remaining: Remaining distance on the route [m].
        offset: Distance from the route [m].
    """

    bearing: float
    distance: float
    remaining: float
    offset: float


_make_ahead = maker(Ahead)


_Leg = tuple[float, float, float, float, float, float]
"""A straight piece: its beginning [m], the way to its end [m], that squared, and its length."""


def _leg(ax: float, ay: float, bx: float, by: float) -> _Leg:
    dx = bx - ax
    dy = by - ay
    square = dx * dx + dy * dy
    return ax, ay, dx, dy, square, math.sqrt(square)


@dataclass(slots=True)
class _Place:
    """Position on a route.

    Attributes:
        leg: Index of the piece.
        along: Distance from the beginning of the route [m].
        x: Position to the east, perhaps beside the route [m].
        y: Position to the north [m].
        offset: Distance from the route [m]; infinite if not computed yet.
    """

    leg: int
    along: float
    x: float
    y: float
    offset: float


ROUNDED = 1e-6  # design: far more than lengths are rounded by [m]
BEND = 0.6  # design: a route leads away from a place until it has turned by so much [rad]
METRE_ALONG_M = 1.0 / math.cos(BEND)  # design: way along it by which it is a metre away, at most


class _Line:
    """The pieces of a route, which never change.

    Args:
        points: Corners, shape `(n, 2)` [m], n >= 2.
    """

    def __init__(self, points: NDArray[np.float64]) -> None:
        corners: list[tuple[float, float]] = np.asarray(points, float).tolist()
        steps = np.hypot(*np.diff(points, axis=0).T)
        self.legs = [_leg(*start, *end) for start, end in pairwise(corners)]
        self.at: list[float] = [0.0, *np.cumsum(steps).tolist()]
        headings = np.arctan2([leg[3] for leg in self.legs], [leg[2] for leg in self.legs])
        turns = np.abs(np.remainder(np.diff(headings) + math.pi, 2.0 * math.pi) - math.pi)
        self._turned: list[float] = [0.0, *np.cumsum(turns).tolist()]  # turns before each piece
        self.begin = _Place(0, 0.0, *corners[0], offset=math.inf)
        self._last: _Place | None = None
        self._found = self.begin

    def next_place(self, last: _Place, x: float, y: float, reach: float) -> _Place:
        """Return the place of who is here [m] and was at another.

        Found once for all who ask together.

        Args:
            last: Previous place.
            x: Position [m].
            y: Position [m].
            reach: Largest progress beyond the distance moved [m].
        """
        if last is not self._last or x != self._found.x or y != self._found.y:
            self._last = last
            self._found = self._nearest(last, x, y, reach)
        return self._found

    def _nearest(self, last: _Place, x: float, y: float, reach: float) -> _Place:
        """Return the nearest place on the line; see `next_place`.

        The way along a route is no shorter than the straight one: who is so much farther from a
        place on it than from the nearest one need not look at what comes within as much behind it.
        Nor need who has left no piece behind: a route that goes on about as straight leads away.
        """
        at = self.at
        legs = self.legs
        nearest = math.inf
        best = (last.leg, 0.0, math.inf, 0.0)
        end = last.along + reach + BENT * math.hypot(x - last.x, y - last.y)
        i = last.leg
        count = len(legs)
        away = math.inf
        until = 0
        while i < count and at[i] <= end:
            begins = at[i]
            ax, ay, dx, dy, square, length = legs[i]
            share = ((x - ax) * dx + (y - ay) * dy) / square if square else 1.0
            share = 0.0 if share < 0.0 else 1.0 if share > 1.0 else share
            if at[i + 1] > end:
                share = min(share, (end - begins) / (at[i + 1] - begins))
            along = begins + share * length
            away_x = ax + share * dx - x
            away_y = ay + share * dy - y
            far = away_x * away_x + away_y * away_y
            if far < nearest:
                nearest = far
                best = (i, along, away_x, away_y)
                away = along + METRE_ALONG_M * math.sqrt(far) + ROUNDED if share < 1.0 else math.inf
                until = bisect_right(self._turned, self._turned[i] + BEND, i)
                i += 1
            else:
                farther = math.sqrt(far) - math.sqrt(nearest) - ROUNDED
                i = bisect_right(at, along + farther, i + 2) - 1
            if at[i] > away and i < until:
                i = until
        leg, along, away_x, away_y = best
        return _Place(leg, along, x, y, offset=math.hypot(away_x, away_y))


class Route:
    """A polyline to follow, and how far along it one has come.

    One's place on it is the nearest one that can have been reached; who has not moved is where it
    was. It is not behind the piece where one was, and ahead of that no farther along the route than
    one may have come since, and `reach`. So it does not matter how finely a route is cut nor how
    seldom one looks, and a later part of a route that folds back beside an earlier one is not taken
    for it.

    Args:
        points: Corners, shape `(n, 2)` [m], n >= 2.
        reach: Largest progress beyond the distance moved [m]. A corner may be cut by this much of
            the route; where laps overlap, it should be well below a lap.

    Attributes:
        points: Points as given.
        length: Length of the route [m].
    """

    def __init__(self, points: NDArray[np.float64], reach: float = REACH) -> None:
        self._line = _Line(points)
        self._reach = reach
        self._place = self._line.begin
        self.points = points
        self.length = self._line.at[-1]

    def twin(self) -> Route:
        """Return the route for another follower; look-ups of both are shared."""
        twin = copy(self)
        twin.points = self.points.copy()
        return twin

    @property
    def left(self) -> float:
        """Way left from the beginning of the piece that one was on when one last looked [m]."""
        at = self._line.at
        return at[-1] - at[self._place.leg]

    def ahead(self, x: float, y: float, heading: float, look_ahead: float) -> Ahead:
        """Return the point to aim at from a pose; it never goes back along the route.

        Args:
            x: Position [m].
            y: Position [m].
            heading: Heading [rad].
            look_ahead: Distance of the target ahead on the route [m].
        """
        place = self._go_to(x, y)
        tx, ty = self.point_at(place.along + look_ahead)
        bearing = wrap(math.atan2(ty - y, tx - x) - heading)
        distance = math.hypot(tx - x, ty - y)
        return _make_ahead(bearing, distance, self.length - place.along, place.offset)

    def remaining(self, x: float, y: float) -> float:
        """Return the remaining distance [m] from the position on the route, as by `ahead`."""
        return self.length - self._go_to(x, y).along

    def advance(self, x: float, y: float) -> None:
        """Update the position on the route from a position [m], as `ahead` does."""
        self._go_to(x, y)

    def _go_to(self, x: float, y: float) -> _Place:
        """Update and return the position on the route from a position [m]."""
        place = self._place
        if x != place.x or y != place.y or place.offset == math.inf:
            self._place = place = self._line.next_place(place, x, y, self._reach)
        return place

    def point_at(self, along: float) -> tuple[float, float]:
        """Return the point at a distance along the route [m], or its end."""
        at = self._line.at
        legs = self._line.legs
        i = bisect_right(at, along, 0, len(legs)) - 1
        ax, ay, dx, dy, _, _ = legs[i]
        length = at[i + 1] - at[i]
        share = (along - at[i]) / length if length else 1.0
        share = 0.0 if share < 0.0 else 1.0 if share > 1.0 else share
        return ax + share * dx, ay + share * dy


class View(NamedTuple):
    """State of the robot, as its driver knows it.

    Attributes:
        now: The driver's own clock [s].
        seen: The newest frame perceived, as the driver judges it.
        delay: Whole delay from an intent to its visible effect, as the driver perceives it [s].
    """

    now: float
    seen: Observation
    delay: float


make_view = maker(View)


class Intent(NamedTuple):
    """Wanted motion of the robot: speed [m/s], turn rate [rad/s]."""

    speed: float
    turn_rate: float


make_intent = maker(Intent)


@dataclass(frozen=True)
class Reach:
    """Limits of the robot, or of the cursor.

    Attributes:
        speed: Largest speed [m/s].
        turn_rate: Maximum turn rate in either direction [rad/s].
        radius: Radius of its sharpest curve [m]; 0: it turns on the spot.
    """

    speed: float
    turn_rate: float
    radius: float = 0.0

    def turn(self, turn_rate: float) -> Intent:
        """Turn at a rate [rad/s], as nearly on the spot as the robot can."""
        return Intent(min(abs(turn_rate) * self.radius, self.speed), turn_rate)


SHORTEST = 1e-3  # design: a delay, or a share of noise, below this counts as this


def gain_at(limit: float, margin: float, delay: float) -> float:
    """Return the gain at which a person closes a loop [1/s]: gain x delay stays within its margin.

    A loop of gain K on an integrator, with delay tau, is stable below K tau = pi/2.

    Args:
        limit: The person's own [1/s], however short the delay.
        margin: The person's own.
        delay: [s]
    """
    gain = margin / (delay if delay > SHORTEST else SHORTEST)
    return gain if gain < limit else limit


class PurePursuit:
    """Aims at a point ahead on the route, the farther the longer the delay.

    The look-ahead is at least the way covered during the delay over the person's caution (0.3):
    on a straight route the pursuit is stable up to 0.52. Where a building allows no such
    look-ahead, the person slows down instead. Where the route bends sharply it stops to turn.

    Args:
        person: Person with gain, caution and pace.
        reach: Limits of the robot.
    """

    def __init__(self, person: Person, reach: Reach) -> None:
        self.person = person
        self.reach = reach
        self._steering_habits = person.habits.steering
        self._turning = False

    def drive(self, route: Route, view: View, stop_before: float) -> Intent:
        """Return the command for a robot that follows a route.

        Args:
            route: The way to go.
            view: Current observation and its time.
            stop_before: Distance from the end of the route at which to stop [m].
        """
        person = self.person
        reach = self.reach
        observation = view.seen
        habits = self._steering_habits
        delay = view.delay if view.delay > SHORTEST else SHORTEST
        pace = person.pace * reach.speed
        look = pace * delay / person.caution
        nearest = habits.nearest_look_m
        farthest = habits.farthest_look_m
        look = look if look > nearest else nearest
        look = look if look < farthest else farthest
        ahead = route.ahead(observation.x, observation.y, observation.heading, look)
        limit = habits.turns_until_rad if self._turning else habits.stops_from_rad
        self._turning = abs(ahead.bearing) > limit
        is_there = ahead.remaining < stop_before
        if is_there and reach.radius > 0.0:
            return Intent(0.0, 0.0)  # a car cannot turn towards the event on the spot
        if self._turning or is_there:
            gain = gain_at(person.crossover, person.margin, delay)
            return reach.turn(self._clamp(gain * ahead.bearing))
        speed = person.caution * look / delay
        slow = ahead.remaining / (2.0 * delay + 1.0)
        speed = speed if speed < pace else pace
        return self._along(route, view, ahead, look, speed if speed < slow else slow)

    def _along(self, route: Route, view: View, ahead: Ahead, look: float, speed: float) -> Intent:
        """Return the arc towards the point ahead, slower where it would be too sharp.

        Args:
            route: The way to go.
            view: Current observation and its time.
            ahead: The point ahead.
            look: Distance of the point ahead on the route [m].
            speed: Speed limit [m/s].
        """
        distance = ahead.distance
        curvature = 2.0 * math.sin(ahead.bearing) / (distance if distance > 0.2 else 0.2)
        most = self._steering_habits.in_curves * self.reach.turn_rate
        if abs(curvature) * speed > most:
            speed = most / abs(curvature)
        return make_intent(speed, self._clamp(curvature * speed))

    def _clamp(self, turn_rate: float) -> float:
        most = self.reach.turn_rate
        return -most if turn_rate < -most else most if turn_rate > most else turn_rate
