"""Missions: autonomous driving to places, with people and other robots in the way.

Pure: from what the robot knows at a moment it decides the motion and the state of the mission.
The rules, in the order in which they are applied:

1. A battery that is nearly empty ends any mission but the way home.
2. A jammed robot turns towards free space, drives a short distance, and takes another path; after
   `MAX_JAMS` jams without reaching a place in between, the mission fails.
3. It passes people and other robots in a free lane (`avoidance`), slower beside people.
4. If no lane is free it stops short. If the other robot has the right of way, it steps aside until
   that has passed. If it is still blocked after `AROUND_AFTER`, it looks now and then for a path
   around everybody in sight; it squeezes past people who do not move after `SQUEEZE_AFTER`, and
   gives up after `GIVE_UP_AFTER`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from dva_sim.agents.population import Population, median_person
from dva_sim.agents.robot.avoidance import SQUEEZE, Avoidance, Blocked, pace_among
from dva_sim.agents.robot.collision_guard import CollisionGuard, Nearby
from dva_sim.agents.robot.controller import Mission
from dva_sim.agents.robot.manoeuvres import (
    STANDSTILL,
    Aside,
    Inspection,
    JamRecovery,
    Manoeuvre,
    Sensed,
)
from dva_sim.agents.route_following import Intent, PurePursuit, Reach, Route, View
from dva_sim.protocol import messages as m
from dva_sim.worlds.planning import Disc, Planner

Point = tuple[float, float]

# The robot's own loop has hardly any delay, so it steers more sharply than a person would.
AUTOPILOT = replace(median_person(Population()), crossover=2.0, pace=1.0)


@dataclass(frozen=True)
class MissionGoal:
    """A mission in metres.

    Attributes:
        goals: Places of a lap, in order [m].
        laps: Number of laps; 0: without end.
        event: Kind of the event to be looked at, if there is one.
        home: True for the drive home.
    """

    goals: tuple[Point, ...]
    laps: int = 1
    event: str | None = None
    home: bool = False

    @classmethod
    def of(
        cls, mission: Mission, to_xy: Callable[[float, float], Point], base: Point
    ) -> MissionGoal:
        """Return the mission of a message in metres; `base` is the robot's own base [m]."""
        match mission:
            case m.Inspect():
                place = to_xy(mission.position.latitude, mission.position.longitude)
                return cls((place,), event=mission.kind)
            case m.ReturnToBase():
                return cls((base,), home=True)
        goals = tuple(to_xy(p.latitude, p.longitude) for p in mission.waypoints)
        return cls(goals, mission.laps if isinstance(mission, m.Patrol) else 1)


PERIOD = 0.1  # period of the robot's own loop [s]
REACHED_WITHIN_M = 0.3  # distance at which a waypoint counts as reached [m]
REACHED_IF_TAKEN_M = 1.8  # the same if somebody stands on the waypoint [m]
RESERVE = 0.05  # charge below which a robot only goes home; assumed
MAX_JAMS = 3  # recoveries between two waypoints; assumed
NO_PROGRESS = 15.0  # time without progress that counts as a jam, too [s]; assumed
STOP_SHORT = 1.0  # distance left free before an obstacle [m]; assumed
STANDS_BELOW_MPS = 0.05  # slower bodies count as standing [m/s]
# Waits of a blocked robot, from when it was blocked [s]; all assumed.
SAY_AFTER = 0.5  # time until it reports an obstacle [s]
ASIDE_AFTER = 1.0  # time until it steps aside for a robot with the right of way [s]
AROUND_AFTER = 4.0  # time until it plans a path around the obstacle [s]
AROUND_AGAIN = 6.0  # interval of such plans [s]
DETOUR_MARGIN_M = 0.08  # additional gap of a path around somebody [m]
SQUEEZE_AFTER = 10.0  # time until it reduces the gap to people [s]
GIVE_UP_AFTER = 60.0  # time until the mission fails [s]


class PilotStep(NamedTuple):
    """Consequence of a step: how to move, and the mission's state as in `MissionStatus`."""

    intent: Intent
    state: str
    left: int
    reason: str = ""


