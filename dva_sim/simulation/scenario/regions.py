"""Regions of a site, each with a DVA of its own: who serves which place."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

import shapely

from dva_sim.kernel.config import Fail
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.suggestions import unknown
from dva_sim.simulation.scenario.parts import RegionConfig
from dva_sim.worlds.site import FOOTPRINT, Site

OVERLAP: Final = 0.05  # ground that regions with borders drawn by hand may share [m2]
IN_A_WALL: Final = 0.75  # a free place this far from all regions stands in a door, for example [m]


@dataclass(frozen=True)
class RegionPlan:
    """Division of a site into regions.

    Attributes:
        areas: Shapely area of each region [m], by name.
        deputies: Region whose DVA is deputy of each, by name.
    """

    areas: Mapping[str, Any]
    deputies: Mapping[str, str]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the regions, in order."""
        return tuple(self.areas)

    def region_at(self, x: float, y: float) -> str:
        """Return the region of a place [m]; of one in a wall or a door, the nearest."""
        return min(self.areas, key=lambda name: self.outside(name, x, y))

    def outside(self, region: str, x: float, y: float) -> float:
        """Return how far from a region a place [m] is [m]; 0 inside."""
        return float(shapely.distance(self.areas[region], shapely.Point(x, y)))

    def serving_order(self, region: str) -> tuple[str, ...]:
        """Return the regions whose DVAs serve a region in turn: its own, its deputy's, others'."""
        first = region, self.deputies[region]
        return *first, *(name for name in self.areas if name not in first)


def plan_of(regions: Mapping[str, RegionConfig], site: Site) -> RegionPlan | None:
    """Return the division of a site; None for one DVA.

    Raises:
        ConfigError: the regions overlap, or leave a place to nobody.
    """
    return _plan(regions, site, lambda problem, _: ConfigError(problem))


def check_regions(regions: Mapping[str, RegionConfig], site: Site, error: Fail) -> None:
    """Refuse regions that overlap, leave a place to nobody, or name what is not there."""
    _plan(regions, site, error)


def _plan(regions: Mapping[str, RegionConfig], site: Site, error: Fail) -> RegionPlan | None:
    if not regions:
        return None
    areas = {name: _area_of(name, each, site, error) for name, each in regions.items()}
    rest = next((name for name, each in regions.items() if each.rest), None)
    if rest is not None:
        ground = shapely.box(*site.extent)
        named = shapely.union_all([area for name, area in areas.items() if name != rest])
        areas[rest] = ground - named
    for one, other, shared in _overlaps(areas):
        at = shared.representative_point()
        problem = (
            f"{one!r} and {other!r} overlap by {shared.area:.1f} m2, "
            f"at x {at.x:.1f} m, y {at.y:.1f} m"
        )
        raise _wrong(problem, error, other)
    _check_cover(areas, site, error)
    names = list(regions)
    following = dict(zip(names, names[1:] + names[:1], strict=True))
    deputies = {name: each.deputy or following[name] for name, each in regions.items()}
    return RegionPlan(areas, deputies)


def _area_of(name: str, region: RegionConfig, site: Site, error: Fail) -> Any:
    parts: list[Any] = []
    for room in region.rooms:
        if room not in {each.name for each in site.rooms}:
            rooms = [each.name for each in site.rooms]
            problem = unknown("room", room, rooms) if rooms else "a bare map names no rooms"
            raise _wrong(problem, error, name, "rooms")
        parts.append(site.ground_of(site.room(room)))
    if region.polygon:
        polygon = shapely.Polygon(region.polygon)
        if not polygon.is_valid or polygon.area == 0.0:
            problem = "the polygon crosses itself, or encloses nothing"
            raise _wrong(problem, error, name, "polygon")
        parts.append(polygon)
    return shapely.union_all(parts)


def _wrong(problem: str, error: Fail, *below: str) -> ConfigError:
    path = "dva", "regions", *below
    return error(f"{'.'.join(path)}: {problem}", path)


def _overlaps(areas: Mapping[str, Any]) -> Iterator[tuple[str, str, Any]]:
    names = list(areas)
    for index, one in enumerate(names):
        for other in names[index + 1 :]:
            shared = areas[one] & areas[other]
            if shared.area > OVERLAP:
                yield one, other, shared


def _check_cover(areas: Mapping[str, Any], site: Site, error: Fail) -> None:
    """Refuse a place where a robot can go and that is nobody's."""
    every = shapely.union_all(list(areas.values())).buffer(IN_A_WALL)
    shapely.prepare(every)
    places = site.free_middles(FOOTPRINT)
    left = places[~shapely.contains_xy(every, places)]
    if len(left):
        x, y = left[0].tolist()
        room = site.room_at(x, y)
        where = f" ({room})" if room else ""
        problem = (
            f"the place at x {x:.1f} m, y {y:.1f} m{where} is in no region; "
            "a region with rest: true takes what no other has"
        )
        raise _wrong(problem, error)
