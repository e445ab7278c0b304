"""Avoidance among people on foot, and priority at doors. Pure.

Somebody who walks looks over a fan of directions around the one wanted. In each, the way is free
up to where one would touch somebody, if everybody else kept on, or a wall. Two rules follow:

1. Walk in the direction whose free way ends nearest to where one would be if nothing were there.
2. Walk no faster than would stop within the relaxation time before what is ahead.

Contacts are left to the physics.

A person waits beside the way to a door for somebody nearer to it who comes from the other side, as
long as patience lasts. Robots are slow and cannot go back: one that comes through a door is waited
for longer, and one that stands in it may only stand because its way is blocked: it is given time,
too. The rules of doors are assumed.

References:
    M. Moussaid, D. Helbing, G. Theraulaz: How simple rules determine pedestrian behavior and
    crowd disasters. PNAS 108(17), 2011: both rules, the fan of 75 degrees, 10 m, 0.5 s.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dva_sim.agents.habits import WalkingHabits
from dva_sim.worlds.bodies import Body, RobotBody

RELAXATION: Final = 0.5  # source: Moussaid 2011: [s]
HORIZON: Final = 10.0  # source: Moussaid 2011: where one would be if nothing were there [m]
FAN: Final = np.deg2rad([0, -15, 15, -30, 30, -45, 45, -60, 60, -75, 75])  # source: Moussaid 2011
PROBES: Final = np.array([0.25, 0.5, 1.0])  # design: distances of checks for walls [m]
FEELS_ROOM: Final = 0.05  # design: resolution of free distances [m]
USUAL: Final = WalkingHabits()

Floats = NDArray[np.float64]
Point = tuple[float, float]


class Mover(NamedTuple):
    """A body as others see it: place [m], velocity [m/s], radius [m]."""

    x: float
    y: float
    vx: float
    vy: float
    radius: float


def velocity(
    me: Mover,
    heading: float,
    speed: float,
    others: Sequence[Mover],
    room: Callable[[Floats], Floats],
    habits: WalkingHabits = USUAL,
) -> Point:
    """Return the velocity to want now [m/s].

    Args:
        me: Person who walks.
        heading: Desired heading without others [rad].
        speed: Desired speed without others [m/s].
        others: People and robots nearby.
        room: Distance to the nearest wall at many points `(n, 2)` [m].
        habits: Habits of the person.
    """
    angles = heading + FAN
    ways = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    free = np.minimum(
        _up_to_bodies(me, ways * speed, others, habits.berth_m), _up_to_walls(me, ways, room)
    )
    miss = HORIZON**2 + free**2 - 2.0 * HORIZON * free * np.cos(FAN)
    miss += habits.keeps_right_m2 * (FAN > 0)
    best = int(miss.argmin())
    pace = min(speed, float(free[best]) / RELAXATION)
    return pace * float(ways[best, 0]), pace * float(ways[best, 1])


def is_clear(
    me: Mover,
    heading: float,
    speed: float,
    others: Sequence[Mover],
    habits: WalkingHabits = USUAL,
) -> bool:
    """Return True if walking on would touch nobody; then the rules keep the direction.

    This quick check comes first, since it is usually true.
    """
    vx = speed * math.cos(heading)
    vy = speed * math.sin(heading)
    berth = habits.berth_m
    for x, y, ovx, ovy, radius in others:
        px = x - me.x
        py = y - me.y
        wx = vx - ovx
        wy = vy - ovy
        near = me.radius + berth + radius
        square = px * px + py * py
        closing = px * wx + py * wy
        if closing > 0.0 and closing**2 >= (wx * wx + wy * wy) * (square - near * near):
            return False
    return True


def _up_to_bodies(me: Mover, velocities: Floats, others: Sequence[Mover], berth: float) -> Floats:
    """Return the free distance before touching any of `others`, by velocity `(n, 2)` [m].

    Discs touch when |p - w t| = r, with the place p and the velocity w of one relative to the
    other: the smaller root of a quadratic.
    """
    bodies = np.array(others)
    place = bodies[:, :2] - (me.x, me.y)
    square = (place**2).sum(axis=1)
    near = np.minimum((me.radius + berth + bodies[:, 4]) ** 2, 0.99 * square)
    closing = velocities[:, None, :] - bodies[None, :, 2:4]
    a = (closing**2).sum(axis=2) + 1e-12
    b = (closing * place).sum(axis=2)
    root = b**2 - a * (square - near)
    time = np.where((b > 0) & (root >= 0), (b - np.sqrt(np.maximum(root, 0.0))) / a, np.inf)
    speed = math.hypot(*velocities[0])
    free: Floats = np.minimum(speed * time.min(axis=1), HORIZON)
    return free


def _up_to_walls(me: Mover, ways: Floats, room: Callable[[Floats], Floats]) -> Floats:
    """Return the free distance to a wall in each direction `(n, 2)` [m]."""
    points = (me.x, me.y) + ways[:, None, :] * PROBES[None, :, None]
    fits = room(points.reshape(-1, 2)).reshape(len(ways), -1) >= me.radius - FEELS_ROOM
    reached = np.concatenate([[0.0], PROBES[:-1], [HORIZON]])
    free: Floats = reached[np.logical_and.accumulate(fits, axis=1).sum(axis=1)]
    return free


@dataclass(frozen=True)
class Door:
    """A door on a path: its distance along the path, and its middle [m]."""

    along: float
    x: float
    y: float


def find_middles(doors: Floats, narrow: float) -> Floats:
    """Middles `(k, 2)` of those doors, given by their ends `(n, 4)`, narrower than that [m]."""
    widths = np.hypot(doors[:, 2] - doors[:, 0], doors[:, 3] - doors[:, 1])
    middles: Floats = 0.5 * (doors[:, :2] + doors[:, 2:])
    return middles[widths < narrow]


def doors_on(path: Floats, middles: Floats) -> list[Door]:
    """Return the doors on a path `(n, 2)`, in order."""
    if not len(middles):
        return []
    gaps = np.hypot(*(path[None, :, :] - middles[:, None, :]).transpose(2, 0, 1))
    along = np.r_[0.0, np.cumsum(np.hypot(*np.diff(path, axis=0).T))]
    near = np.flatnonzero(gaps.min(axis=1) < 0.5)
    doors = [Door(float(along[gaps[i].argmin()]), *middles[i].tolist()) for i in near]
    return sorted(doors, key=lambda door: door.along)


class Courtesy:
    """Courtesy of one person at the doors on its path.

    Args:
        doors: On the way, in its order.
        habits: Habits of the person.
    """

    def __init__(self, doors: list[Door], habits: WalkingHabits = USUAL) -> None:
        self._doors = doors
        self._habits = habits
        self._since: float | None = None  # when it began to wait [s]

    def waits_for(self, me: Body, gone: float, near: Sequence[Body], now: float) -> Door | None:
        """Return the door at which this person lets another one pass first.

        Args:
            me: Person who walks.
            gone: Distance covered along the path [m].
            near: Other people nearby.
            now: [s]
        """
        habits = self._habits
        first = habits.gives_way_from_m
        last = habits.gives_way_to_m
        door = next((d for d in self._doors if first < d.along - gone < last), None)
        comer = None if door is None else _comes_through(door, me, near, habits)
        if comer is None:
            self._since = None
            return None
        self._since = now if self._since is None else self._since
        slow = isinstance(comer, RobotBody) and math.hypot(*comer.velocity) > habits.oncoming_mps
        patience = habits.patience_with_robots_s if slow else habits.patience_s
        return door if now - self._since < patience else None


def _comes_through(
    door: Door, me: Body, near: Sequence[Body], habits: WalkingHabits
) -> Body | None:
    """Return the body with priority at a door: the nearest that approaches, or a robot in it."""
    mine, (ux, uy) = _towards(door, me)
    for other in near:
        its = math.dist((other.x, other.y), (door.x, door.y))
        comes = other.velocity[0] * ux + other.velocity[1] * uy < -habits.oncoming_mps
        if its < mine and (comes or (isinstance(other, RobotBody) and its < habits.in_door_m)):
            return other
    return None


def beside(
    door: Door, me: Body, room: Callable[[Floats], Floats], habits: WalkingHabits = USUAL
) -> Point:
    """Return a place to wait beside the way through a door [m]: right of it if one fits, else left.

    Args:
        me: Person who waits; it stays where it is if there is no such place.
        room: Distance to the nearest wall at many points `(n, 2)` [m].
        habits: Habits of the person.
    """
    _, (ux, uy) = _towards(door, me)
    back = habits.waits_before_m
    side = habits.waits_aside_m
    spots = [(door.x - back * ux + s * uy, door.y - back * uy - s * ux) for s in (side, -side)]
    fits = room(np.array(spots)) >= me.radius
    return next((s for s, fit in zip(spots, fits, strict=True) if fit), (me.x, me.y))


def past(
    robot: Body,
    along: Point,
    me: Body,
    room: Callable[[Floats], Floats],
    sideways: float = USUAL.sideways_m,
) -> Point | None:
    """Return the next step to squeeze past a robot, sideways [m]; None without a gap.

    First in front of the wider gap, then straight through it.

    Args:
        robot: Stands there.
        along: Direction of the path, as a unit vector.
        me: Person who squeezes past.
        room: Distance to the nearest wall at many points `(n, 2)` [m].
        sideways: Half the depth of the person [m].
    """
    ux, uy = along
    off = robot.radius + sideways
    sides = [(-1.0, uy, -ux), (1.0, -uy, ux)]  # right and left
    gaps = np.array([(robot.x + off * nx, robot.y + off * ny) for _, nx, ny in sides])
    wide = room(gaps)
    if wide.max() < sideways - FEELS_ROOM:
        return None
    x, y = gaps[int(wide.argmax())].tolist()
    before = (robot.x - me.x) * ux + (robot.y - me.y) * uy
    beside = abs((x - me.x) * uy - (y - me.y) * ux)
    step = -off if before > 0.0 and beside > FEELS_ROOM else off
    return x + step * ux, y + step * uy


def _towards(door: Door, me: Body) -> tuple[float, Point]:
    """Return how far away a door is [m], and in which direction."""
    gap = math.dist((me.x, me.y), (door.x, door.y))
    return gap, ((door.x - me.x) / gap, (door.y - me.y) / gap)
