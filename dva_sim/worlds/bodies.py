"""Bodies that move: robots, which brake and push, and people, who walk (pymunk)."""

from __future__ import annotations

import math
from typing import Final, NamedTuple, Protocol

import pymunk
from pymunk._chipmunk_cffi import lib

from dva_sim.worlds.contacts import Contacts, Jam
from dva_sim.worlds.drives import DriveSpec
from dva_sim.worlds.geo import Pose

G: Final = 9.81  # [m/s^2]
GRIP: Final = 0.8  # friction coefficient of rubber on a dry floor
TRACK: Final = 0.5  # wheels stand that share of the radius off the middle; assumed
FRICTION, ELASTICITY = 0.3, 0.1  # of bumpers and walls; both multiply in a contact
AT_REST = 1e-3  # slower than this, brakes hold [m/s, rad/s]
WALL, ROBOT, PERSON = 1, 2, 3  # collision types

RELAXATION: Final = 0.5  # of a person's velocity towards the wanted one [s]
MOST_PUSH: Final = 3.0  # force of a person's legs by mass [m/s^2]; assumed

# Straight to the functions behind pymunk's properties, for the hot loop: half the cost.
_get_velocity, _get_position = lib.cpBodyGetVelocity, lib.cpBodyGetPosition
_get_spin, _get_angle = lib.cpBodyGetAngularVelocity, lib.cpBodyGetAngle
_set_velocity, _set_spin = lib.cpBodySetVelocity, lib.cpBodySetAngularVelocity
_set_force, _set_torque = lib.cpBodySetForce, lib.cpBodySetTorque


class Timing(Protocol):
    """What a body needs to know of the world that steps it."""

    @property
    def time(self) -> float:
        """Of the last whole tick [s]."""

    def next_tick(self) -> int:
        """The first tick that a set point given now can reach."""

    def tick_at(self, time: float) -> float:
        """The first tick that begins at `time` [s] or later."""

    def wake(self, body: Body) -> None:
        """The body has to be pushed from the next tick on."""


class SetPoint(NamedTuple):
    """What the motors are asked for from tick `start` on and before tick `end`."""

    speed: float
    turn_rate: float
    start: int
    end: float


STOP = SetPoint(0.0, 0.0, 0, math.inf)


class Body:
    """What all that moves has in common.

    Attributes:
        name: Of the robot or person.
        radius: Of the circle around it [m].
        impulse: Impulse of its contacts so far [N s]; of people only that with robots.
    """

    def __init__(self, world: Timing, name: str, body: pymunk.Body, shape: pymunk.Shape) -> None:
        self.name, self._world, self.body, self.shape = name, world, body, shape
        self._raw = body._body  # what the functions of the library take
        self.radius, self.impulse = 0.0, 0.0
        self._touch = Contacts()

    @property
    def x(self) -> float:
        """Position [m]."""
        return float(_get_position(self._raw).x)

    @property
    def y(self) -> float:
        """Position [m]."""
        return float(_get_position(self._raw).y)

    @property
    def velocity(self) -> tuple[float, float]:
        """Along x and y [m/s]."""
        velocity = _get_velocity(self._raw)
        return velocity.x, velocity.y

    @property
    def contacts(self) -> int:
        """Contacts begun so far: of a robot with anything, of a person with robots."""
        return self._touch.count

    @property
    def in_contact(self) -> bool:
        """Whether it touches anything now that counts as a contact."""
        return self._touch.touching > 0

    @property
    def last_touch(self) -> float:
        """When it last was in contact [s]; the time of the last tick while it still is."""
        return self._world.time if self.in_contact else self._touch.last

    def push(self, tick: int, dt: float) -> bool:
        """Apply its own forces for one tick; False if it stands and shall stand."""
        raise NotImplementedError

    def meets(self, other: Body | None, now: float) -> None:
        """It begins to touch somebody, or a wall (None)."""
        raise NotImplementedError

    def parts(self, other: Body | None, now: float) -> None:
        """It touches somebody, or a wall (None), no longer."""
        raise NotImplementedError

    def feels(self, other: Body | None, impulse: float) -> None:
        """A contact with somebody, or a wall (None), has stopped or pushed it [N s]."""
        raise NotImplementedError


