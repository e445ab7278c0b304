"""Moving bodies seen from above: robots that push, slip and stop (pymunk, no gravity)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import pymunk

from dva_sim.errors import ConfigError
from dva_sim.worlds.geo import Pose
from dva_sim.worlds.maps import FREE
from dva_sim.worlds.site import Site

US = 1_000_000
GRIP = 0.8 * 9.81  # largest acceleration that tyres hold sideways [m/s^2]
FRICTION, ELASTICITY = 0.3, 0.1  # of bumpers and walls; both multiply in a contact
SLOP = 0.005  # overlap that a contact may keep; pymunk's default is for pixels [m]
OVERLAP = 0.02  # overlap with a wall that is forgiven when a robot is placed [m]
AT_REST = 1e-3  # slower than this, brakes hold [m/s, rad/s]
SAME_CONTACT = 0.5  # touching again within this time is the same contact [s]
ROBOT, WALL = 1, 2

# Bound once: the functions behind pymunk's properties skip a layer in the hot loop.
_set_force = pymunk.Body.force.fset  # type: ignore[attr-defined]
_set_torque = pymunk.Body.torque.fset  # type: ignore[attr-defined]
_set_velocity = pymunk.Body.velocity.fset  # type: ignore[attr-defined]
_set_spin = pymunk.Body.angular_velocity.fset  # type: ignore[attr-defined]
_get_velocity = pymunk.Body.velocity.fget  # type: ignore[attr-defined]
_get_spin = pymunk.Body.angular_velocity.fget  # type: ignore[attr-defined]
_get_angle = pymunk.Body.angle.fget  # type: ignore[attr-defined]
_get_position = pymunk.Body.position.fget  # type: ignore[attr-defined]


@dataclass(frozen=True)
class DriveSpec:
    """Body and motors of a robot.

    Attributes:
        mass: [kg]
        radius: Of the circular footprint [m].
        max_speed: Forward only [m/s].
        max_turn_rate: Either way [rad/s].
        max_acceleration: [m/s^2]
        max_deceleration: [m/s^2]
        max_turn_acceleration: Either way [rad/s^2].
        motor_time_constant: How fast speed follows the set point [s].
    """

    mass: float = 60.0
    radius: float = 0.30
    max_speed: float = 0.5
    max_turn_rate: float = math.pi / 6
    max_acceleration: float = 0.5
    max_deceleration: float = 1.0
    max_turn_acceleration: float = 1.5
    motor_time_constant: float = 0.15


@dataclass(frozen=True, slots=True)
class SetPoint:
    """What the motors are asked for from tick `start` on and before tick `end`."""

    speed: float
    turn_rate: float
    start: int
    end: float


STOP = SetPoint(0.0, 0.0, 0, math.inf)


class RobotBody:
    """A robot's body in the world; made by `World.add_robot`.

    Attributes:
        name: Of the robot.
        spec: Mass, size, limits.
        distance: Way covered so far [m].
        contacts: Contacts begun so far with walls or other robots.
        impulse: Impulse of all contacts so far [N s].
    """

    def __init__(self, world: World, name: str, spec: DriveSpec, pose: Pose) -> None:
        self.name, self.spec, self._world = name, spec, world
        self.distance, self.contacts, self.impulse = 0.0, 0, 0.0
        self._touching = 0
        self._last_touch = -math.inf
        self._now, self._next = STOP, STOP
        moment = pymunk.moment_for_circle(spec.mass, 0.0, spec.radius)
        self.body = pymunk.Body(spec.mass, moment)
        self.body.position, self.body.angle = (pose.x, pose.y), pose.heading
        self.shape = pymunk.Circle(self.body, spec.radius)
        self.shape.friction, self.shape.elasticity = FRICTION, ELASTICITY
        self.shape.collision_type = ROBOT

    @property
    def in_contact(self) -> bool:
        """Whether it touches anything now."""
        return self._touching > 0

    @property
    def last_touch(self) -> float:
        """When it last touched anything [s]; the time of the last tick while it still does."""
        return self._world.time if self.in_contact else self._last_touch

    @property
    def speed(self) -> float:
        """Measured speed along the heading [m/s]."""
        velocity, angle = _get_velocity(self.body), _get_angle(self.body)
        return float(velocity[0] * math.cos(angle) + velocity[1] * math.sin(angle))

    @property
    def turn_rate(self) -> float:
        """Measured turn rate [rad/s]."""
        return float(_get_spin(self.body))

    def pose(self) -> Pose:
        """Where it is, as of the last whole tick; the heading counts full turns."""
        x, y = _get_position(self.body)
        return Pose(x, y, _get_angle(self.body))

    def drive(self, speed: float, turn_rate: float, until: float) -> None:
        """Take a set point: from the next tick on until `until` [s], then stop.

        Whatever is asked for, the motors get a forward speed [m/s] and a turn rate [rad/s]
        within the limits; anything that is not a number, or not finite, means stop.
        """
        world, spec = self._world, self.spec
        start = world.next_tick()
        if not (math.isfinite(speed) and math.isfinite(turn_rate)) or math.isnan(until):
            self._next = SetPoint(0.0, 0.0, start, math.inf)
        else:
            speed = min(max(speed, 0.0), spec.max_speed)
            turn_rate = min(max(turn_rate, -spec.max_turn_rate), spec.max_turn_rate)
            self._next = SetPoint(speed, turn_rate, start, world.tick_at(until))
        world.wake()

    def push(self, tick: int, dt: float) -> bool:
        """Apply the motors' forces for one tick; False if the robot stands and shall stand."""
        body, spec = self.body, self.spec
        if self._next is not self._now and tick >= self._next.start:
            self._now = self._next
        wanted, wanted_spin = self._now.speed, self._now.turn_rate
        if tick >= self._now.end:
            wanted = wanted_spin = 0.0
        velocity, spin = _get_velocity(body), _get_spin(body)
        # pymunk moves a body before it applies forces: aim along the heading by then.
        angle = _get_angle(body) + spin * dt
        cos, sin = math.cos(angle), math.sin(angle)
        forward = velocity[0] * cos + velocity[1] * sin
        sideways = velocity[1] * cos - velocity[0] * sin
        if wanted == wanted_spin == 0.0 and abs(forward) + abs(sideways) + abs(spin) < AT_REST:
            _set_velocity(body, (0.0, 0.0))
            _set_spin(body, 0.0)
            return self._next is not self._now
        gain = 1.0 / max(spec.motor_time_constant, dt)
        change = (wanted - forward) * gain
        change = min(max(change, -spec.max_deceleration), spec.max_acceleration)
        turn = (wanted_spin - spin) * gain
        turn = min(max(turn, -spec.max_turn_acceleration), spec.max_turn_acceleration)
        slip = min(max(-sideways / dt, -GRIP), GRIP)
        along, across = spec.mass * change, spec.mass * slip
        _set_force(body, (along * cos - across * sin, along * sin + across * cos))
        _set_torque(body, 0.5 * spec.mass * spec.radius**2 * turn)
        self.distance += abs(forward) * dt
        return True


