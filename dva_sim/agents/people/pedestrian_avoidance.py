"""How people keep out of each other's way, and who goes first through a door. Pure.

Somebody who walks looks over a fan of directions around the one wanted. In each, the way is free
up to where one would touch somebody, if everybody else kept on, or a wall. Two rules follow:

1. Walk in the direction whose free way ends nearest to where one would be if nothing were there.
2. Walk no faster than would stop within the relaxation time before what is ahead.

What touches nevertheless is left to the physics.

Who comes to a door towards which somebody else comes from the other side, and is nearer to it,
waits beside the way until the other is through; but for no more than `PATIENCE`. Robots are slow
and cannot go back: one that comes through a door is waited for longer, and one that stands in it
may only stand because it is let no farther: it is given time, too. The rules of doors are assumed.

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

from dva_sim.worlds.bodies import Body, RobotBody

RADIUS: Final = 0.2
"""Of the disc that stands for a person, seen from above [m]: as much floor as an ellipse of
0.46 m by 0.28 m, and a little more; assumed."""
SIDEWAYS: Final = 0.12  # half as deep as a chest: of who squeezes through a gap; assumed [m]
RELAXATION: Final = 0.5  # [s]
HORIZON: Final = 10.0  # where one would be if nothing were there [m]
REACH: Final = 3.0  # who is farther away does not count yet, indoors; assumed [m]
BERTH: Final = 0.1  # that much is kept between bodies, if it can be; assumed [m]
RIGHT_HANDED: Final = 1.0  # so much worse is it to pass on the left; assumed [m^2]

FAN: Final = np.deg2rad([0, -15, 15, -30, 30, -45, 45, -60, 60, -75, 75])
PROBES: Final = np.array([0.25, 0.5, 1.0])  # where a way is tried for walls [m]
FEELS_ROOM: Final = 0.05  # a place is measured to so much [m]

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
) -> Point:
    """The velocity to want now [m/s].

    Args:
        me: Who walks.
        heading: Where to, if nobody were there [rad].
        speed: How fast, if nobody were there [m/s].
        others: Who is near.
        room: Distance to the nearest wall at many points `(n, 2)` [m].
    """
    angles = heading + FAN
    ways = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    free = np.minimum(_up_to_bodies(me, ways * speed, others), _up_to_walls(me, ways, room))
    miss = HORIZON**2 + free**2 - 2.0 * HORIZON * free * np.cos(FAN) + RIGHT_HANDED * (FAN > 0)
    best = int(miss.argmin())
    pace = min(speed, float(free[best]) / RELAXATION)
    return pace * float(ways[best, 0]), pace * float(ways[best, 1])


def is_clear(me: Mover, heading: float, speed: float, others: Sequence[Mover]) -> bool:
    """Whether nobody would be touched by walking on and on: then the rules keep the direction.

    Asked first, since mostly it is so, and it costs little.
    """
    vx, vy = speed * math.cos(heading), speed * math.sin(heading)
    for x, y, ovx, ovy, radius in others:
        px, py, wx, wy = x - me.x, y - me.y, vx - ovx, vy - ovy
        near, square, closing = me.radius + BERTH + radius, px * px + py * py, px * wx + py * wy
        if closing > 0.0 and closing**2 >= (wx * wx + wy * wy) * (square - near * near):
            return False
    return True


def _up_to_bodies(me: Mover, velocities: Floats, others: Sequence[Mover]) -> Floats:
    """Way before touching the first of `others`, for each of some velocities `(n, 2)` [m].

    Discs touch when |p - w t| = r, with the place p and the velocity w of one relative to the
    other: the smaller root of a quadratic.
    """
    bodies = np.array(others)
    place = bodies[:, :2] - (me.x, me.y)
    square = (place**2).sum(axis=1)
    near = np.minimum((me.radius + BERTH + bodies[:, 4]) ** 2, 0.99 * square)
    closing = velocities[:, None, :] - bodies[None, :, 2:4]
    a = (closing**2).sum(axis=2) + 1e-12
    b = (closing * place).sum(axis=2)
    root = b**2 - a * (square - near)
    time = np.where((b > 0) & (root >= 0), (b - np.sqrt(np.maximum(root, 0.0))) / a, np.inf)
    speed = math.hypot(*velocities[0])
    free: Floats = np.minimum(speed * time.min(axis=1), HORIZON)
    return free


def _up_to_walls(me: Mover, ways: Floats, room: Callable[[Floats], Floats]) -> Floats:
    """Way before touching a wall, for each of some directions `(n, 2)` [m]."""
    points = (me.x, me.y) + ways[:, None, :] * PROBES[None, :, None]
    fits = room(points.reshape(-1, 2)).reshape(len(ways), -1) >= me.radius - FEELS_ROOM
    reached = np.concatenate([[0.0], PROBES[:-1], [HORIZON]])
    free: Floats = reached[np.logical_and.accumulate(fits, axis=1).sum(axis=1)]
    return free


NARROW: Final = 1.6  # a door wider than this needs no manners [m]
DOOR_AHEAD: Final = (0.3, 2.0)  # at that distance before a door one can still wait [m]
WAITS_BESIDE: Final = (0.8, 0.9)  # before the door, and beside the way through it [m]
ONCOMING: Final = 0.1  # who comes towards one faster than this, comes [m/s]
IN_DOOR: Final = 1.0  # a robot so near to its middle is in it [m]
PATIENCE: Final = 5.0  # so long one waits for people [s]
PATIENCE_WITH_ROBOTS: Final = 15.0  # that move [s]


@dataclass(frozen=True)
class Door:
    """A door on a way: how far along the way it is, and its middle [m]."""

    along: float
    x: float
    y: float


def middles_of(doors: Floats) -> Floats:
    """Middles `(k, 2)` of those doors, given by their ends `(n, 4)`, that are narrow [m]."""
    widths = np.hypot(doors[:, 2] - doors[:, 0], doors[:, 3] - doors[:, 1])
    middles: Floats = 0.5 * (doors[:, :2] + doors[:, 2:])
    return middles[widths < NARROW]


def doors_on(way: Floats, middles: Floats) -> list[Door]:
    """The doors that a way `(n, 2)` goes through, in its order."""
    if not len(middles):
        return []
    gaps = np.hypot(*(way[None, :, :] - middles[:, None, :]).transpose(2, 0, 1))
    along = np.r_[0.0, np.cumsum(np.hypot(*np.diff(way, axis=0).T))]
    near = np.flatnonzero(gaps.min(axis=1) < 0.5)
    found = [Door(float(along[gaps[i].argmin()]), *middles[i].tolist()) for i in near]
    return sorted(found, key=lambda door: door.along)


class Courtesy:
    """What one person does about the doors on its way.

    Args:
        doors: On the way, in its order.
    """

    def __init__(self, doors: list[Door]) -> None:
        self._doors = doors
        self._since: float | None = None  # when it began to wait [s]

    def waits_for(self, me: Body, gone: float, near: Sequence[Body], now: float) -> Door | None:
        """The door that this person lets somebody else through first.

        Args:
            me: Who walks.
            gone: How far along the way [m].
            near: Who else is near.
            now: [s]
        """
        first, last = DOOR_AHEAD
        door = next((d for d in self._doors if first < d.along - gone < last), None)
        comer = None if door is None else _comes_through(door, me, near)
        if comer is None:
            self._since = None
            return None
        self._since = now if self._since is None else self._since
        slow = isinstance(comer, RobotBody) and math.hypot(*comer.velocity) > ONCOMING
        patience = PATIENCE_WITH_ROBOTS if slow else PATIENCE
        return door if now - self._since < patience else None


def _comes_through(door: Door, me: Body, near: Sequence[Body]) -> Body | None:
    """Who comes towards a door and has it first, being nearer; or is a robot in it."""
    mine, (ux, uy) = _towards(door, me)
    for other in near:
        its = math.dist((other.x, other.y), (door.x, door.y))
        comes = other.velocity[0] * ux + other.velocity[1] * uy < -ONCOMING
        if its < mine and (comes or (isinstance(other, RobotBody) and its < IN_DOOR)):
            return other
    return None


def beside(door: Door, me: Body, room: Callable[[Floats], Floats]) -> Point:
    """A place to wait beside the way through a door [m]: right of it if one fits, else left.

    Args:
        door: Which.
        me: Who waits; it stays where it is if there is no such place.
        room: Distance to the nearest wall at many points `(n, 2)` [m].
    """
    _, (ux, uy) = _towards(door, me)
    back, side = WAITS_BESIDE
    spots = [(door.x - back * ux + s * uy, door.y - back * uy - s * ux) for s in (side, -side)]
    fits = room(np.array(spots)) >= me.radius
    return next((s for s, fit in zip(spots, fits, strict=True) if fit), (me.x, me.y))


def past(robot: Body, along: Point, me: Body, room: Callable[[Floats], Floats]) -> Point | None:
    """Where to step next to squeeze past a robot, sideways [m]; None: there is no gap.

    First in front of the wider gap, then straight through it.

    Args:
        robot: Stands there.
        along: Where the way leads, as a unit vector.
        me: Who squeezes past.
        room: Distance to the nearest wall at many points `(n, 2)` [m].
    """
    (ux, uy), off = along, robot.radius + SIDEWAYS
    sides = [(-1.0, uy, -ux), (1.0, -uy, ux)]  # right and left
    gaps = np.array([(robot.x + off * nx, robot.y + off * ny) for _, nx, ny in sides])
    wide = room(gaps)
    if wide.max() < SIDEWAYS - FEELS_ROOM:
        return None
    x, y = gaps[int(wide.argmax())].tolist()
    before = (robot.x - me.x) * ux + (robot.y - me.y) * uy
    beside = abs((x - me.x) * uy - (y - me.y) * ux)
    step = -off if before > 0.0 and beside > FEELS_ROOM else off
    return x + step * ux, y + step * uy


def _towards(door: Door, me: Body) -> tuple[float, Point]:
    """How far away a door is [m], and in which direction."""
    gap = math.dist((me.x, me.y), (door.x, door.y))
    return gap, ((door.x - me.x) / gap, (door.y - me.y) / gap)