class RobotBody(Body):
    """A robot's body in the world; made by `World.add_robot`.

    Attributes:
        spec: Mass, size, limits.
        distance: Way covered so far [m].
        work: Done by the motors against inertia and what is in the way, without braking [J].
        grip: Friction coefficient of the floor under it; less on a wet one.
    """

    def __init__(self, world: Timing, name: str, spec: DriveSpec, pose: Pose) -> None:
        if spec.corners:
            moment = pymunk.moment_for_poly(spec.mass, spec.corners)
        else:
            moment = pymunk.moment_for_circle(spec.mass, 0.0, spec.radius)
        body = pymunk.Body(spec.mass, moment)
        body.position, body.angle = (pose.x, pose.y), pose.heading
        circle = pymunk.Circle(body, spec.radius)
        shape = pymunk.Poly(body, spec.corners) if spec.corners else circle
        shape.friction, shape.elasticity = FRICTION, ELASTICITY
        shape.collision_type = ROBOT
        super().__init__(world, name, body, shape)
        self.spec, self.radius, self._drive = spec, spec.radius, spec.drive(spec)
        self.distance, self.work, self.grip = 0.0, 0.0, GRIP
        self._powered = True
        self._now, self._next = STOP, STOP
        self._people, self._jam = Contacts(), Jam()
        self._mass, self._moment = spec.mass, body.moment
        self._arm = TRACK * spec.radius

    @property
    def person_contacts(self) -> int:
        """Contacts with people begun so far."""
        return self._people.count

    @property
    def jammed(self) -> bool:
        """Whether it is stuck, by the rules of `dva_sim.worlds.contacts`."""
        return self._jam.holds(*self.pose())

    @property
    def jams(self) -> int:
        """How often it became stuck."""
        return self._jam.count

    @property
    def turning_radius(self) -> float:
        """Of the sharpest curve that it can drive [m]; 0: it turns on the spot."""
        return self._drive.turning_radius

    @property
    def speed(self) -> float:
        """Measured speed along the heading [m/s]."""
        velocity, angle = _get_velocity(self._raw), _get_angle(self._raw)
        return float(velocity.x * math.cos(angle) + velocity.y * math.sin(angle))

    @property
    def turn_rate(self) -> float:
        """Measured turn rate [rad/s]."""
        return float(_get_spin(self._raw))

    def pose(self) -> Pose:
        """Where it is, as of the last whole tick; the heading counts full turns."""
        place = _get_position(self._raw)
        return Pose(place.x, place.y, _get_angle(self._raw))

    @property
    def powered(self) -> bool:
        """Whether the motors obey; without power they brake and stop, from the next tick on."""
        return self._powered

    @powered.setter
    def powered(self, on: bool) -> None:
        self._powered = on
        self._world.wake(self)

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
            speed, turn_rate = self._drive.set_point(speed, turn_rate)
            self._next = SetPoint(speed, turn_rate, start, world.tick_at(until))
        world.wake(self)

    def push(self, tick: int, dt: float) -> bool:
        """Apply the motors' forces for one tick; False if the robot stands and shall stand.

        Wheels hold along and across together no more than the grip of the floor: beyond that
        they slip, and the force keeps its direction (a friction circle).
        """
        raw = self._raw
        if self._next is not self._now and tick >= self._next.start:
            self._now = self._next
        wanted, wanted_spin, _, end = self._now
        if tick >= end or not self._powered:
            wanted = wanted_spin = 0.0
        velocity, spin = _get_velocity(raw), _get_spin(raw)
        vx, vy = velocity.x, velocity.y
        # Bodies are moved before forces act on them: aim along the heading by then.
        angle = _get_angle(raw) + spin * dt
        cos, sin = math.cos(angle), math.sin(angle)
        forward, sideways = vx * cos + vy * sin, vy * cos - vx * sin
        if wanted == wanted_spin == 0.0:
            if abs(forward) + abs(sideways) + abs(spin) < AT_REST:
                _set_velocity(raw, (0.0, 0.0))
                _set_spin(raw, 0.0)
                return self._next is not self._now
        elif self._touch.touching:
            self._jam.strain(*self.pose(), dt)
        along, turn = self._drive.accelerations(wanted, wanted_spin, forward, spin, dt)
        across, most = -sideways / dt, self.grip * G
        asked = math.hypot(along, across)
        if asked > most:
            along, across = along * most / asked, across * most / asked
        along, across = self._mass * along, self._mass * across
        torque, most_torque = self._moment * turn, self._mass * most * self._arm
        if not -most_torque <= torque <= most_torque:
            torque = math.copysign(most_torque, torque)
        _set_force(raw, (along * cos - across * sin, along * sin + across * cos))
        _set_torque(raw, torque)
        self.distance += abs(forward) * dt
        if along > 0.0:
            self.work += along * (forward + 0.5 * dt * along / self._mass) * dt
        return True

    def meets(self, other: Body | None, now: float) -> None:
        """It begins to touch somebody, or a wall (None)."""
        self._touch.begin(now)
        if isinstance(other, PersonBody):
            self._people.begin(now)

    def parts(self, other: Body | None, now: float) -> None:
        """It touches somebody, or a wall (None), no longer."""
        self._touch.end(now)
        if isinstance(other, PersonBody):
            self._people.end(now)

    def feels(self, other: Body | None, impulse: float) -> None:
        """A contact with somebody, or a wall (None), has stopped or pushed it [N s]."""
        self.impulse += impulse
        self._world.wake(self)