class World:
    """Walls and robots of one site, stepped in whole ticks up to when somebody looks.

    Args:
        site: Gives the walls.
        dt: Length of a tick [s], a whole number of microseconds.
    """

    def __init__(self, site: Site, dt: float = 0.02) -> None:
        self.dt = dt
        self.robots: list[RobotBody] = []
        self.space = pymunk.Space()
        self.space.collision_slop = SLOP
        self._site = site
        self._tick_us = round(dt * US)
        self._tick, self._now_us, self._awake = 0, 0, False
        self._by_shape: dict[pymunk.Shape, RobotBody] = {}
        self.space.add(*(_wall(self.space, *ends) for ends in site.walls.tolist()))
        for other in (WALL, ROBOT):
            self.space.on_collision(
                ROBOT, other, begin=self._begin, post_solve=self._solved, separate=self._separate
            )

    def add_robot(self, name: str, spec: DriveSpec, pose: Pose) -> RobotBody:
        """Place a robot.

        Raises:
            ConfigError: a wall or another robot is in its way.
        """
        reach = spec.radius - OVERLAP
        near = self.space.point_query_nearest((pose.x, pose.y), reach, pymunk.ShapeFilter())
        if near is not None or self._site.grid.state_at(pose.x, pose.y) != FREE:
            problem = f"robot {name!r} does not fit at x {pose.x:.2f} m, y {pose.y:.2f} m"
            obstacle = near is not None and near.shape in self._by_shape
            what = "another robot" if obstacle else "a wall"
            raise ConfigError(f"{problem} of site {self._site.name!r}: {what} is in its way")
        robot = RobotBody(self, name, spec, pose)
        self.space.add(robot.body, robot.shape)
        self.robots.append(robot)
        self._by_shape[robot.shape] = robot
        return robot

    def wake(self) -> None:
        """A set point has changed: time must be stepped again."""
        self._awake = True

    def tick_at(self, time: float) -> float:
        """The first tick that begins at `time` [s] or later."""
        return math.inf if time == math.inf else -(round(-max(time, 0.0) * US) // self._tick_us)

    @property
    def time(self) -> float:
        """Of the last whole tick [s]."""
        return self._tick * self.dt

    def next_tick(self) -> int:
        """The first tick that a set point given now can reach."""
        return max(self._tick, -(-self._now_us // self._tick_us))

    def advance_to(self, time: float) -> None:
        """Let the bodies move up to `time` [s], in whole ticks; never back."""
        self._now_us = max(self._now_us, round(time * US))
        due = self._now_us // self._tick_us
        step, dt, robots = self.space.step, self.dt, self.robots
        while self._tick < due and self._awake:
            awake = False
            for robot in robots:
                awake = robot.push(self._tick, dt) or awake
            if awake:
                step(dt)
            self._awake = awake
            self._tick += 1
        self._tick = max(self._tick, due)

    # --- contacts ----------------------------------------------------------------------

    def _robots_of(self, arbiter: pymunk.Arbiter) -> list[RobotBody]:
        return [self._by_shape[s] for s in arbiter.shapes if s in self._by_shape]

    def _begin(self, arbiter: pymunk.Arbiter, space: pymunk.Space, data: object) -> None:
        """A scrape along a ragged wall is one contact, however many segments it has."""
        now = self.time
        for robot in self._robots_of(arbiter):
            if not robot._touching and now - robot._last_touch > SAME_CONTACT:
                robot.contacts += 1
            robot._touching += 1

    def _solved(self, arbiter: pymunk.Arbiter, space: pymunk.Space, data: object) -> None:
        for robot in self._robots_of(arbiter):
            robot.impulse += arbiter.total_impulse.length

    def _separate(self, arbiter: pymunk.Arbiter, space: pymunk.Space, data: object) -> None:
        for robot in self._robots_of(arbiter):
            robot._touching -= 1
            robot._last_touch = self.time


def _wall(space: pymunk.Space, x1: float, y1: float, x2: float, y2: float) -> pymunk.Segment:
    wall = pymunk.Segment(space.static_body, (x1, y1), (x2, y2), 0.0)
    wall.friction, wall.elasticity, wall.collision_type = FRICTION, ELASTICITY, WALL
    return wall