class Pilot:
    """Pilot of one mission.

    Args:
        errand: Mission to drive.
        planner: The robot's map.
        guard: Keeps it from driving into anything; knows its radius.
        name: Name of the robot.
        reach: Top speed and highest turn rate of the robot.
        turning_radius: Radius of its sharpest curve [m]; 0: it turns on the spot.
    """

    def __init__(
        self,
        errand: MissionGoal,
        planner: Planner,
        guard: CollisionGuard,
        *,
        name: str,
        reach: Reach,
        turning_radius: float = 0.0,
    ) -> None:
        self._errand = errand
        self._planner = planner
        self._guard = guard
        self._reach = reach
        self._radius = guard.radius
        self._sharpest = turning_radius
        self._avoidance = Avoidance(name, guard.radius, planner.room_at)
        self._driver = PurePursuit(AUTOPILOT, reach)
        self._inspection = self._make_inspection()
        self._reached = 0  # waypoints so far
        self._squeezing = False
        self._begin_leg()

    def _make_inspection(self) -> Inspection | None:
        event = self._errand.event
        place = self._errand.goals[0]
        if event is None:
            return None
        return Inspection(event, place, self._planner.line_of_sight, self._reach.turn_rate)

    def _begin_leg(self) -> None:
        self._route: Route | None = None
        self._manoeuvre: Manoeuvre | None = None
        self._closed: list[Disc] = []
        self._tried: list[float] = []
        self._side = 0.0
        self._jams = 0
        self._blocked_since = math.inf
        self._looked_around = -math.inf
        self._left_aside: str | None = None
        self._moved = -math.inf  # time of the obstacle's last motion [s]
        self._progress = (math.inf, math.inf)  # shortest remaining path [m], and since when [s]

    def step(self, percept: Sensed) -> PilotStep:
        """Return the motion and the state of the mission now."""
        if percept.charge < RESERVE and not self._errand.home:
            return self._end("failed", "battery")
        percept = self._with_patience(percept)
        if percept.jammed and not isinstance(self._manoeuvre, JamRecovery):
            return self._jam(percept)
        if self._manoeuvre is not None:
            return self._go_on_with(self._manoeuvre, percept)
        if self._inspection is not None and self._inspection.begins(percept):
            return self._look(percept, self._inspection)
        return self._travel(percept)

    # --- parts of a step ---------------------------------------------------------------

    @property
    def _goal(self) -> Point:
        return self._errand.goals[self._reached % len(self._errand.goals)]

    @property
    def _left(self) -> int:
        """Places of the present lap still to be visited."""
        return len(self._errand.goals) - self._reached % len(self._errand.goals)

    def _end(self, state: str, reason: str = "") -> PilotStep:
        return PilotStep(STANDSTILL, state, 0 if state == "done" else self._left, reason)

    def _move(self, percept: Sensed, intent: Intent, state: str, reason: str = "") -> PilotStep:
        """Return the step of a motion, slowed before obstacles and beside people."""
        pose = (*percept.here, percept.view.heading)
        speed = pace_among(percept.nearby, percept.here, self._radius, intent.speed)
        speed = self._guard.limit(pose, speed, intent.turn_rate, percept.nearby)
        return PilotStep(Intent(speed, intent.turn_rate), state, self._left, reason)

    # --- free path ---------------------------------------------------------------------

    def _travel(self, percept: Sensed) -> PilotStep:
        route = self._route or self._plan(percept)
        if route is None:
            return self._end("failed", "no way")
        left = route.remaining(percept.view.x, percept.view.y)
        if left < REACHED_WITHIN_M:
            return self._arrive()
        if self._gets_nowhere(percept, left):
            return self._jam(percept)
        if not percept.nearby:
            self._blocked_since = math.inf
            return self._move(percept, self._drive(route, percept), "under_way")
        along = route.length - left
        lane = self._avoidance.lane(route, along, percept.here, percept.nearby, self._side)
        if isinstance(lane, Blocked):
            return self._wait(percept, route, along, lane)
        self._side = lane.side
        self._blocked_since = math.inf
        return self._move(percept, self._drive(Route(lane.points), percept), "under_way")

    def _drive(self, route: Route, percept: Sensed) -> Intent:
        """Return the next motion along a route; where others turn, a car drives a sharp curve."""
        speed, turn_rate = self._driver.drive(
            route, View(percept.now, percept.view, PERIOD), REACHED_WITHIN_M
        )
        return Intent(
            max(speed, min(abs(turn_rate) * self._sharpest, self._reach.speed)), turn_rate
        )

    def _plan(self, percept: Sensed) -> Route | None:
        points = self._planner.path(percept.here, self._goal, self._closed)
        # Everything may be closed by now: an old obstacle on the map must not end the mission.
        if points is None and self._closed:
            self._closed = []
            points = self._planner.path(percept.here, self._goal)
        self._route = None if points is None else Route(points)
        self._progress = math.inf, math.inf
        return self._route

    def _arrive(self) -> PilotStep:
        self._reached += 1
        laps = self._errand.laps
        goals = len(self._errand.goals)
        if laps and self._reached >= laps * goals:
            return self._end("done")
        self._begin_leg()
        return PilotStep(STANDSTILL, "under_way", self._left)

    def _gets_nowhere(self, percept: Sensed, left: float) -> bool:
        best, since = self._progress
        if left < best - 0.1 or self._blocked_since < math.inf:
            self._progress = min(left, best), percept.now
            return False
        return percept.now - since > NO_PROGRESS

    def _look(self, percept: Sensed, inspection: Inspection) -> PilotStep:
        """Face the event and wait for the next order."""
        finding = inspection.finding(percept)
        if inspection.is_over(percept):
            return self._end("done", finding)
        return self._move(percept, inspection.step(percept), "waiting", finding)

    # --- blocked path ------------------------------------------------------------------

    def _with_patience(self, percept: Sensed) -> Sensed:
        """Let a robot that has waited long go nearer to people, until none is in sight."""
        waited = percept.now - self._blocked_since > SQUEEZE_AFTER
        people = any(o.kind == "person" for o in percept.nearby)
        self._squeezing = people and (self._squeezing or waited)
        if not self._squeezing:
            return percept
        closer = tuple(o._replace(keep=min(o.keep, SQUEEZE)) for o in percept.nearby)
        return percept._replace(nearby=closer)

    def _wait(self, percept: Sensed, route: Route, along: float, blocked: Blocked) -> PilotStep:
        """Stop before the obstacle; then step aside, plan a path around it, or give up."""
        self._blocked_since = min(self._blocked_since, percept.now)
        waited = percept.now - self._blocked_since
        if math.hypot(blocked.by.vx, blocked.by.vy) > STANDS_BELOW_MPS:
            self._moved = percept.now
        if waited > GIVE_UP_AFTER:
            return self._end("failed", "no way")
        if waited > SAY_AFTER and self._is_taken(route.length - along, blocked.by):
            return self._arrive()
        crowded = blocked.gap < SQUEEZE
        person = blocked.by.kind == "person"
        if waited > ASIDE_AFTER and crowded and not person and self._lets_pass(percept, blocked.by):
            aside = self._step_aside(percept, route, along, blocked.by)
            if aside is not None:
                return aside
        is_stuck = percept.now - max(self._moved, self._blocked_since) > AROUND_AFTER
        if is_stuck and percept.now - self._looked_around > AROUND_AGAIN:
            around = self._way_around(percept)
            if around is not None:
                return around
        intent = self._drive(Route(blocked.lane.points), percept)
        # Past people it drives on if there is room at all: stepping aside would take longer.
        apart = (
            math.dist(percept.here, (blocked.by.x, blocked.by.y)) if person else blocked.distance
        )
        short = max(apart - STOP_SHORT, 0.0) / 2.0 if crowded else math.inf
        speed = min(intent.speed, short)
        turn = intent.turn_rate * (speed / intent.speed if intent.speed else 1.0)
        if waited < SAY_AFTER:
            return self._move(percept, Intent(speed, turn), "under_way")
        what = "a person" if person else "a robot"
        return self._move(percept, Intent(speed, turn), "waiting", f"{what} is in the way")

    def _is_taken(self, left: float, other: Nearby) -> bool:
        """Return True if somebody stands at the goal, and the robot is as near as it can be."""
        is_stationary = math.hypot(other.vx, other.vy) < STANDS_BELOW_MPS
        gap = math.dist((other.x, other.y), self._goal) - other.radius
        return is_stationary and left < REACHED_IF_TAKEN_M and gap < self._radius + other.keep

    def _lets_pass(self, percept: Sensed, other: Nearby) -> bool:
        """Return True if it should step aside: once for each robot that goes first and stays."""
        x, y = percept.here
        apart = math.dist(percept.here, (other.x, other.y))
        goes_away = (other.vx * (other.x - x) + other.vy * (other.y - y)) > 0.05 * apart
        (first,) = self._avoidance.yields_to(percept.here, [other])
        can = self._sharpest == 0.0 and self._left_aside != other.name
        return can and first and not goes_away

    def _step_aside(
        self, percept: Sensed, route: Route, along: float, other: Nearby
    ) -> PilotStep | None:
        path = np.array([route.point_at(along + s) for s in np.arange(-1.0, 6.0, 0.2).tolist()])
        place = self._avoidance.refuge(percept.here, path, percept.nearby)
        self._left_aside = other.name
        if place is None:
            return None
        self._manoeuvre = Aside(percept, place, path, self._radius, self._reach.turn_rate)
        return self._go_on_with(self._manoeuvre, percept)

    def _way_around(self, percept: Sensed) -> PilotStep | None:
        """Plan again with everybody in sight as part of the map."""
        self._looked_around = percept.now
        before = self._closed
        self._closed = [Disc(o.x, o.y, o.radius + o.keep + DETOUR_MARGIN_M) for o in percept.nearby]
        points = self._planner.path(percept.here, self._goal, self._closed)
        if points is None:
            self._closed = before
            return None
        self._route = Route(points)
        self._progress = math.inf, math.inf
        return PilotStep(STANDSTILL, "replanning", self._left, "the way is closed")

    # --- jams --------------------------------------------------------------------------

    def _jam(self, percept: Sensed) -> PilotStep:
        self._jams += 1
        if self._jams > MAX_JAMS:
            return self._end("failed", "jammed")
        heading = percept.view.heading
        nose = self._radius + 0.1
        x = percept.view.x + nose * math.cos(heading)
        y = percept.view.y + nose * math.sin(heading)
        # The obstacle before its nose is not on the map: the next path has to avoid that place.
        self._closed.append(Disc(x, y, 0.1))
        recovery = JamRecovery(percept, self._guard, self._reach.turn_rate, [heading, *self._tried])
        self._tried.append(recovery.heading)
        self._manoeuvre = recovery
        return self._go_on_with(recovery, percept)

    def _go_on_with(self, manoeuvre: Manoeuvre, percept: Sensed) -> PilotStep:
        intent = manoeuvre.step(percept)
        if intent is None:
            self._manoeuvre = None
            self._route = None
            return PilotStep(STANDSTILL, "under_way", self._left)
        return self._move(percept, intent, manoeuvre.state, manoeuvre.reason)
