"""Scene of a console, which does not change: the site, its agents, and the colours' meaning."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from typing import Any

import numpy as np
import shapely
from shapely.geometry import mapping

from dva_sim.console.run.lag import LIMIT
from dva_sim.console.wire.arguments import FASTEST, LINK_LIMITS
from dva_sim.console.wire.scenes import (
    LegendEntry,
    LinkShown,
    PatternShown,
    Point,
    RasterShown,
    RegionPlanShown,
    SceneLine,
    SiteShown,
    ThingShown,
)
from dva_sim.network.patterns import PATTERNS
from dva_sim.recordings.pictures import colours
from dva_sim.simulation.full.hazards import RunHazard
from dva_sim.simulation.scenario import Scenario
from dva_sim.simulation.scenario.regions import RegionPlan
from dva_sim.worlds.maps import OCCUPIED
from dva_sim.worlds.site import Site
from dva_sim.worlds.site_export import features_of
from dva_sim.worlds.tints import floor_tint

MAX_FEATURES = 20_000
RULES = {
    "S1": "A robot moves only by a command that came within the watchdog.",
    "S2": "One robot obeys one holder at a time.",
    "S3": "An emergency stops a robot until a permitted person releases it.",
}


def scene_of(
    scenario: Scenario,
    site: Site,
    incidents: Sequence[RunHazard],
    things: list[ThingShown],
    link: LinkShown,
    regions: RegionPlan | None = None,
    *,
    name: str,
    seed: int,
) -> SceneLine:
    """Return the first line that a page gets.

    Args:
        incidents: Its hazards.
        things: Everybody, with their numbers.
        link: Link and transport of the messages.
        regions: Regions of the site, if it is divided.
        name: Name of the scenario.
        seed: Random seed of the run.
    """
    return {
        "k": "scene",
        "t": 0,
        "scenario": name,
        "title": " ".join(scenario.description.split()) or name,
        "seed": seed,
        "site": site_of(site, regions),
        "things": things,
        "patterns": patterns_of(scenario.pattern),
        "link_limits": {key: list(limits) for key, limits in LINK_LIMITS.items()},
        "pace_limits": [1.0, FASTEST],
        "watchdog_s": scenario.robot.watchdog_s,
        "stale_s": scenario.robot.max_age_s,
        "lag_limit_s": LIMIT,
        "rules": RULES,
        "legend": legend(incidents),
        "link": link,
    }


def patterns_of(own: str) -> list[PatternShown]:
    """Return all that may be chosen: the shipped ones, and the scenario's."""
    names = dict.fromkeys([*PATTERNS, own])
    kinds = {name: PATTERNS.get(name) for name in names}
    return [
        {
            "name": name,
            "title": kind.title if kind else name,
            "label": kind.label if kind else name,
            "when_slow": kind.when_slow if kind else "",
            "answered": bool(kind and kind.answered),
        }
        for name, kind in kinds.items()
    ]


def site_of(site: Site, regions: RegionPlan | None = None) -> SiteShown:
    """Return the plan of a site, in metres and as GeoJSON in degrees."""
    tints: dict[str, str] = {}
    site_line: SiteShown = {
        "name": site.name,
        "extent_m": _rounded(site.extent),
        "origin": {
            "latitude_deg": site.frame.latitude,
            "longitude_deg": site.frame.longitude,
        },
        "features": geojson_of(site),
        "rooms": [
            {
                "name": room.name,
                "polygon_m": _rounded(room.polygon),
                "holes_m": [_rounded(hole) for hole in room.holes],
                "floor": floor_tint(room, tints),
                "outdoor": room.outdoor,
                "place_m": _place_in(site, room.name),
            }
            for room in site.rooms
        ],
        "walls_m": _rounded(site.wall_lines if site.rooms else site.walls),
        "solids_m": [_rounded(solid) for solid in site.solids],
        "doors_m": _rounded(np.asarray(site.doors).reshape(-1, 4)),
        "exits_m": [_rounded(way.ends) for way in site.exits],
        "regions": [_region(site, *each) for each in regions.areas.items()] if regions else [],
    }
    if not site.rooms:
        site_line["raster"] = raster_of(site)
    return site_line


