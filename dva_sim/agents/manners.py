"""How people keep out of each other's way: which way to step now, and how fast. Pure.

Somebody who walks looks over a fan of directions around the one wanted. In each, the way is free
up to where one would touch somebody, if everybody else kept on, or a wall. Two rules follow:

1. Walk in the direction whose free way ends nearest to where one would be if nothing were there.
2. Walk no faster than would stop within the relaxation time before what is ahead.

What touches nevertheless is left to the physics.

References:
    M. Moussaid, D. Helbing, G. Theraulaz: How simple rules determine pedestrian behavior and
    crowd disasters. PNAS 108(17), 2011: both rules, the fan of 75 degrees, 10 m, 0.5 s.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

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
