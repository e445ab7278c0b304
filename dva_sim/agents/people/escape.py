"""The way out of danger: to the nearest safe place, and not through what nobody endures. Pure.

References:
    Radiant heat of 2.5 kW/m^2, which skin stands for some minutes: ISO 13571.
    Carbon monoxide of 1200 ppm, immediately dangerous to life: NIOSH.
    People turn back in smoke through which they see 3 m or less, an extinction of 1 /m by
    V = 3 / K: T. Jin, Visibility and human behavior in fire smoke, SFPE Handbook. Nobody stays
    where gas can explode, at its lower explosive limit, or goes in; how much of it that is counts
    only for the dose, by the oxygen lacking. The limits of air temperature and water are assumed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dva_sim.worlds.hazards import Conditions
from dva_sim.worlds.layout import Site
from dva_sim.worlds.planning import Disc, Planner

UNTENABLE: Final = Conditions(
    temperature=60.0,
    heat_flux=2.5,
    extinction=1.0,
    co=1200.0,
    gas=math.inf,
    water=1.0,
    explosive=1.0,
)
"""Any of it is more than anybody goes into, or stays in."""
DEADLY: Final = Conditions(
    temperature=120.0,
    heat_flux=10.0,
    extinction=math.inf,
    co=math.inf,
    gas=math.inf,
    water=1.5,
    explosive=math.inf,
)
"""Flames and what is next to them: nobody goes through, whatever the other ways are like; in
10 kW/m^2 skin burns within seconds (ISO 13571), the rest is assumed."""
EVERY: Final = 1.0  # a way is looked at so often [m]
KEEPS_OFF: Final = 1.0  # around a bad place of a way [m]
TRIES: Final = 3  # to find a way around bad places
CLOSE: Final = 10.0  # so far one goes through bad air to the end, if it gets no worse; assumed [m]
WITHIN: Final = 0.05  # of the line of an exit, still indoors [m]

Point = tuple[float, float]
Floats = NDArray[np.float64]
Limit = Callable[[Point], float]  # 1 and more is more than one bears


class Escape(NamedTuple):
    """A way out: where to, and what to keep off."""

    goal: Point
    avoid: tuple[Disc, ...] = ()


def strain(conditions: Conditions, most: Conditions) -> float:
    """How much of a limit it is: 1 where the first of the conditions reaches it."""
    return max(is_ / limit for is_, limit in zip(conditions, most, strict=True))


def is_untenable(conditions: Conditions) -> bool:
    """Whether nobody goes there, or stays."""
    return strain(conditions, UNTENABLE) >= 1.0


def is_deadly(conditions: Conditions) -> bool:
    """Whether not even who is in smoke already goes there."""
    return strain(conditions, DEADLY) >= 1.0


def refuges_of(site: Site) -> list[Point]:
    """Where people of a site are safe [m]: its exits; else the guard posts; else robot bases.

    An exit lies in the line of the outer wall: the place is just within.
    """
    if not site.exits:
        return [(pose.x, pose.y) for pose in site.guard_posts or site.robot_bases]
    ways = [(way, math.cos(way.heading), math.sin(way.heading)) for way in site.exits]
    return [(way.x - WITHIN * dx, way.y - WITHIN * dy) for way, dx, dy in ways]


def choose_escape(
    planner: Planner, here: Point, refuges: Sequence[Point], limits: Sequence[Limit]
) -> Escape | None:
    """The nearest refuge by the way there, on a way without bad places.

    A longer way around bad places is taken if every refuge's shortest way leads through some.
    If there is none either, less has to do: a way that keeps the limits but the first. If no
    way keeps even the last limit there is no escape for now.

    Args:
        planner: Knows the site.
        here: Where one is; who stands in bad air goes through no worse to the first good place.
        refuges: Where one is safe, whatever it is like right there: outdoors is beyond [m].
        limits: Each says how much of what one bears a place is; the strictest first.
    """
    for k in range(len(limits)):
        escape = _keeping(planner, here, refuges, limits[k:])
        if escape is not None:
            return escape
    return None


def _keeping(
    planner: Planner, here: Point, refuges: Sequence[Point], limits: Sequence[Limit]
) -> Escape | None:
    """The nearest refuge on a way that keeps some limits, around more and more bad places."""
    avoid: tuple[Disc, ...] = ()
    for _ in range(TRIES):
        ways = [(refuge, planner.path(here, refuge, avoid)) for refuge in refuges]
        there = [(_length(way), refuge, way) for refuge, way in ways if way is not None]
        found: dict[Point, None] = {}
        for _, refuge, way in sorted(there, key=lambda one: one[0]):
            judged = [_judge(way, one, CLOSE) for one in limits[:-1]]
            judged.append(_judge(way, limits[-1], math.inf))
            if all(will_do for will_do, _ in judged):
                return Escape(refuge, avoid)
            found.update((place, None) for _, bad in judged for place in bad)
        if not found:
            return None
        avoid = (*avoid, *(Disc(x, y, KEEPS_OFF) for x, y in found))
    return None


def _judge(way: Floats, limit: Limit, close: float) -> tuple[bool, list[Point]]:
    """Whether a way keeps a limit, and the bad places to go around.

    No way keeps it that is bad from begin to end, and longer than `close` [m]: only who stands
    in what is deadly runs however far, if it gets no worse.
    """
    steps = max(1, round(EVERY / float(np.hypot(*(way[1] - way[0])) or EVERY)))
    places = [(float(x), float(y)) for x, y in way[:-1:steps]]
    strains = [float(limit(place)) for place in places]
    leaves = (i for i, s in enumerate(strains) if s < 1.0 or s > strains[0])
    first = next(leaves, len(places))
    bad = [p for p, s in zip(places[first:], strains[first:], strict=True) if s >= 1.0]
    comes_out = first < len(places) or _length(way) <= close
    return comes_out and not bad, bad


def _length(way: Floats) -> float:
    """Of a way [m]."""
    return float(np.hypot(*np.diff(way, axis=0).T).sum())
