"""A robot's body: motors push it, wheels hold it as well as the floor lets them."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import pymunk

from dva_sim.worlds.bodies import (
    AT_REST,
    ELASTICITY,
    FRICTION,
    GRIP,
    PERSON,
    ROBOT,
    AskedFor,
    Body,
    Contacts,
    G,
    Jam,
    Timing,
    get_angle,
    get_position,
    get_spin,
    get_velocity,
    set_force,
    set_spin,
    set_torque,
    set_velocity,
)
from dva_sim.worlds.drives import DriveSpec
from dva_sim.worlds.geo import Pose

REST: Final = 8.0  # time constants after which nothing is left of a speed of 1 m/s
TRACK: Final = 0.5  # wheels stand that share of the radius off the middle; assumed


class TickTarget(NamedTuple):
    """What the motors are asked for, before tick `end`."""

    speed: float
    turn_rate: float
    end: float


STOP = TickTarget(0.0, 0.0, math.inf)


class Lock:
    """Wheels that are locked: the floor holds them along, across and turning, up to its grip.

    Friction is solved together with contacts, as forces from one tick to the next would let
    whoever is leant against creep away. Nothing draws the body back to where it was.

    Args:
        space: That the body is in.
        body: Of the robot.
        arm: On which the grip holds against turning [m].
    """

    def __init__(self, space: pymunk.Space, body: pymunk.Body, arm: float) -> None:
        self._space, self._body, self._arm = space, body, arm
        self._joints: list[pymunk.Constraint] = []

    @property
    def closed(self) -> bool:
        """Whether it holds."""
        return bool(self._joints)

    def close(self, grip: float) -> None:
        """Hold from now on, with this friction coefficient of the floor."""
        self.open()
        floor, body, most = self._space.static_body, self._body, grip * G * self._body.mass
        # New ones each time: a joint remembers the impulse with which it held last.
        slide = pymunk.PivotJoint(floor, body, (0.0, 0.0), (0.0, 0.0))
        turn = pymunk.GearJoint(floor, body, 0.0, 1.0)
        slide.max_bias = turn.max_bias = 0.0
        slide.max_force, turn.max_force = most, most * self._arm
        self._joints = [slide, turn]
        self._space.add(*self._joints)

    def open(self) -> None:
        """Let the wheels roll."""
        self._space.remove(*self._joints)
        self._joints = []


class RobotBody(Body):
    """A robot's body in the world; made by `World.add_robot`.

    Attributes:
        spec: Mass, size, limits.
        motors: What they do; how sharply they can turn, and what a user's own got wrong.
        distance: Way covered so far [m].
        work: Done by the motors against inertia and what is in the way, without braking [J].
    """

    kind = ROBOT

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
        shape.collision_type = self.kind
        super().__init__(world, name, body, shape)
        self.spec, self.radius, self.motors = spec, spec.radius, spec.drive(spec)
        self.distance, self.work, self._grip = 0.0, 0.0, GRIP
        self._powered = True
        self._asked = AskedFor(STOP)
        self._people, self._jam = Contacts(), Jam()
        self._mass, self._moment = spec.mass, body.moment
        self._arm = TRACK * spec.radius
        self._lock = Lock(world.space, body, self._arm)
        self._lock.close(GRIP)
        self._braked = 0.0
        stopping = spec.max_speed / spec.max_deceleration
        turning = spec.max_turn_rate / spec.max_turn_acceleration
        self._patience = max(stopping, turning) + REST * spec.motor_time_constant

    @property
    def person_contacts(self) -> int:
        """Contacts with people begun so far."""
        return self._people.count

    @property
    def jammed(self) -> bool:
        """Whether it is stuck, by the rules of `dva_sim.worlds.bodies`."""
        return self._jam.holds(*self.pose())

    @property
    def jams(self) -> int:
        """How often it became stuck."""
        return self._jam.count

    @property
    def speed(self) -> float:
        """Measured speed along the heading [m/s]."""
        velocity, angle = get_velocity(self._raw), get_angle(self._raw)
        return float(velocity.x * math.cos(angle) + velocity.y * math.sin(angle))

    @property
    def turn_rate(self) -> float:
        """Measured turn rate [rad/s]."""
        return float(get_spin(self._raw))

    def pose(self) -> Pose:
        """Where it is, as of the last whole tick; the heading counts full turns."""
        place = get_position(self._raw)
        return Pose(place.x, place.y, get_angle(self._raw))

    @property
    def grip(self) -> float:
        """Friction coefficient of the floor under it; less on a wet one."""
        return self._grip

    @grip.setter
    def grip(self, grip: float) -> None:
        self._grip = grip
        if self._lock.closed:
            self._lock.close(grip)

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
            self._asked.put(start, STOP)
        else:
            speed = min(max(speed, 0.0), spec.max_speed)
            turn_rate = min(max(turn_rate, -spec.max_turn_rate), spec.max_turn_rate)
            speed, turn_rate = self.motors.set_point(speed, turn_rate)
            self._asked.put(start, TickTarget(speed, turn_rate, world.tick_at(until)))
        world.wake(self)

    def push(self, tick: int, dt: float) -> bool:
        """Apply the motors' forces for one tick; False if the robot stands and shall stand.

        Wheels hold along and across together no more than the grip of the floor: beyond that
        they slip, and the force keeps its direction (a friction circle). Who has come to rest
        locks them until it is asked to move; and so does who still moves when its brakes should
        have stopped it, as somebody pushes.
        """
        raw = self._raw
        wanted, wanted_spin, end = self._asked.at(tick)
        if tick >= end or not self._powered:
            wanted = wanted_spin = 0.0
        velocity, spin = get_velocity(raw), get_spin(raw)
        vx, vy = velocity.x, velocity.y
        # Bodies are moved before forces act on them: aim along the heading by then.
        angle = get_angle(raw) + spin * dt
        cos, sin = math.cos(angle), math.sin(angle)
        forward, sideways = vx * cos + vy * sin, vy * cos - vx * sin
        if wanted == wanted_spin == 0.0:
            if abs(forward) + abs(sideways) + abs(spin) < AT_REST:
                set_velocity(raw, (0.0, 0.0))
                set_spin(raw, 0.0)
                if not self._lock.closed:
                    self._lock.close(self._grip)
                return bool(self._asked.coming)
            if self._is_held(dt):
                self.distance += abs(forward) * dt
                return True
        else:
            self._braked = 0.0
            if self._lock.closed:
                self._lock.open()
            if self._touch.touching:
                self._jam.strain(*self.pose(), dt)
        along, turn = self.motors.accelerations(wanted, wanted_spin, forward, spin, dt)
        across, most = -sideways / dt, self._grip * G
        asked = math.hypot(along, across)
        if asked > most:
            along, across = along * most / asked, across * most / asked
        along, across = self._mass * along, self._mass * across
        torque, most_torque = self._moment * turn, self._mass * most * self._arm
        if not -most_torque <= torque <= most_torque:
            torque = math.copysign(most_torque, torque)
        set_force(raw, (along * cos - across * sin, along * sin + across * cos))
        set_torque(raw, torque)
        self.distance += abs(forward) * dt
        power = along * (forward + 0.5 * dt * along / self._mass)  # with the mean of the tick
        spinning = torque * (spin + 0.5 * dt * torque / self._moment)
        self.work += (max(power, 0.0) + max(spinning, 0.0)) * dt
        return True

    def _is_held(self, dt: float) -> bool:
        """Whether wheels are locked that shall stand; also where its brakes were not enough."""
        self._braked += dt
        if self._braked > self._patience and not self._lock.closed:
            self._lock.close(self._grip)
        return self._lock.closed

    def counts(self, other: Body | None) -> tuple[Contacts, ...]:
        """All; those with people by themselves, too."""
        person = other is not None and other.kind == PERSON
        return (self._touch, self._people) if person else (self._touch,)

    def feels(self, other: Body | None, impulse: float) -> None:
        """A contact with somebody, or a wall (None), has stopped or pushed it [N s]."""
        self.impulse += impulse
        self._world.wake(self)
