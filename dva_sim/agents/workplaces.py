"""Where people work: places drawn in the rooms of a site."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Final

import numpy as np

from dva_sim.errors import ConfigError
from dva_sim.worlds.site import Room, Site

ELBOW_ROOM: Final = 0.3  # radius that must fit where somebody works [m]
APART: Final = 0.8  # nobody begins nearer to somebody else [m]
PASSAGE: Final = 3.5  # a room so many times as long as wide is a corridor, where nobody works
TRIES: Final = 100

Point = tuple[float, float]


def draw_places(
    site: Site, rng: np.random.Generator, count: int, taken: Sequence[Point] = ()
) -> list[Point]:
    """Places of one person [m]: rooms by their area, anywhere in them.

    Args:
        site: Where; on a bare map, which has no rooms, anywhere.
        rng: Source of luck.
        count: How many.
        taken: The first place is not near any of these [m].

    Raises:
        ConfigError: there is no such place.
    """
    rooms, areas = _workrooms(site)
    for _ in range(TRIES):
        first = _draw(site, rng, rooms, areas)
        if all(math.dist(first, other) >= APART for other in taken):
            break
    else:
        raise ConfigError(f"site {site.name!r} has no room for {len(taken) + 1} people")
    return [first, *(_draw(site, rng, rooms, areas) for _ in range(count - 1))]


def _draw(site: Site, rng: np.random.Generator, rooms: list[str], areas: list[float]) -> Point:
    room = str(rng.choice(rooms, p=areas)) if rooms else None
    return site.sample_free(rng, ELBOW_ROOM, room)


@lru_cache(maxsize=16)
def _workrooms(site: Site) -> tuple[list[str], list[float]]:
    """Rooms where people work, and the share of each in their area."""
    rooms = [room for room in site.rooms if not room.outdoor and not _is_passage(room)]
    rooms = [room for room in rooms if _has_place(site, room.name)]
    areas = np.array([_sides(room)[0] * _sides(room)[1] for room in rooms])
    return [room.name for room in rooms], (areas / areas.sum()).tolist() if rooms else []


def _is_passage(room: Room) -> bool:
    short, long = _sides(room)
    return long >= PASSAGE * short


def _sides(room: Room) -> tuple[float, float]:
    """The shorter and the longer side of the smallest rectangle around a room [m]."""
    import shapely

    corners = shapely.get_coordinates(shapely.oriented_envelope(shapely.Polygon(room.polygon)))
    one, other = np.hypot(*np.diff(corners[:3], axis=0).T).tolist()
    return min(one, other), max(one, other)


def _has_place(site: Site, room: str) -> bool:
    try:
        site.sample_free(np.random.default_rng(0), ELBOW_ROOM, room)
    except ConfigError:
        return False
    return True