def _region(site: Site, name: str, area: Any) -> RegionPlanShown:
    ground = shapely.box(*site.extent)
    # Within a centimetre it is the edge of the site, and no border.
    within = shapely.line_merge((area & ground).boundary - ground.boundary.buffer(0.01))
    west, _, _, north = (area & ground).bounds
    corner = shapely.shortest_line(area & ground, shapely.Point(west, north))
    return {
        "name": name,
        "borders_m": [
            _rounded(shapely.get_coordinates(line)) for line in shapely.get_parts(within)
        ],
        "place_m": _rounded(shapely.get_coordinates(corner)[0]),
    }


def _place_in(site: Site, room: str) -> Point | None:
    place = site.place_in(room)
    return None if place is None else [round(place[0], 2), round(place[1], 2)]


def raster_of(site: Site) -> RasterShown:
    """Return which cells of a bare map are occupied, one bit each, row 0 to the south."""
    grid = site.grid
    taken = grid.cells == OCCUPIED
    west, south = grid.to_xy(0, 0).tolist()
    bits = np.packbits(taken, axis=None)
    return {
        "cell_m": grid.resolution,
        "x0_m": west,
        "y0_m": south,
        "columns": int(taken.shape[1]),
        "rows": int(taken.shape[0]),
        "cells": base64.b64encode(bits.tobytes()).decode(),
    }


def geojson_of(site: Site) -> dict[str, Any]:
    """Return everything that is drawn on a site, with longitude and latitude."""
    features = []
    for feature in features_of(site):
        there = _to_degrees(site, feature.shape)
        properties = {"kind": feature.kind, **feature.properties}
        features.append({"type": "Feature", "properties": properties, "geometry": there})
        if len(features) >= MAX_FEATURES:
            break
    return {"type": "FeatureCollection", "features": features}


def _to_degrees(site: Site, shape: Any) -> dict[str, Any]:
    def convert(points: Any) -> Any:
        degrees = np.array([site.frame.to_latlon(x, y) for x, y in points.tolist()])
        return degrees[:, ::-1].round(8)

    there = shapely.transform(shape, convert)
    ring = there.geom_type == "LinearRing"
    return dict(mapping(shapely.LineString(there) if ring else there))


def legend(incidents: Sequence[RunHazard]) -> list[LegendEntry]:
    """Return the meaning of the colours and marks of a map."""
    kinds: list[LegendEntry] = [
        {"kind": kind, "mode": mode, "colour": colour}
        for kind, modes in (
            (colours.ROBOT, colours.ROBOT_MODES),
            ("person", colours.ACTIVITIES),
        )
        for mode, colour in modes.items()
    ]
    bodies: list[LegendEntry] = [
        {"kind": kind, "colour": colour} for kind, colour in colours.KINDS.items()
    ]
    hazards = {i.kind: i.hazard for i in incidents}
    marks: list[LegendEntry] = [
        {"kind": kind, "title": hazard.title, "colour": hazard.colour, "mark": hazard.mark}
        for kind, hazard in hazards.items()
    ]
    fields = {
        "smoke": colours.SMOKE,
        "gas": colours.GAS,
        "water": colours.WATER,
        "heat": colours.FIRE,
    }
    hazards_shown: list[LegendEntry] = [
        {"kind": kind, "field": True, "colour": colour} for kind, colour in fields.items()
    ]
    return [*bodies, *kinds, *marks, *hazards_shown]


def _rounded(numbers: Any) -> Any:
    """Return metres to the millimetre, as plain lists."""
    return np.asarray(numbers, dtype=float).round(3).tolist()
