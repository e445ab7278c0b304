"""Move and wait: one open-loop move after the other, each followed by a wait until it is seen.

A move goes as far as the person trusts it; then it stops and sees what came of it.

References:
    W. R. Ferrell: Remote manipulation with transmission delay. IEEE Trans. Human Factors in
    Electronics HFE-6 (1965): who cannot wait for the picture moves, waits, and moves again.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from typing_extensions import override

from dva_sim.agents.habits import WaitingHabits
from dva_sim.agents.observation import Observation
from dva_sim.agents.operator.strategies.base import PathView, PointView, Strategy
from dva_sim.agents.operator.strategies.cursor import Velocity
from dva_sim.agents.population import Person
from dva_sim.agents.route_following import SHORTEST, Ahead, Intent, Reach, Route, View

WHOLE_PERIOD_SHARE = (
    0.2  # design: a move that is longer than whole periods by less of one is made faster
)
Pair = tuple[float, float]
MovePart = tuple[float, float, float]  # how long [s], and two wanted values


class Moves:
    """Moves of a person who moves and waits.

    Args:
        reaction: Reaction time of the person [s].
        habits: Habits of the person.

    Attributes:
        waits: Number of waits.
    """

    def __init__(self, reaction: float, habits: WaitingHabits) -> None:
        self._reaction = reaction
        self._habits = habits
        self._least_wait = max(reaction, habits.settled_s)
        self.waits = 0
        self._parts: list[MovePart] = []  # the first number is when it ends
        self._peak = 0.0
        self._ended: float | None = None  # since when one waits
        self._was_seen = True
        self._still_since: float | None = None

    def usual_wait(self, delay: float) -> float:
        """Return how long a wait takes if all goes well, at this delay [s]."""
        return delay + self._least_wait

    @property
    def rests(self) -> bool:
        """True if no move is being made."""
        return not self._parts

    def halt(self, now: float, peak: float) -> None:
        """Wait after a motion that was no move of this kind: let go at `now` [s]."""
        self.waits += 1
        self._parts = []
        self._peak = peak
        self._ended = now
        self._was_seen = True

    def begin(self, now: float, parts: Sequence[MovePart], peak: float) -> Pair:
        """Begin a move, and say what is wanted first.

        Args:
            now: [s]
            parts: Duration [s] and command of each part; at least one.
            peak: Top speed of the move, in the unit of `pace` in `next`.
        """
        ends = []
        at = now
        for lasts, one, other in parts:
            at += lasts
            ends.append((at, one, other))
        self._parts = ends
        self._peak = peak
        self._ended = None
        self._was_seen = False
        return ends[0][1:]

    def next(self, now: float, delay: float, pace: float) -> Pair | None:
        """Return what is wanted now: part of the move, or standing still; None: time for another.

        Args:
            now: [s]
            delay: Whole delay as the person perceives it [s].
            pace: Speed of the picture, in any one unit.
        """
        still = pace <= self._habits.still_share * self._peak
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
            self._parts = []
            self._ended = now
        return (0.0, 0.0) if self._waits_on(now, delay) else None

    def _waits_on(self, now: float, delay: float) -> bool:
        """Return True if the picture has not yet shown the move, or its end."""
        if self._ended is None:
            return False
        waited = now - self._ended
        if waited > self._habits.patience * self.usual_wait(delay):
            return False
        since = self._still_since
        settled = since is not None and now - since >= self._habits.settled_s
        return not (settled and self._was_seen and waited >= self._reaction + delay)


def straight_way(route: Route, here: Pair, along: float, most: float, slack: float) -> float:
    """Return how far ahead on a route one can go straight [m], at most `most`.

    Args:
        route: [m]
        here: Current position [m].
        along: Current distance along the route [m].
        most: [m]
        slack: Largest distance of the route from the straight line [m].
    """
    length = most
    while length > 2.0 * slack and _apart(route, here, along, length) > slack:
        length *= 0.7
    return length


def _apart(route: Route, here: Pair, along: float, way: float) -> float:
    """Return how far a route departs from the straight line to a place ahead on it [m]."""
    ax, ay = here
    bx, by = route.point_at(along + way)
    length = math.hypot(bx - ax, by - ay)
    if length == 0.0:
        return 0.0
    between = [route.point_at(along + share * way) for share in (0.25, 0.5, 0.75)]
    return max(abs((bx - ax) * (y - ay) - (by - ay) * (x - ax)) for x, y in between) / length


class MoveAndWait(Strategy):
    """Makes an open-loop move, waits until its result is seen, and moves again.

    A move of a robot turns towards a place ahead and goes there straight, as far as the person's
    errors of heading and hand leave it near its way. A move of a cursor goes all the way to the
    target; through a tunnel as far as the hand's noise leaves it inside.

    Attributes:
        trusted: Distance that a robot is driven in one move [m].
        period: Between two commands that get through, as far as it is known [s].
    """

    def __init__(self, person: Person, reach: Reach) -> None:
        super().__init__(person, reach)
        self._habits = habits = person.habits.waiting
        self._in_curves = person.habits.steering.in_curves
        self.moves = Moves(person.reaction, habits)
        self.trusted = habits.off_way_m / max(person.heading_error + person.motor_noise, SHORTEST)

    period = 0.0

    @override
    def drive(self, route: Route, view: View, stop_before: float) -> Intent:
        seen = view.seen
        left = route.remaining(seen.x, seen.y)  # kept track of in moves
        command = self.moves.next(view.now, view.delay, self._pace(seen.speed, seen.turn_rate))
        if command is None:
            parts = self._way(route, seen, left, stop_before)
            peak = max((self._pace(*part[1:]) for part in parts), default=0.0)
            command = self.moves.begin(view.now, parts, peak) if parts else (0.0, 0.0)
        return Intent(*command)

    @override
    def point(self, view: PointView) -> Velocity:
        # A moving target is led by the time until the move is seen.
        seen = view.seen
        velocity = self.moves.next(view.now, view.delay, self._flow(seen.vx, seen.vy))
        if velocity is not None:
            return velocity
        dx = seen.target_x - seen.x
        dy = seen.target_y - seen.y
        lead = view.delay + self._lasting(math.hypot(dx, dy), self._most)
        dx = dx + seen.target_vx * lead
        dy = dy + seen.target_vy * lead
        if math.hypot(dx, dy) <= seen.tolerance:
            return 0.0, 0.0
        return self._straight(view.now, dx, dy)

    @override
    def follow(self, view: PathView) -> Velocity:
        seen = view.seen
        path = view.path
        left = path.remaining(seen.x, seen.y)
        velocity = self.moves.next(view.now, view.delay, self._flow(seen.vx, seen.vy))
        if velocity is not None:
            return velocity
        if left <= 0.0:
            return 0.0, 0.0
        along = path.length - left
        room = self.person.caution * seen.tolerance
        length = min(self.trusted_in(seen.tolerance), left)
        length = straight_way(path, (seen.x, seen.y), along, length, room)
        x, y = path.point_at(along + length)
        return self._straight(view.now, x - seen.x, y - seen.y)

    def workload(self) -> Mapping[str, float]:
        """Return how often the person waited for the result of a move; it always does so."""
        return {"waits": float(self.moves.waits), "move_and_wait_share": 1.0}

    def trusted_in(self, half_width: float) -> float:
        """Return how far a cursor is moved in a tunnel in one move [m]."""
        return self.person.caution * half_width / max(self.person.motor_noise, SHORTEST)

    def halt(self, now: float) -> None:
        """Come from another way of steering: let go, and wait."""
        self.moves.halt(now, self._habits.let_go)

    # --- moves -------------------------------------------------------------------------

    def _way(
        self, route: Route, seen: Observation, left: float, stop_before: float
    ) -> list[MovePart]:
        """Return the next move of a robot, with so much way left [m].

        None where it has come to stay.
        """
        here = (seen.x, seen.y)
        turns = self.reach.radius == 0.0
        go = left - stop_before
        habits = self._habits
        most = max(min(self.trusted, go), habits.least_m)
        length = straight_way(route, here, route.length - left, most, habits.off_way_m)
        ahead = route.ahead(*here, seen.heading, max(length, stop_before if go <= 0.0 else 0.0))
        turns = turns and abs(ahead.bearing) > habits.faces_rad
        if go <= 0.0:
            return [self._turn(ahead.bearing)] if turns else []
        if turns:
            lasts = self._lasting(ahead.distance, self._most)
            return [self._turn(ahead.bearing), (lasts, ahead.distance / lasts, 0.0)]
        return [self._curve(ahead)]

    def _turn(self, angle: float) -> MovePart:
        """Return a turn on the spot by an angle [rad]."""
        most = self._in_curves * self.reach.turn_rate
        lasts = self._lasting(abs(angle), most)
        return (lasts, *self.reach.turn(angle / lasts))

    def _curve(self, ahead: Ahead) -> MovePart:
        """Return an arc to a place ahead, no sharper than the robot can."""
        curvature = 2.0 * math.sin(ahead.bearing) / max(ahead.distance, self._habits.least_m)
        if self.reach.radius > 0.0:
            most = 1.0 / self.reach.radius
            curvature = min(max(curvature, -most), most)
        turns = self._in_curves * self.reach.turn_rate
        fast = min(self._most, turns / max(abs(curvature), SHORTEST))
        lasts = self._lasting(ahead.distance, fast)
        speed = ahead.distance / lasts
        return lasts, speed, curvature * speed

    def _straight(self, now: float, dx: float, dy: float) -> Velocity:
        """Return a move of a cursor by so much [m]."""
        lasts = self._lasting(math.hypot(dx, dy), self._most)
        vx = dx / lasts
        vy = dy / lasts
        return self.moves.begin(now, [(lasts, vx, vy)], self._flow(vx, vy))

    def _lasting(self, length: float, most: float) -> float:
        """Return how long a move, or a turn, takes at this speed [s].

        Moves shorter than the period may be lost, and a command lasts for whole periods.
        """
        lasts = max(length / most, self._habits.shortest_s)
        period = self.period
        if period <= self._habits.shortest_s:
            return lasts
        return period * max(1.0, math.ceil(lasts / period - WHOLE_PERIOD_SHARE))

    def _pace(self, speed: float, turn_rate: float) -> float:
        """Return the speed of a robot, driving or turning, as a share of its limit."""
        return abs(speed) / self.reach.speed + abs(turn_rate) / self.reach.turn_rate

    def _flow(self, vx: float, vy: float) -> float:
        """Return the speed of a cursor, as a share of its limit."""
        return math.hypot(vx, vy) / self.reach.speed