class PersonBody(Body):
    """A person seen from above, a disc that walks any way; made by `World.add_person`.

    Legs push towards the wanted velocity as in the model of social forces, with bounded force;
    whom to keep clear of is for the walker to decide.

    References:
        D. Helbing, P. Molnar: Social force model for pedestrian dynamics. Physical Review E
        51(5), 1995: relaxation time 0.5 s.
    """

    def __init__(self, world: Timing, name: str, pose: Pose, radius: float, mass: float) -> None:
        body = pymunk.Body(mass, math.inf)
        body.position = pose.x, pose.y
        shape = pymunk.Circle(body, radius)
        # Who brushes past a wall or somebody else is not held back.
        shape.friction, shape.elasticity, shape.collision_type = 0.0, 0.0, PERSON
        super().__init__(world, name, body, shape)
        self.radius, self._mass, self._circle = radius, mass, shape
        self._now = self._next = (0.0, 0.0, 0)

    def walk(self, vx: float, vy: float) -> None:
        """Want to walk with this velocity [m/s] from the next tick on, until told otherwise.

        Raises:
            ValueError: it is not finite.
        """
        if not (math.isfinite(vx) and math.isfinite(vy)):
            raise ValueError(f"{self.name} cannot walk at {vx} m/s, {vy} m/s")
        self._next = (vx, vy, self._world.next_tick())
        self._world.wake(self)

    def take_up(self, radius: float) -> None:
        """Be so wide from now on [m]: who turns sideways fits through a narrower gap."""
        self.radius = radius
        self._circle.unsafe_set_radius(radius)

    def push(self, tick: int, dt: float) -> bool:
        """Apply the force of the legs for one tick; False if the person stands and shall stand."""
        if self._next is not self._now and tick >= self._next[2]:
            self._now = self._next
        wx, wy, _ = self._now
        vx, vy = self.velocity
        if wx == wy == 0.0 and abs(vx) + abs(vy) < AT_REST:
            _set_velocity(self._raw, (0.0, 0.0))
            return self._next is not self._now
        ax, ay = (wx - vx) / RELAXATION, (wy - vy) / RELAXATION
        asked = math.hypot(ax, ay)
        share = self._mass * min(1.0, MOST_PUSH / asked) if asked > 0.0 else 0.0
        _set_force(self._raw, (ax * share, ay * share))
        return True

    def meets(self, other: Body | None, now: float) -> None:
        """It begins to touch somebody, or a wall (None)."""
        if isinstance(other, RobotBody):
            self._touch.begin(now)

    def parts(self, other: Body | None, now: float) -> None:
        """It touches somebody, or a wall (None), no longer."""
        if isinstance(other, RobotBody):
            self._touch.end(now)

    def feels(self, other: Body | None, impulse: float) -> None:
        """A contact with somebody, or a wall (None), has stopped or pushed it [N s]."""
        self._world.wake(self)
        if isinstance(other, RobotBody):
            self.impulse += impulse
