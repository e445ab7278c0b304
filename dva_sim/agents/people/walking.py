"""Walking: a planned path, a body on it, and reactions to people and robots in the way.

Guards and bystanders walk alike. A way is planned on the map; five times a second, or half as
often where nobody is near, the walker looks where it is and chooses the velocity that its legs
push towards:

- **Nobody near**: straight to the point a little ahead on the way.
- **Somebody near**: by the two rules of `pedestrian_avoidance`: step aside, to the right rather
  than the left, and slow down.
- **In doors** one gives way, by its rules of doors.
- **Held up by a robot**, one turns sideways and squeezes past, if there is a gap.
- **Blocked**: a person who gets no nearer for some seconds looks for a path around those who stand
  there, again and again at longer intervals; who has come no nearer for long says so, and
  it is for the agent to decide what then. So nobody is stuck for ever.
- **At a crowded place** one is there as soon as others keep one from coming nearer.

People who stand cost nothing: steps are made only while somebody walks.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import KW_ONLY, dataclass, field
from typing import Final

from dva_sim.agents.habits import OnFootHabits
from dva_sim.agents.people.pedestrian_avoidance import (
    Courtesy,
    Floats,
    Mover,
    Point,
    beside,
    doors_on,
    find_middles,
    is_clear,
    past,
    velocity,
)
from dva_sim.agents.route_following import Ahead, Route
from dva_sim.kernel.clock import Clock
from dva_sim.worlds.bodies import Body, RobotBody
from dva_sim.worlds.physics import PersonBody, World
from dva_sim.worlds.planning import Disc, Planner

STEP: Final = 0.2  # design: interval of steps [s]
CALM: Final = 0.4  # design: interval of steps far from others and the end [s]
PLANS_EVERY: Final = 1.0  # design: minimum interval between two plans of a path [s]
MAX_SEEN: Final = 8  # design: maximum number of nearest bodies considered


@dataclass(eq=False)
class Walk:
    """One walk of one person.

    Attributes:
        goal: Destination [m].
        arrived: Called at the end of the walk.
        blocked: Called when the walk is given up.
        is_far_enough: Predicate of positions at which the walk may end early.
        avoid: Places to go around.
    """

    goal: Point
    _: KW_ONLY
    arrived: Callable[[], object]
    blocked: Callable[[], object]
    is_far_enough: Callable[[Point], bool]
    route: Route
    courtesy: Courtesy
    avoid: tuple[Disc, ...]
    gone: float = 0.0  # distance covered along the path [m]
    least: float = math.inf  # minimum remaining distance so far [m]
    nearer_at: float = 0.0  # time of the last progress [s]
    looks_around: float = 0.0  # time of the next search for a way around [s]
    planned: float = 0.0  # time at which the path was chosen [s]
    robots: set[Disc] = field(default_factory=set)  # robots that stood in the way


class Walking:
    """A person's legs and manners.

    Args:
        clock: The run's.
        planner: The person knows the building.
        ground: World with all others.
        body: Body of the person.
        speed: Free walking speed [m/s].
        doors: Ends of the doors, shape `(n, 4)` [m].
        habits: Habits of the person; by default the usual ones.

    Attributes:
        habits: Habits of the person.
        heading: Direction of view [rad].
        pace: Share of the free speed that smoke and water leave.
    """

    def __init__(
        self,
        clock: Clock,
        planner: Planner,
        ground: World,
        body: PersonBody,
        *,
        speed: float,
        doors: Floats,
        habits: OnFootHabits | None = None,
    ) -> None:
        self.habits = habits or OnFootHabits()
        self._own = own = self.habits.walking
        self._clock = clock
        self._planner = planner
        self._ground = ground
        self.body = body
        self.speed = speed
        self.heading = 0.0
        self.pace = 1.0
        self._doors = find_middles(doors, own.narrow_m)
        self._walk: Walk | None = None
        self._reach = own.reach_m  # less in a crowd

    @property
    def place(self) -> Point:
        """Present position of the person [m]."""
        self._ground.advance_to(self._clock.now)
        return self.body.x, self.body.y

    @property
    def walks(self) -> bool:
        """True if a walk is in progress."""
        return self._walk is not None

    def go(
        self,
        goal: Point,
        arrived: Callable[[], object],
        blocked: Callable[[], object],
        is_far_enough: Callable[[Point], bool] = lambda at: False,
        avoid: Sequence[Disc] = (),
    ) -> bool:
        """Begin a walk, in place of any earlier one.

        Args:
            goal: Destination [m].
            arrived: Called at the end of the walk.
            blocked: Called if the way is blocked permanently.
            is_far_enough: Predicate of positions at which the walk may end early.
            avoid: Places to go around.

        Returns:
            True if a path exists.
        """
        points = self._planner.path(self.place, goal, avoid)
        if points is None:
            self.stop()
            return False
        now = self._clock.now
        courtesy = Courtesy(doors_on(points, self._doors), self._own)
        route = Route(points)
        keep_off = tuple(avoid)
        walk = Walk(
            goal,
            arrived=arrived,
            blocked=blocked,
            is_far_enough=is_far_enough,
            route=route,
            courtesy=courtesy,
            avoid=keep_off,
        )
        walk.nearer_at = now
        walk.looks_around = now + self._own.tired_s
        self._walk = walk
        self._clock.call_after(0.0, self._step, walk)
        return True

    def places_ahead(self, every: float, reach: float) -> list[Point]:
        """Return the next places on the path, at a spacing and up to a distance [m]."""
        if self._walk is None:
            return []
        route = self._walk.route
        gone = self._walk.gone
        count = int(min(reach, route.length - gone) / every)
        return [route.point_at(gone + every * k) for k in range(1, count + 1)]

    def stop(self) -> None:
        """Stand still."""
        self._walk = None
        self.body.walk(0.0, 0.0)

    # --- one step ----------------------------------------------------------------------

    def _step(self, walk: Walk) -> None:
        if walk is not self._walk:
            return
        here = self.place
        own = self._own
        x, y = here
        ahead = walk.route.ahead(x, y, 0.0, own.look_ahead_m)
        walk.gone = walk.route.length - ahead.remaining
        is_near = ahead.remaining <= own.arrived_m
        if is_near or walk.is_far_enough(here) or self._is_held_up(walk, ahead):
            self.stop()
            walk.arrived()
        elif self._clock.now - walk.nearer_at > own.gives_up_s:
            self.stop()
            walk.blocked()
        else:
            if ahead.offset > own.astray_m and self._clock.now >= walk.planned + PLANS_EVERY:
                self._plan(walk, ())
                ahead = walk.route.ahead(x, y, 0.0, own.look_ahead_m)
            calm = not self._push_on(walk, ahead) and ahead.remaining > own.crowded_m
            self._clock.call_after(CALM if calm else STEP, self._step, walk)

    def _is_held_up(self, walk: Walk, ahead: Ahead) -> bool:
        """Return True if others keep it from a goal that is near; notes progress."""
        now = self._clock.now
        own = self._own
        if ahead.remaining < walk.least - own.nearer_m:
            walk.least = ahead.remaining
            walk.nearer_at = now
            walk.looks_around = now + own.tired_s
        return ahead.remaining < own.crowded_m and now - walk.nearer_at > own.tired_s

    def _push_on(self, walk: Walk, ahead: Ahead) -> bool:
        """Choose the velocity of the next step; return True if anybody is near."""
        speed = min(self.speed * self.pace, ahead.remaining / self._own.braking_s)
        near = self._others()
        if near and self._clock.now >= walk.looks_around:
            self._look_around(walk, near)
        heading = ahead.bearing
        slot = self._slot(walk, near)
        if slot is not None:
            heading = math.atan2(slot[1] - self.body.y, slot[0] - self.body.x)
            aside = self._own.sideways_mps
            vx = aside * math.cos(heading)
            vy = aside * math.sin(heading)
        elif near:
            heading, vx, vy = self._among(walk, ahead, speed, near)
        else:
            vx = speed * math.cos(heading)
            vy = speed * math.sin(heading)
        self.heading = heading
        self.body.walk(vx, vy)
        return bool(near)

    def _among(
        self, walk: Walk, ahead: Ahead, speed: float, near: Sequence[Body]
    ) -> tuple[float, float, float]:
        """Return where to look [rad] and how to walk [m/s] among others."""
        body = self.body
        heading = ahead.bearing
        own = self._own
        me = Mover(body.x, body.y, *body.velocity, body.radius)
        movers = [Mover(o.x, o.y, *o.velocity, o.radius) for o in near]
        door = walk.courtesy.waits_for(body, walk.gone, near, self._clock.now)
        if door is not None:
            x, y = beside(door, body, self._planner.room_at, own)
            heading = math.atan2(y - me.y, x - me.x)
            speed = min(speed, math.dist((x, y), (me.x, me.y)) / own.braking_s)
        elif is_clear(me, heading, speed, movers, own):
            return heading, speed * math.cos(heading), speed * math.sin(heading)
        else:
            heading = self._past_others(walk, ahead)
        return heading, *velocity(me, heading, speed, movers, self._planner.room_at, own)

    def _past_others(self, walk: Walk, ahead: Ahead) -> float:
        """Return the direction from farther off; who stepped aside does not turn back [rad]."""
        x = self.body.x
        y = self.body.y
        far = walk.route.point_at(walk.gone + self._own.look_past_m)
        if not self._planner.line_of_sight((x, y), far):
            return ahead.bearing
        return math.atan2(far[1] - y, far[0] - x)

    def _others(self) -> list[Body]:
        """Return the bodies nearby."""
        body = self.body
        around = self._ground.neighbours(body.x, body.y, self._reach)
        reach = self._own.reach_m
        self._reach = 0.5 * reach if len(around) > 2 * MAX_SEEN else reach
        return [other for other, _ in around if other is not body][:MAX_SEEN]

    # --- in the way --------------------------------------------------------------------

    def _slot(self, walk: Walk, near: Sequence[Body]) -> Point | None:
        """Return where to squeeze past a robot that blocks the way; sideways until it is passed."""
        body = self.body
        own = self._own
        squeezes = body.radius == own.sideways_m
        robots = (o for o in near if isinstance(o, RobotBody))
        robot = next((r for r in robots if _gap(r, body) < own.beside_m), None)
        tired = self._clock.now - walk.nearer_at > own.tired_s
        if robot is None or not (tired or squeezes):
            if squeezes:
                body.take_up(own.radius_m)
            return None
        (ax, ay), (bx, by) = (walk.route.point_at(walk.gone + k) for k in (0.0, own.look_past_m))
        length = math.hypot(bx - ax, by - ay)
        along = (bx - ax) / length, (by - ay) / length
        if (robot.x - body.x) * along[0] + (robot.y - body.y) * along[1] < -robot.radius:
            body.take_up(own.radius_m)
            return None
        body.take_up(own.sideways_m)
        return past(robot, along, body, self._planner.room_at, own.sideways_m)

    def _look_around(self, walk: Walk, near: Sequence[Body]) -> None:
        """Search for a path around standing people, at increasing intervals."""
        now = self._clock.now
        walk.looks_around = now + max(self._own.tired_s, now - walk.nearer_at)
        slow = self._own.standing_mps
        standing = [o for o in near if math.hypot(*o.velocity) < slow]
        walk.robots.update(Disc(o.x, o.y, o.radius) for o in standing if isinstance(o, RobotBody))
        in_way = sorted(walk.robots | {Disc(o.x, o.y, o.radius) for o in standing})
        if in_way and self._plan(walk, in_way):
            walk.least = walk.route.length

    def _plan(self, walk: Walk, avoid: Sequence[Disc]) -> bool:
        """Change to another path from here; return False if there is none."""
        points = self._planner.path(self.place, walk.goal, (*walk.avoid, *avoid))
        if points is None:
            return False
        walk.route = Route(points)
        walk.courtesy = Courtesy(doors_on(points, self._doors), self._own)
        walk.planned = self._clock.now
        walk.gone = 0.0
        return True


def _gap(one: Body, other: Body) -> float:
    """Return the gap between two bodies [m]."""
    return math.dist((one.x, one.y), (other.x, other.y)) - one.radius - other.radius
