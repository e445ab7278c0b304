"""How a person brings a cursor to its target, or through a tunnel, under delay.

References:
    D. T. McRuer, H. R. Jex: A review of quasi-linear pilot models. IEEE Trans. Human Factors in
    Electronics HFE-8 (1967): the crossover model.
    J. Accot, S. Zhai: Beyond Fitts' law: models for trajectory-based HCI tasks. CHI 1997: time
    through a tunnel grows with its length over its width.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from dva_sim.agents.operator.person import Person
from dva_sim.agents.steering import Route

Velocity = tuple[float, float]

SHORTEST = 1e-3  # a delay, or a share of noise, below this counts as this


class Sighting(NamedTuple):
    """A frame of a cursor and of its target, as the person judges it.

    Attributes:
        tick: When it was taken, by the display's clock [ms].
        x: Of the cursor [m].
        y: Of the cursor [m].
        vx: Of the cursor [m/s].
        vy: Of the cursor [m/s].
        target_x: [m]
        target_y: [m]
        target_vx: [m/s]
        target_vy: [m/s]
        tolerance: Half the width of the target, or of the tunnel here [m].
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


def gain_at(limit: float, margin: float, delay: float) -> float:
    """The gain at which a person closes a loop [1/s]: gain x delay stays within its margin.

    A loop of gain K on an integrator, with delay tau, is stable below K tau = pi/2.

    Args:
        limit: The person's own [1/s], however short the delay.
        margin: The person's own.
        delay: [s]
    """
    return min(limit, margin / max(delay, SHORTEST))


def towards(seen: Sighting, delay: float, person: Person, most: float) -> Velocity:
    """Crossover law: the velocity of the target as seen, and the error times a gain.

    Args:
        seen: The newest frame.
        delay: What the person takes the whole delay to be [s].
        person: Knows its gain and margin.
        most: As fast as the person cares to go [m/s].
    """
    gain = gain_at(person.pointing, person.margin, delay)
    vx = seen.target_vx + gain * (seen.target_x - seen.x)
    vy = seen.target_vy + gain * (seen.target_y - seen.y)
    speed = math.hypot(vx, vy)
    return (vx * most / speed, vy * most / speed) if speed > most else (vx, vy)


def through(path: Route, seen: Sighting, delay: float, person: Person, most: float) -> Velocity:
    """Towards a point ahead on the middle line, as fast as the delay allows.

    While nothing can be seen of it, the noise of the hand and the bend of the tunnel drive the
    cursor aside; the speed keeps each within a share of the half width, the person's caution. The
    look-ahead is the way covered during the delay over that same caution, or half a width.

    Args:
        path: The middle line [m].
        seen: The newest frame; its tolerance is half the width.
        delay: What the person takes the whole delay to be [s].
        person: Caution, gain and noise.
        most: As fast as the person cares to go [m/s].
    """
    delay, room = max(delay, SHORTEST), person.caution * seen.tolerance
    speed = fastest(seen.tolerance, delay, person, most)
    look = max(speed * delay / person.caution, seen.tolerance)
    ahead = path.ahead(seen.x, seen.y, 0.0, look)
    bend = _bend(path, path.length - ahead.remaining, look)
    if 0.5 * bend * (speed * delay) ** 2 > room:
        speed = math.sqrt(2.0 * room / bend) / delay
        look = max(speed * delay / person.caution, seen.tolerance)
        ahead = path.ahead(seen.x, seen.y, 0.0, look)
    if ahead.remaining < look:  # the end is a target like any other
        speed = min(speed, gain_at(person.pointing, person.margin, delay) * ahead.distance)
    return speed * math.cos(ahead.bearing), speed * math.sin(ahead.bearing)


def fastest(half_width: float, delay: float, person: Person, most: float) -> float:
    """The speed at which the noise of the hand, during the delay, takes up the person's caution.

    Args:
        half_width: Of the tunnel [m].
        delay: What the person takes the whole delay to be [s].
        person: Caution and noise.
        most: As fast as the person cares to go [m/s].
    """
    noise = max(delay, SHORTEST) * max(person.motor_noise, SHORTEST)
    return min(most, person.caution * half_width / noise)


def _bend(path: Route, along: float, look: float) -> float:
    """Mean curvature of the path from a place on it to a look-ahead [1/m]."""
    ax, ay = path.point_at(along)
    bx, by = path.point_at(along + 0.5 * look)
    cx, cy = path.point_at(along + look)
    turn = math.atan2(cy - by, cx - bx) - math.atan2(by - ay, bx - ax)
    near_end = (cx, cy) == (bx, by)
    return 0.0 if near_end else abs(math.remainder(turn, 2.0 * math.pi)) / (0.5 * look)
