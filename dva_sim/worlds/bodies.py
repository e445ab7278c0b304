"""Contacts, jams and how they end: the rules, and what counts them.

There is no reverse, so whoever has driven into something has to turn away from it, or waits
for help. The rules:

- **A contact** begins when a robot touches a wall, another robot or a person, having touched
  nothing for `SAME_CONTACT`. A scrape along a ragged wall is one contact, however many segments
  it has, and so is a push during which both sides part for a moment. Contacts with people are
  counted among all, and once more by themselves.
- **Jammed** is a robot that touches something, has been asked to drive or turn for `JAM_TIME`
  altogether, and in all that time moved less than `JAM_WAY` and turned less than `JAM_TURN`
  from where it was. Time in which nothing is asked of it does not count, and resets nothing.
  A robot without power is asked for nothing: it fails, but it is not jammed.
- **It recovers** by turning on the spot, where its drive can, until the way ahead is free, and
  then driving on; or by being pushed. As soon as it has moved `JAM_WAY` or turned `JAM_TURN` it
  is no longer jammed. A car cannot turn without moving ahead: one whose nose touches a wall
  stays jammed.
- **Who may free it**: only somebody beside it. In a run nobody does: a jam of a car ends what
  it was sent to do, and is counted as the cause.

What all bodies have in common that move: a place, a velocity, contacts (pymunk).
"""

from __future__ import annotations

import math
from collections import deque
from typing import Final, Generic, Protocol, TypeVar

import pymunk
from pymunk._chipmunk_cffi import lib

SAME_CONTACT: Final = 0.5  # touching again within this time is the same contact [s]
JAM_TIME: Final = 5.0  # asked to move for so long, in contact [s]; assumed
JAM_WAY: Final = 0.05  # [m]; assumed
JAM_TURN: Final = 0.1  # [rad]; assumed


class Contacts:
    """Contacts of one kind that a body has had.

    Attributes:
        count: Contacts begun so far.
        touching: Shapes that it touches now.
        last: When it last ceased to touch one [s].
    """

    def __init__(self) -> None:
        self.count, self.touching, self.last = 0, 0, -math.inf

    def begin(self, now: float) -> None:
        """It touches one more shape."""
        if not self.touching and now - self.last > SAME_CONTACT:
            self.count += 1
        self.touching += 1

    def end(self, now: float) -> None:
        """It touches one shape less."""
        self.touching -= 1
        self.last = now


class Jam:
    """Whether a robot is jammed: it is told of every tick in which it strains against something.

    Attributes:
        count: How often it became so.
    """

    def __init__(self) -> None:
        self.count = 0
        self._since = 0.0
        self._x = self._y = self._heading = math.inf

    def strain(self, x: float, y: float, heading: float, dt: float) -> None:
        """For a tick it was asked to move while it touched something, there [m, rad]."""
        if not self._near(x, y, heading):
            self._x, self._y, self._heading, self._since = x, y, heading, 0.0
        if self._since < JAM_TIME <= self._since + dt:
            self.count += 1
        self._since += dt

    def holds(self, x: float, y: float, heading: float) -> bool:
        """Whether it is jammed, being there [m, rad]."""
        return self._since >= JAM_TIME and self._near(x, y, heading)

    def _near(self, x: float, y: float, heading: float) -> bool:
        way = math.hypot(x - self._x, y - self._y)
        return way < JAM_WAY and abs(heading - self._heading) < JAM_TURN


G: Final = 9.81  # [m/s^2]
GRIP: Final = 0.8  # friction coefficient of rubber on a dry floor
FRICTION, ELASTICITY = 0.3, 0.1  # of bumpers and walls; both multiply in a contact
AT_REST = 1e-3  # slower than this, brakes hold [m/s, rad/s]
WALL, ROBOT, PERSON = 1, 2, 3  # collision types

T = TypeVar("T")

# Straight to the functions behind pymunk's properties, for the hot loop: half the cost.
get_velocity, get_position = lib.cpBodyGetVelocity, lib.cpBodyGetPosition
get_spin, get_angle = lib.cpBodyGetAngularVelocity, lib.cpBodyGetAngle
set_velocity, set_spin = lib.cpBodySetVelocity, lib.cpBodySetAngularVelocity
set_force, set_torque = lib.cpBodySetForce, lib.cpBodySetTorque


class AskedFor(Generic[T]):
    """What is asked of a body: what holds now, and what will from later ticks on.

    What was asked for first still has its tick, however soon something newer follows.

    Args:
        first: What holds at the beginning.

    Attributes:
        now: What holds.
        coming: What will, and from which tick on.
    """

    __slots__ = ("coming", "now")

    def __init__(self, first: T) -> None:
        self.now = first
        self.coming: deque[tuple[int, T]] = deque()

    def put(self, start: int, what: T) -> None:
        """From tick `start` on; starts never go back."""
        if self.coming and self.coming[-1][0] == start:
            self.coming.pop()
        self.coming.append((start, what))

    def at(self, tick: int) -> T:
        """What holds in a tick; they are asked for in their order."""
        coming = self.coming
        while coming and coming[0][0] <= tick:
            self.now = coming.popleft()[1]
        return self.now


class Timing(Protocol):
    """What a body needs to know of the world that steps it."""

    @property
    def space(self) -> pymunk.Space:
        """What its shape, and what holds it, belong to."""

    @property
    def time(self) -> float:
        """Of the last whole tick [s]."""

    def next_tick(self) -> int:
        """The first tick that a set point given now can reach."""

    def tick_at(self, time: float) -> float:
        """The first tick that begins at `time` [s] or later."""

    def wake(self, body: Body) -> None:
        """The body has to be pushed from the next tick on."""


class Body:
    """What all that moves has in common.

    Attributes:
        name: Of the robot or person.
        kind: `ROBOT` or `PERSON`.
        radius: Of the circle around it [m].
        impulse: Impulse of its contacts so far [N s]; of people only that with robots.
    """

    kind: int

    def __init__(self, world: Timing, name: str, body: pymunk.Body, shape: pymunk.Shape) -> None:
        self.name, self._world, self.body, self.shape = name, world, body, shape
        self._raw = body._body  # what the functions of the library take
        self.radius, self.impulse = 0.0, 0.0
        self._touch = Contacts()

    @property
    def x(self) -> float:
        """Position [m]."""
        return float(get_position(self._raw).x)

    @property
    def y(self) -> float:
        """Position [m]."""
        return float(get_position(self._raw).y)

    @property
    def velocity(self) -> tuple[float, float]:
        """Along x and y [m/s]."""
        velocity = get_velocity(self._raw)
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

    def counts(self, other: Body | None) -> tuple[Contacts, ...]:
        """Which of its contacts one with somebody, or a wall (None), is among."""
        raise NotImplementedError

    def meets(self, other: Body | None, now: float) -> None:
        """It begins to touch somebody, or a wall (None)."""
        for contacts in self.counts(other):
            contacts.begin(now)

    def parts(self, other: Body | None, now: float) -> None:
        """It touches somebody, or a wall (None), no longer."""
        for contacts in self.counts(other):
            contacts.end(now)

    def feels(self, other: Body | None, impulse: float) -> None:
        """A contact with somebody, or a wall (None), has stopped or pushed it [N s]."""
        raise NotImplementedError
