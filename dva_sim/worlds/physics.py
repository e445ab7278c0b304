"""Physics of moving bodies seen from above: robots and people push, slip and stop (pymunk).

Motors are in `drives`; the grip of wheels, contacts and jams in `bodies`. Drives are tested in a
bare `hall` with arbitrary walls.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Final

import numpy as np
import pymunk
import shapely

from dva_sim.kernel.errors import ConfigError
from dva_sim.worlds.bodies import (
    BRAKES_BELOW,
    ELASTICITY,
    FRICTION,
    PERSON,
    ROBOT,
    WALL,
    AskedFor,
    Body,
    Contacts,
    RobotBody,
    Ticks,
)
from dva_sim.worlds.drives import DriveSpec
from dva_sim.worlds.geo import Pose
from dva_sim.worlds.maps import FREE, rasterise
from dva_sim.worlds.site import DEFAULT_FRAME, Site

MASS: Final = 75.0  # mass of an adult [kg]
RELAXATION: Final = 0.5  # relaxation time of a person's velocity towards the wanted one [s]
MAX_PUSH: Final = 3.0  # maximum force of a person's legs per mass [m/s^2]; assumed


class PersonBody(Body):
    """Person seen from above, a disc that walks in any direction; made by `World.add_person`.

    Legs push towards the wanted velocity as in the model of social forces, with bounded force. The
    walker's own logic keeps clear of others.

    References:
        D. Helbing, P. Molnar: Social force model for pedestrian dynamics. Physical Review E
        51(5), 1995: relaxation time 0.5 s.
    """

    kind = PERSON

    def __init__(self, world: Ticks, name: str, pose: Pose, radius: float) -> None:
        # An infinite moment of inertia: contacts do not turn a person.
        body = pymunk.Body(MASS, math.inf)
        body.position = pose.x, pose.y
        shape = pymunk.Circle(body, radius)
        # Brushing past a wall or another body does not slow a person down.
        shape.friction = 0.0
        shape.elasticity = 0.0
        shape.collision_type = self.kind
        super().__init__(world, name, body, shape)
        self.radius = radius
        self._circle = shape
        self._asked = AskedFor((0.0, 0.0))

    def walk(self, vx: float, vy: float) -> None:
        """Set the wanted velocity [m/s] from the next tick on.

        Raises:
            ValueError: it is not finite.
        """
        if not (math.isfinite(vx) and math.isfinite(vy)):
            raise ValueError(f"{self.name} cannot walk at {vx} m/s, {vy} m/s")
        self._asked.put(self._world.next_tick(), (vx, vy))
        self._world.wake(self)

    def take_up(self, radius: float) -> None:
        """Set the radius [m]: a person who turns sideways fits through a narrower gap."""
        self.radius = radius
        self._circle.unsafe_set_radius(radius)

    def push(self, tick: int, dt: float) -> bool:
        """Apply the force of the legs for one tick; False if the person stands as requested."""
        wx, wy = self._asked.at(tick)
        vx, vy = self.velocity
        if wx == wy == 0.0 and abs(vx) + abs(vy) < BRAKES_BELOW:
            self.body.velocity = (0.0, 0.0)
            return bool(self._asked.coming)
        ax = (wx - vx) / RELAXATION
        ay = (wy - vy) / RELAXATION
        wish = math.hypot(ax, ay)
        share = MASS * min(1.0, MAX_PUSH / wish) if wish > 0.0 else 0.0
        self.body.force = (ax * share, ay * share)
        return True

    def counts(self, other: Body | None) -> tuple[Contacts, ...]:
        """Return only contacts with robots."""
        return (self._touch,) if other is not None and other.kind == ROBOT else ()


SLOP = 0.005  # overlap that a contact may keep; pymunk's default is for pixels [m]
OVERLAP = 0.02  # overlap with a wall that is forgiven when a body is placed [m]

_FIXED = 0b01  # categories, by which queries of the space can leave walls out
_MOVING = 0b10
_MOVERS = pymunk.ShapeFilter(mask=_MOVING)


class World(Ticks):
    """World of one site: walls, robots and people.

    Args:
        site: Site with the walls.
        dt: Length of a tick [s], a whole number of microseconds.

    Attributes:
        robots: Robots in the order in which they were added.
        people: People in the order in which they were added.
    """

    def __init__(self, site: Site, dt: float = 0.02) -> None:
        super().__init__(dt)
        self.site = site
        self.robots: list[RobotBody] = []
        self.people: list[PersonBody] = []
        self.space.collision_slop = SLOP
        self._by_shape: dict[pymunk.Shape, Body] = {}
        self.space.add(*(_wall(self.space, *ends) for ends in site.walls.tolist()))
        for one, other in ((ROBOT, WALL), (ROBOT, ROBOT), (ROBOT, PERSON), (PERSON, PERSON)):
            self.space.on_collision(
                one, other, begin=self._begin, post_solve=self._solved, separate=self._separate
            )

    def add_robot(self, name: str, spec: DriveSpec, pose: Pose) -> RobotBody:
        """Place a robot.

        Raises:
            ConfigError: something is in its way, or it is too fast for the length of a tick.
        """
        if spec.max_speed > spec.safe_speed(self.dt):
            most = f"should be at most {spec.safe_speed(self.dt):.3g} m/s at {self.dt:g} s a tick"
            raise ConfigError(f"robot {name!r} is too fast for its size: {most}")
        self._check_place("robot", name, pose, spec.radius)
        robot = RobotBody(self, name, spec, pose)
        self._add(robot)
        self.robots.append(robot)
        return robot

    def add_person(self, name: str, pose: Pose, radius: float = 0.25) -> PersonBody:
        """Place a person, whose size [m] is that of an adult unless it is given.

        Raises:
            ConfigError: a wall, a robot or another person is in the way.
        """
        self._check_place("person", name, pose, radius)
        person = PersonBody(self, name, pose, radius)
        self._add(person)
        self.people.append(person)
        return person

    def put(self, person: PersonBody, x: float, y: float) -> None:
        """Move a person to another place at once [m].

        Raises:
            ConfigError: a wall, a robot or another person is in the way.
        """
        shape = person.shape
        shape.filter = pymunk.ShapeFilter(categories=0)  # the person's own shape must not count
        try:
            self._check_place("person", person.name, Pose(x, y, 0.0), person.radius)
        finally:
            shape.filter = pymunk.ShapeFilter(categories=_MOVING)
        person.body.position = (x, y)
        person.body.velocity = (0.0, 0.0)
        self.space.reindex_shapes_for_body(person.body)
        self.wake(person)

    def remove(self, person: PersonBody) -> None:
        """Remove a person who has left the site; its body keeps its last position."""
        self.people.remove(person)
        self.forget(person)
        self.space.remove(person.body, person.shape)
        del self._by_shape[person.shape]

    def _check_place(self, kind: str, name: str, pose: Pose, radius: float) -> None:
        near = self.space.point_query_nearest(
            (pose.x, pose.y), radius - OVERLAP, pymunk.ShapeFilter()
        )
        if near is None and self.site.grid.state_at(pose.x, pose.y) == FREE:
            return
        there = self._by_shape.get(near.shape) if near is not None and near.shape else None
        what = {RobotBody: "another robot", PersonBody: "a person"}.get(type(there), "a wall")
        if kind == "person":
            what = {"another robot": "a robot", "a person": "another person"}.get(what, what)
        problem = f"{kind} {name!r} does not fit at x {pose.x:.2f} m, y {pose.y:.2f} m"
        raise ConfigError(f"{problem} of site {self.site.name!r}: {what} is in its way")

    def _add(self, body: Body) -> None:
        body.shape.filter = pymunk.ShapeFilter(categories=_MOVING)
        self.space.add(body.body, body.shape)
        self._by_shape[body.shape] = body

    def neighbours(self, x: float, y: float, within: float) -> list[tuple[Body, float]]:
        """Return robots and people with their middle near a point [m], nearest first."""
        neighbours = []
        for hit in self.space.point_query((x, y), within, _MOVERS):
            assert hit.shape is not None
            body = self._by_shape[hit.shape]
            distance = math.hypot(body.x - x, body.y - y)
            # The query finds bodies whose edge is near enough, too.
            if distance <= within:
                neighbours.append((body, distance))
        # By name where distances are equal, since the order of the query is arbitrary.
        return sorted(neighbours, key=lambda pair: (pair[1], pair[0].name))

    # --- contacts ----------------------------------------------------------------------

    def _pair(self, arbiter: pymunk.Arbiter) -> tuple[tuple[Body, Body | None], ...]:
        """Return each body of a contact with the one it touches; None stands for a wall."""
        one, other = (self._by_shape.get(shape) for shape in arbiter.shapes)
        sides = ((one, other), (other, one))
        return tuple((body, partner) for body, partner in sides if body is not None)

    def _begin(self, arbiter: pymunk.Arbiter, space: pymunk.Space, data: object) -> None:
        for body, partner in self._pair(arbiter):
            body.meets(partner, self.time)

    def _solved(self, arbiter: pymunk.Arbiter, space: pymunk.Space, data: object) -> None:
        impulse = arbiter.total_impulse.length
        for body, partner in self._pair(arbiter):
            body.feels(partner, impulse)

    def _separate(self, arbiter: pymunk.Arbiter, space: pymunk.Space, data: object) -> None:
        for body, partner in self._pair(arbiter):
            body.parts(partner, self.time)


def _wall(space: pymunk.Space, x1: float, y1: float, x2: float, y2: float) -> pymunk.Segment:
    wall = pymunk.Segment(space.static_body, (x1, y1), (x2, y2), 0.0)
    wall.friction = FRICTION
    wall.elasticity = ELASTICITY
    wall.collision_type = WALL
    wall.filter = pymunk.ShapeFilter(categories=_FIXED)
    return wall


Segment = tuple[float, float, float, float]


def hall(width: float, depth: float, walls: Sequence[Segment] = ()) -> Site:
    """Return a hall with a corner at 0, 0, and walls in it [m], thin as all walls are."""
    corners = [(0, 0), (width, 0), (width, depth), (0, depth), (0, 0)]
    border = [(*a, *b) for a, b in itertools.pairwise(corners)]
    lines = np.array([*border, *walls], float)
    return Site(
        name="hall",
        frame=DEFAULT_FRAME,
        walls=lines,
        extent=(0.0, 0.0, width, depth),
        grid=rasterise(shapely.box(0, 0, width, depth), lines, 0.1),
    )
