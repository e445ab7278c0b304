"""Contacts and jams of bodies: the rules, their counters, and the bodies themselves.

Robots have no reverse: one that has driven into something has to turn away from it, or waits
for help. The rules:

- **A contact** begins when a robot touches a wall, another robot or a person, having touched
  nothing for `SAME_CONTACT`. A scrape along a ragged wall is one contact, however many segments
  it has, and so is a push during which both sides part for a moment. Contacts with people are
  counted among all, and once more by themselves.
- **A jam**: a robot touches something, was commanded to drive or turn for `JAM_TIME` in all, and
  in that time moved less than `JAM_WAY` and turned less than `JAM_TURN`. Time without a command
  does not count, and resets nothing. A robot without power gets no commands: it fails, but it is
  not jammed.
- **Recovery**: the robot turns on the spot, if its drive can, until the path ahead is free, and
  drives on; or it is pushed. As soon as it has moved `JAM_WAY` or turned `JAM_TURN` it is no
  longer jammed. A car cannot turn without moving ahead: one whose nose touches a wall stays
  jammed.
- **Help**: only a person beside it can free it. In a run nobody does: a jam ends a car's task, and
  is counted as the cause.

The second part holds what moving bodies have in common (pymunk), and the body of a robot: motors
push it, and wheels hold it as far as the grip of the floor allows.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from typing import Final, Generic, NamedTuple, TypeVar

import pymunk

from dva_sim.kernel.makers import maker
from dva_sim.worlds.drives import DriveSpec
from dva_sim.worlds.geo import Pose, make_pose

SAME_CONTACT: Final = 0.5  # touching again within this time is the same contact [s]
JAM_TIME: Final = 5.0  # time of requested motion in contact that counts as a jam [s]; assumed
JAM_WAY: Final = 0.05  # distance below which the body has not moved [m]; assumed
JAM_TURN: Final = 0.1  # turn below which it has not turned [rad]; assumed


class Contacts:
    """Contacts of one kind that a body has had.

    Attributes:
        count: Contacts begun so far.
        touching: Shapes that it touches now.
        last: Time at which it last ceased to touch one [s].
    """

    def __init__(self) -> None:
        self.count = 0
        self.touching = 0
        self.last = -math.inf

    def begin(self, now: float) -> None:
        """Begin to touch one more shape."""
        if not self.touching and now - self.last > SAME_CONTACT:
            self.count += 1
        self.touching += 1

    def end(self, now: float) -> None:
        """Touch one shape less."""
        self.touching -= 1
        self.last = now


class Jam:
    """Detector of a jammed robot, fed with every tick in which the robot strains against something.

    Attributes:
        count: Number of jams.
    """

    def __init__(self) -> None:
        self.count = 0
        self._since = 0.0
        self._x = self._y = self._heading = math.inf

    def strain(self, x: float, y: float, heading: float, dt: float) -> None:
        """Note that a body was asked to move for a tick while it touched something [m, rad]."""
        if not self._near(x, y, heading):
            self._x = x
            self._y = y
            self._heading = heading
            self._since = 0.0
        if self._since < JAM_TIME <= self._since + dt:
            self.count += 1
        self._since += dt

    def holds(self, x: float, y: float, heading: float) -> bool:
        """Return True if it is jammed at this pose [m, rad]."""
        return self._since >= JAM_TIME and self._near(x, y, heading)

    def _near(self, x: float, y: float, heading: float) -> bool:
        distance = math.hypot(x - self._x, y - self._y)
        return distance < JAM_WAY and abs(heading - self._heading) < JAM_TURN


US: Final = 1_000_000
G: Final = 9.81  # acceleration of gravity [m/s^2]
GRIP: Final = 0.8  # friction coefficient of rubber on a dry floor
FRICTION = 0.3  # coefficient of bumpers and of walls; both multiply in a contact
ELASTICITY = 0.1  # coefficient of bumpers and of walls; both multiply in a contact
BRAKES_BELOW = 1e-3  # brakes hold a slower body [m/s, rad/s]
WALL = 1  # collision type
ROBOT = 2  # collision type
PERSON = 3  # collision type

# Assigning to an attribute of pymunk costs twice as much as calling the function behind it.
_set_force: Callable[[pymunk.Body, tuple[float, float]], None] = pymunk.Body.force.fset  # type: ignore[attr-defined]
_set_torque: Callable[[pymunk.Body, float], None] = pymunk.Body.torque.fset  # type: ignore[attr-defined]

T = TypeVar("T")


class AskedFor(Generic[T]):
    """Commands to a body: the current one, and those of later ticks.

    A command still acts in its tick, however soon a newer one follows.

    Args:
        first: Initial request.

    Attributes:
        now: Current request.
        coming: Future requests, each with its first tick.
    """

    __slots__ = ("coming", "now")

    def __init__(self, first: T) -> None:
        self.now = first
        self.coming: deque[tuple[int, T]] = deque()

    def put(self, start: int, what: T) -> None:
        """Set the motion from tick `start` on; starts never go back."""
        if self.coming and self.coming[-1][0] == start:
            self.coming.pop()
        self.coming.append((start, what))

    @property
    def newest(self) -> T:
        """Value that was set last."""
        return self.coming[-1][1] if self.coming else self.now

    def at(self, tick: int) -> T:
        """Return the value that holds in a tick; ticks must be queried in order."""
        coming = self.coming
        while coming and coming[0][0] <= tick:
            self.now = coming.popleft()[1]
        return self.now


class Ticks:
    """Space that is stepped in whole ticks, only when its state is needed.

    A standing body without requests sleeps: it costs nothing until requested or touched.

    Args:
        dt: Length of a tick [s], a whole number of microseconds.

    Attributes:
        space: Pymunk space of the bodies.
    """

    def __init__(self, dt: float) -> None:
        self.dt = dt
        self.space = pymunk.Space()
        self._tick_us = round(dt * US)
        self._tick = 0
        self._now_us = 0
        # Ordered, since the order of forces must be the same in each process.
        self._awake: dict[Body, None] = {}  # a set that keeps its order

    def wake(self, body: Body) -> None:
        """Wake a body with a new command or contact: it is pushed from the next tick on."""
        self._awake[body] = None

    def forget(self, body: Body) -> None:
        """Forget a body that is not pushed any more."""
        self._awake.pop(body, None)

    def tick_at(self, time: float) -> float:
        """Return the first tick that begins at `time` [s] or later."""
        time = time if time > 0.0 else 0.0
        return math.inf if time == math.inf else -(round(-time * US) // self._tick_us)

    @property
    def time(self) -> float:
        """Time of the last whole tick [s]."""
        return self._tick * self.dt

    def next_tick(self) -> int:
        """Return the first tick that a set point given now can reach."""
        due = -(-self._now_us // self._tick_us)
        return due if due > self._tick else self._tick

    def advance_to(self, time: float) -> None:
        """Let the bodies move up to `time` [s], in whole ticks; never back."""
        now_us = round(time * US)
        if now_us <= self._now_us:
            return
        self._now_us = now_us
        due = now_us // self._tick_us
        tick = self._tick
        dt = self.dt
        awake = self._awake
        stand: list[Body] = []
        while tick < due and awake:
            for body in awake:
                if not body.push(tick, dt):
                    stand.append(body)
            while stand:
                del awake[stand.pop()]
            if awake:
                self.space.step(dt)
            self._tick = tick = tick + 1
        if tick < due:
            self._tick = due


class Body:
    """Base class of everything that moves.

    Attributes:
        name: Name of the robot or person.
        kind: `ROBOT` or `PERSON`.
        radius: Radius of the enclosing circle [m].
        impulse: Impulse of its contacts so far [N s]; of people only that with robots.
    """

    kind: int

    def __init__(self, world: Ticks, name: str, body: pymunk.Body, shape: pymunk.Shape) -> None:
        self.name = name
        self._world = world
        self.body = body
        self.shape = shape
        self.radius = 0.0
        self.impulse = 0.0
        self._touch = Contacts()

    @property
    def x(self) -> float:
        """Position [m]."""
        return self.body.position.x

    @property
    def y(self) -> float:
        """Position [m]."""
        return self.body.position.y

    @property
    def velocity(self) -> tuple[float, float]:
        """Velocity along x and y [m/s]."""
        velocity = self.body.velocity
        return velocity.x, velocity.y

    @property
    def contacts(self) -> int:
        """Number of contacts so far: of a robot with anything, of a person with robots."""
        return self._touch.count

    @property
    def in_contact(self) -> bool:
        """True if it touches anything now that counts as a contact."""
        return self._touch.touching > 0

    @property
    def last_touch(self) -> float:
        """Time of the last contact [s]; that of the last tick while it lasts."""
        return self._world.time if self.in_contact else self._touch.last

    def push(self, tick: int, dt: float) -> bool:
        """Apply its own forces for one tick; False if it stands as requested."""
        raise NotImplementedError

    def counts(self, other: Body | None) -> tuple[Contacts, ...]:
        """Return the counters of a contact with a body, or with a wall (None)."""
        raise NotImplementedError

    def meets(self, other: Body | None, now: float) -> None:
        """Begin a contact with a body, or with a wall (None)."""
        for contacts in self.counts(other):
            contacts.begin(now)

    def parts(self, other: Body | None, now: float) -> None:
        """End a contact with a body, or with a wall (None)."""
        for contacts in self.counts(other):
            contacts.end(now)

    def feels(self, other: Body | None, impulse: float) -> None:
        """Add the impulse of a contact with a body, or with a wall (None) [N s]."""
        self._world.wake(self)
        if self.counts(other):
            self.impulse += impulse


REST: Final = 8.0  # time constants after which nothing remains of a speed of 1 m/s
TRACK: Final = 0.5  # distance of the wheels from the middle, as a share of the radius; assumed


class TickTarget(NamedTuple):
    """Target of the motors before tick `end`."""

    speed: float
    turn_rate: float
    end: float


_make_target = maker(TickTarget)


STOP = TickTarget(0.0, 0.0, math.inf)


class Lock:
    """Locked wheels: the floor holds them along, across and against turning, up to its grip.

    Friction is solved together with contacts: forces from one tick to the next would let a robot
    creep that others lean against. Nothing pulls the body back to where it was.

    Args:
        space: Space of the body.
        body: Body of the robot.
        arm: On which the grip holds against turning [m].

    Attributes:
        closed: True while the wheels are locked.
    """

    def __init__(self, space: pymunk.Space, body: pymunk.Body, arm: float) -> None:
        self._space = space
        self._body = body
        self._arm = arm
        self._joints: list[pymunk.Constraint] = []
        self.closed = False

    def close(self, grip: float) -> None:
        """Hold from now on, with this friction coefficient of the floor."""
        self.open()
        floor = self._space.static_body
        body = self._body
        most = grip * G * self._body.mass
        # New ones each time: a joint remembers the impulse with which it held last.
        slide = pymunk.PivotJoint(floor, body, (0.0, 0.0), (0.0, 0.0))
        turn = pymunk.GearJoint(floor, body, 0.0, 1.0)
        slide.max_bias = turn.max_bias = 0.0
        slide.max_force = most
        turn.max_force = most * self._arm
        self._joints = [slide, turn]
        self.closed = True
        self._space.add(*self._joints)

    def open(self) -> None:
        """Let the wheels roll."""
        self._space.remove(*self._joints)
        self._joints = []
        self.closed = False


class RobotBody(Body):
    """A robot's body in the world; made by `World.add_robot`.

    Attributes:
        spec: Mass, size, limits.
        motors: Motors, with their turning radius and the failures of a user's class.
        distance: Way covered so far [m].
        work: Done by the motors against inertia and what is in the way, without braking [J].
    """

    kind = ROBOT

    def __init__(self, world: Ticks, name: str, spec: DriveSpec, pose: Pose) -> None:
        if spec.corners:
            moment = pymunk.moment_for_poly(spec.mass, spec.corners)
        else:
            moment = pymunk.moment_for_circle(spec.mass, 0.0, spec.radius)
        body = pymunk.Body(spec.mass, moment)
        body.position = (pose.x, pose.y)
        body.angle = pose.heading
        circle = pymunk.Circle(body, spec.radius)
        shape = pymunk.Poly(body, spec.corners) if spec.corners else circle
        shape.friction = FRICTION
        shape.elasticity = ELASTICITY
        shape.collision_type = self.kind
        super().__init__(world, name, body, shape)
        self.spec = spec
        self.radius = spec.radius
        self.motors = spec.drive(spec)
        self.distance = 0.0
        self.work = 0.0
        self._grip = GRIP
        self._powered = True
        self._asked = AskedFor(STOP)
        self._people = Contacts()
        self._jam = Jam()
        self._mass = spec.mass
        self._moment = body.moment
        self._arm = TRACK * spec.radius
        self._lock = Lock(world.space, body, self._arm)
        self._lock.close(GRIP)
        self._braked = 0.0
        stopping = spec.max_speed / spec.max_deceleration
        turning = spec.max_turn_rate / spec.max_turn_acceleration
        self._patience = max(stopping, turning) + REST * spec.motor_time_constant

    @property
    def person_contacts(self) -> int:
        """Number of contacts with people so far."""
        return self._people.count

    @property
    def jammed(self) -> bool:
        """True if it is stuck, by the rules of `dva_sim.worlds.bodies`."""
        return self._jam.holds(*self.pose())

    @property
    def jams(self) -> int:
        """Number of times that it became stuck."""
        return self._jam.count

    @property
    def speed(self) -> float:
        """Measured speed along the heading [m/s]."""
        velocity = self.body.velocity
        angle = self.body.angle
        return velocity.x * math.cos(angle) + velocity.y * math.sin(angle)

    @property
    def turn_rate(self) -> float:
        """Measured turn rate [rad/s]."""
        return self.body.angular_velocity

    def pose(self) -> Pose:
        """Return its pose as of the last whole tick; the heading counts full turns."""
        place = self.body.position
        return make_pose(place.x, place.y, self.body.angle)

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
        """True if the motors obey; without power they brake and stop, from the next tick on."""
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
        world = self._world
        spec = self.spec
        start = world.next_tick()
        if not (math.isfinite(speed) and math.isfinite(turn_rate)) or math.isnan(until):
            self._asked.put(start, STOP)
        else:
            most = spec.max_speed
            fastest = spec.max_turn_rate
            speed = 0.0 if speed < 0.0 else most if speed > most else speed
            if not -fastest <= turn_rate <= fastest:
                turn_rate = math.copysign(fastest, turn_rate)
            speed, turn_rate = self.motors.set_point(speed, turn_rate)
            self._asked.put(start, _make_target(speed, turn_rate, world.tick_at(until)))
        world.wake(self)

    @property
    def asked(self) -> tuple[float, float, float]:
        """Speed [m/s] and turn rate [rad/s] that the motors were asked for last, and their end [s].

        The end is that of a whole tick; 0: they were asked to stand.
        """
        speed, turn_rate, end = self._asked.newest
        return speed, turn_rate, end * self._world.dt if speed or turn_rate else 0.0

    def push(self, tick: int, dt: float) -> bool:
        """Apply the motors' forces for one tick; False if the robot stands as requested.

        Wheels hold along and across together no more than the grip of the floor: beyond that
        they slip, and the force keeps its direction (a friction circle). Who has come to rest
        locks them until it is asked to move; and so does who still moves when its brakes should
        have stopped it, as somebody pushes.
        """
        body = self.body
        wanted_speed, wanted_spin, end = self._asked.at(tick)
        if tick >= end or not self._powered:
            wanted_speed = wanted_spin = 0.0
        velocity = body.velocity
        spin = body.angular_velocity
        vx = velocity.x
        vy = velocity.y
        # Bodies are moved before forces act on them: aim along the heading by then.
        angle = body.angle + spin * dt
        cos = math.cos(angle)
        sin = math.sin(angle)
        forward = vx * cos + vy * sin
        sideways = vy * cos - vx * sin
        if wanted_speed == wanted_spin == 0.0:
            if abs(forward) + abs(sideways) + abs(spin) < BRAKES_BELOW:
                body.velocity = (0.0, 0.0)
                body.angular_velocity = 0.0
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
        along, turn = self.motors.accelerations(wanted_speed, wanted_spin, forward, spin, dt)
        across = -sideways / dt
        most = self._grip * G
        force = math.hypot(along, across)
        if force > most:
            along = along * most / force
            across = across * most / force
        along = self._mass * along
        across = self._mass * across
        torque = self._moment * turn
        most_torque = self._mass * most * self._arm
        if not -most_torque <= torque <= most_torque:
            torque = math.copysign(most_torque, torque)
        _set_force(body, (along * cos - across * sin, along * sin + across * cos))
        _set_torque(body, torque)
        self.distance += abs(forward) * dt
        power = along * (forward + 0.5 * dt * along / self._mass)  # with the mean of the tick
        spinning = torque * (spin + 0.5 * dt * torque / self._moment)
        self.work += ((power if power > 0.0 else 0.0) + (spinning if spinning > 0.0 else 0.0)) * dt
        return True

    def _is_held(self, dt: float) -> bool:
        """Return True if locked wheels hold it; they lock if the brakes take too long."""
        self._braked += dt
        if self._braked > self._patience and not self._lock.closed:
            self._lock.close(self._grip)
        return self._lock.closed

    def counts(self, other: Body | None) -> tuple[Contacts, ...]:
        """Return the counter of all contacts; with a person, also that of contacts with people."""
        person = other is not None and other.kind == PERSON
        return (self._touch, self._people) if person else (self._touch,)
