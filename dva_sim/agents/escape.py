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

from dva_sim.worlds.hazards import Conditions
from dva_sim.worlds.planning import Disc, Planner
from dva_sim.worlds.site import Site

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
WITHIN: Final = 0.05  # of the line of an exit, still indoors [m]

Point = tuple[float, float]
Limit = Callable[[Point], bool]


class Escape(NamedTuple):
    """A way out: where to, and what to keep off."""

    goal: Point
    avoid: tuple[Disc, ...] = ()


def is_untenable(conditions: Conditions) -> bool:
    """Whether nobody goes there, or stays."""
    return any(is_ >= most for is_, most in zip(conditions, UNTENABLE, strict=True))


def is_deadly(conditions: Conditions) -> bool:
    """Whether not even who is in smoke already goes there."""
    return any(is_ >= most for is_, most in zip(conditions, DEADLY, strict=True))


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
    If there is none either, less has to do: a way without what the next limit calls bad. If no
    way keeps even the last limit there is no escape for now.

    Args:
        planner: Knows the site.
        here: Where one is; bad places around it count only from the first good one on [m].
        refuges: Where one is safe [m].
        limits: Each says whether one keeps off a place; the strictest first.
    """
    far = {refuge: planner.distance(here, refuge) for refuge in refuges}
    near = sorted((r for r in refuges if far[r] < math.inf), key=lambda r: far[r])
    for is_bad in limits:
        for tries in (1, TRIES):
            for refuge in near:
                escape = _try(planner, here, refuge, is_bad, tries)
                if escape is not None:
                    return escape
    return None


def _try(planner: Planner, here: Point, refuge: Point, is_bad: Limit, tries: int) -> Escape | None:
    """A good way to one refuge, keeping off more and more bad places."""
    avoid: tuple[Disc, ...] = ()
    for _ in range(tries):
        way = planner.path(here, refuge, avoid)
        if way is None:
            return None
        bad = _bad_places(way, is_bad)
        if not bad:
            return Escape(refuge, avoid)
        avoid = (*avoid, *(Disc(x, y, KEEPS_OFF) for x, y in bad))
    return None


def _bad_places(way: np.ndarray, is_bad: Limit) -> list[Point]:
    """The bad ones of some places on a way, after the first good one."""
    steps = max(1, round(EVERY / float(np.hypot(*(way[1] - way[0])) or EVERY)))
    places = [(float(x), float(y)) for x, y in way[::steps]]
    bad = [is_bad(place) for place in places]
    first = bad.index(False) if False in bad else len(bad)
    return [p for p, b in zip(places[first:], bad[first:], strict=True) if b]
