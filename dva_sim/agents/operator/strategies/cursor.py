"""Moving a cursor to its target, or through a tunnel, under delay.

References:
    D. T. McRuer, H. R. Jex: A review of quasi-linear pilot models. IEEE Trans. Human Factors in
    Electronics HFE-8 (1967): the crossover model.
    J. Accot, S. Zhai: Beyond Fitts' law: models for trajectory-based HCI tasks. CHI 1997: time
    through a tunnel grows with its length over its width.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

from dva_sim.agents.population import Person
from dva_sim.agents.route_following import SHORTEST, Route, gain_at

Velocity = tuple[float, float]

BEND_PIECES = 8  # design: in which a path is looked at for bends


class Sighting(NamedTuple):
    """A frame of a cursor and of its target, as the person judges it.

    Attributes:
        tick: Capture time by the display's clock [ms].
        x: Position of the cursor [m].
        y: Position of the cursor [m].
        vx: Velocity of the cursor [m/s].
        vy: Velocity of the cursor [m/s].
        target_x: [m]
        target_y: [m]
        target_vx: [m/s]
        target_vy: [m/s]
        tolerance: Half the width of the target, or of the tunnel here [m].
        edge: Distance from the start, along x or y, at which a moving target turns back [m].
    """

    tick: int
    x: float
    y: float
    vx: float
    vy: float
    target_x: float
    target_y: float
    target_vx: float
    target_vy: float
    tolerance: float
    edge: float = math.inf


def towards(
    seen: Sighting, delay: float, person: Person, most: float, margin: float | None = None
) -> Velocity:
    """Return the crossover law: the velocity of the target as seen, and the error times a gain.

    Args:
        seen: The newest frame.
        delay: Whole delay as the person perceives it [s].
        person: Person with gain and margin.
        most: Highest speed that the person chooses [m/s].
        margin: Gain x delay; left out: the person's usual one.
    """
    gain = gain_at(person.pointing, margin or person.margin, delay)
    vx = seen.target_vx + gain * (seen.target_x - seen.x)
    vy = seen.target_vy + gain * (seen.target_y - seen.y)
    return slowed(vx, vy, most)


def through(path: Route, seen: Sighting, delay: float, person: Person, most: float) -> Velocity:
    """Return the velocity along the tunnel, steered back to the middle of where one will be.

    While nothing can be seen of it, the noise of the hand drives the cursor aside, and so does a
    bend that is not foreseen well; the speed keeps each within a share of the half width, the
    person's caution. The end is a target like any other.

    Args:
        path: The middle line [m].
        seen: The newest frame; its tolerance is half the width.
        delay: Whole delay as the person perceives it [s].
        person: Caution, gain and noise.
        most: Highest speed that the person chooses [m/s].
    """
    gain = gain_at(person.pointing, person.margin, delay)
    delay = max(delay, SHORTEST)
    speed = fastest(seen.tolerance, delay, person, most)
    left = path.remaining(seen.x, seen.y)
    along = path.length - left
    bend = _bend(path, along, speed * delay + seen.tolerance)
    room = seen.tolerance * person.caution
    if 0.5 * bend * (speed * delay) ** 2 > room:
        speed = math.sqrt(2.0 * room / bend) / delay
    if left < speed * max(delay, 1.0 / gain):
        x, y = path.point_at(path.length)
        end = seen._replace(target_x=x, target_y=y, target_vx=0.0, target_vy=0.0)
        return towards(end, delay, person, speed)
    dx, dy = _direction(path, along + speed * delay, 0.5 * seen.tolerance)
    x, y = path.point_at(along)
    return slowed(speed * dx + gain * (x - seen.x), speed * dy + gain * (y - seen.y), most)


def slowed(vx: float, vy: float, most: float) -> Velocity:
    """Return the velocity in the same direction, no faster than `most` [m/s]."""
    speed = math.hypot(vx, vy)
    return (vx * most / speed, vy * most / speed) if speed > most else (vx, vy)


def fastest(half_width: float, delay: float, person: Person, most: float) -> float:
    """Return the speed at which noise of the hand, during the delay, takes up the caution.

    Args:
        half_width: Half-width of the tunnel [m].
        delay: Whole delay as the person perceives it [s].
        person: Caution and noise.
        most: Highest speed that the person chooses [m/s].
    """
    noise = max(delay, SHORTEST) * max(person.motor_noise, SHORTEST)
    return min(most, person.caution * half_width / noise)


def _bend(path: Route, along: float, look: float) -> float:
    """Mean curvature of the path from a place on it to a look-ahead [1/m].

    Turns are added up piece by piece: the two ends of a whole turn point the same way.
    """
    step = look / BEND_PIECES
    ways = [_direction(path, along + n * step, 0.5 * step) for n in range(BEND_PIECES + 1)]
    turns = (abs(math.atan2(a * d - b * c, a * c + b * d)) for (a, b), (c, d) in pairwise(ways))
    return sum(turns) / look


def _direction(path: Route, along: float, by: float) -> Velocity:
    """Return the direction of a path at a place, averaged over so much of it either way [m]."""
    along = min(max(along, by), path.length - by)
    ax, ay = path.point_at(along - by)
    bx, cy = path.point_at(along + by)
    length = math.hypot(bx - ax, cy - ay)
    return ((bx - ax) / length, (cy - ay) / length) if length else (0.0, 0.0)
