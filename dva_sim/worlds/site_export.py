"""Sites back into files: YAML and GeoJSON, to go on drawing."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from shapely import Point

from dva_sim.kernel.errors import ConfigError
from dva_sim.worlds.geo import Pose
from dva_sim.worlds.geojson import Feature, write_features
from dva_sim.worlds.site import FOOTPRINT, Site
from dva_sim.worlds.site_parts import DOOR_HEIGHT, Room


def write_site(site: Site, folder: Path) -> Path:
    """Write `NAME.yaml` and `NAME.geojson`; read again, they are the same site to a millimetre.

    Args:
        site: Drawn, generated or a bare map; the floor of a map becomes one room.
        folder: Folder; created if missing.

    Returns:
        The YAML file.

    Raises:
        ConfigError: the files cannot be written.
    """
    file = folder / f"{site.name}.yaml"
    text = (
        f"name: {site.name}\n"
        f"origin: {{latitude: {site.frame.latitude!r}, longitude: {site.frame.longitude!r}}}\n"
        f"plan: {site.name}.geojson\n"
        f"resolution_m: {site.grid.resolution:g}\n"
        f"ceiling_m: {site.ceiling:g}\n"
    )
    try:
        folder.mkdir(parents=True, exist_ok=True)
        write_features(folder / f"{site.name}.geojson", features_of(site), site.frame)
        file.write_text(text, encoding="utf-8")
    except OSError as error:
        raise ConfigError(f"cannot be written: {error.strerror}", folder) from error
    return file


def features_of(site: Site) -> Iterator[Feature]:
    """Yield all that is drawn on a site, in metres."""
    yield from (_ground(room, site.ceiling) for room in site.rooms)
    yield from () if site.rooms else _floor(site)
    for wall in site.wall_lines if site.rooms else ():
        yield Feature("wall", shapely.LineString(wall.reshape(2, 2)))
    for solid in site.solids:
        yield Feature("wall", shapely.Polygon(solid))
    heights = site.door_heights or (DOOR_HEIGHT,) * len(site.doors)
    for ends, height in zip(site.doors, heights, strict=True):
        yield Feature("door", shapely.LineString(ends.reshape(2, 2)), {"height_m": height})
    for exit_ in site.exits:
        x1, y1, x2, y2 = exit_.ends
        yield Feature("exit", shapely.LineString([(x1, y1), (x2, y2)]), {"name": exit_.name})
    for zone in site.zones:
        area = zone.area
        yield Feature("zone", area, {"name": zone.name, "use": zone.use})
    for cover in site.wifi:
        area = cover.area
        yield Feature("wifi", area, {"name": cover.name, **cover.quality._asdict()})
    yield from _points(site)


def _ground(room: Room, ceiling: float) -> Feature:
    kind = "room" if not room.outdoor else "path" if room.paved else "yard"
    height = {} if room.outdoor or room.ceiling == ceiling else {"ceiling_m": room.ceiling}
    return Feature(kind, room.area, {"name": room.name, **height})


def _floor(site: Site) -> Iterator[Feature]:
    """Yield the floor of a bare map as one room, and the obstacles in it as solids."""
    walls = [shapely.LineString(wall.reshape(2, 2)) for wall in site.walls]
    pieces = shapely.get_parts(shapely.union_all(walls))  # cut where they cross
    faces: list[Any] = list(shapely.get_parts(shapely.polygonize(list(pieces))))
    row, column = np.argwhere(site.grid.reachable(FOOTPRINT))[0]
    middle = site.grid.to_xy(row + 0.5, column + 0.5)
    floor = next(face for face in faces if shapely.contains_xy(face, *middle))
    yield Feature("room", shapely.Polygon(floor.exterior), {"name": "Floor"})
    yield Feature("wall", shapely.LineString(floor.exterior))
    yield from (Feature("wall", shapely.Polygon(hole)) for hole in floor.interiors)


def _points(site: Site) -> Iterator[Feature]:
    for kind in ("robot_base", "guard_post", "operator_desk"):
        for pose in getattr(site, f"{kind}s"):
            yield Feature(kind, Point(pose.x, pose.y), _heading(pose))
    for camera in site.cameras:
        properties = {
            "name": camera.name,
            **_heading(Pose(camera.x, camera.y, camera.heading)),
            "field_of_view_deg": round(math.degrees(camera.field_of_view), 6),
            "range_m": camera.range,
        }
        yield Feature("camera", Point(camera.x, camera.y), properties)
    for station in site.base_stations:
        properties = {"name": station.name, "radio": station.radio}
        yield Feature("base_station", Point(station.x, station.y), properties)
    for detector in site.detectors:
        kind = f"{detector.kind}_detector"
        yield Feature(kind, Point(detector.x, detector.y), {"name": detector.name})


def _heading(pose: Pose) -> dict[str, float]:
    return {"heading_deg": round(math.degrees(pose.heading), 6)}
