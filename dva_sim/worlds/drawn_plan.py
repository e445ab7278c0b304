"""The floor that a drawn plan describes: walls opened at doors, rooms, zones, cameras."""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
import shapely

from dva_sim.worlds.geo import Pose
from dva_sim.worlds.geojson import Feature, Points
from dva_sim.worlds.maps import segments, side
from dva_sim.worlds.site_parts import (
    CEILING,
    BaseStation,
    Detector,
    Exit,
    FixedCamera,
    FloorPlan,
    Lookup,
    RadioCoverage,
    Room,
    Zone,
    beyond,
)

DOOR_REACH = 0.15  # a door opens walls this near to its line [m]
SILL = 0.5  # floor added on both sides of a door, in case the drawn rooms do not meet [m]
MIN_EXIT = 0.5  # minimum width of an exit [m]
MIN_HOLE = 1e-4  # smaller holes come from lines that do not quite meet [m^2]
NEAR_RIM = 1e-3  # distance that counts as on the rim of a hole [m]
NOTHING = 2  # rank of no area, after rooms (0) and ground outdoors (1)
GROUND = ("room", "path", "yard")  # where two overlap, the first of these counts


def make_plan(features: Iterable[Feature], ceiling: float = CEILING) -> tuple[FloorPlan, Any]:
    """Build a plan, and its floor: a shapely area without the solids.

    Args:
        features: In the order of the file.
        ceiling: Default ceiling height of rooms [m].

    Raises:
        ConfigError: a property that does not suit its kind.
    """
    kinds: dict[str, list[Feature]] = defaultdict(list)
    detectors: list[Feature] = []
    for feature in features:
        kinds[feature.kind].append(feature)
        if feature.kind.endswith("_detector"):
            detectors.append(feature)
    rooms = _rooms(kinds, ceiling)
    lookup = Lookup(rooms)
    exits = tuple(_exit(lookup, *numbered) for numbered in _numbered(kinds, "exit"))
    walls, solids, floor = _open_walls(kinds, rooms, exits, lookup)
    plan = FloorPlan(
        walls=walls,
        rooms=rooms,
        doors=np.array([_ends(door.shape) for door in kinds["door"]]).reshape(-1, 4),
        robot_bases=tuple(map(_pose, kinds["robot_base"])),
        guard_posts=tuple(map(_pose, kinds["guard_post"])),
        operator_desks=tuple(map(_pose, kinds["operator_desk"])),
        detectors=_detectors(detectors),
        solids=solids,
        door_heights=tuple(door.drawn.height_m for door in kinds["door"]),
        exits=exits,
        zones=tuple(
            Zone(n, _corners(f), f.drawn.use, holes=_holes(f)) for f, n in _numbered(kinds, "zone")
        ),
        cameras=tuple(_camera(*numbered) for numbered in _numbered(kinds, "camera")),
        base_stations=tuple(
            BaseStation(f.shape.x, f.shape.y, f.drawn.radio, n)
            for f, n in _numbered(kinds, "base_station")
        ),
        wifi=tuple(
            RadioCoverage(n, _corners(f), f.drawn.link, holes=_holes(f))
            for f, n in _numbered(kinds, "wifi")
        ),
    )
    return plan, floor


def _numbered(kinds: dict[str, list[Feature]], kind: str) -> list[tuple[Feature, str]]:
    """Return the features of a kind, each with its name; the nameless are numbered."""
    what = kind.replace("_", "-")
    return [(f, f.drawn.name or f"{what}-{n}") for n, f in enumerate(kinds[kind], 1)]


def _corners(feature: Feature) -> Points:
    return shapely.get_coordinates(feature.shape.exterior)[:-1]


def _holes(feature: Feature) -> tuple[Points, ...]:
    return tuple(shapely.get_coordinates(hole)[:-1] for hole in feature.shape.interiors)


def _rooms(kinds: dict[str, list[Feature]], ceiling: float) -> tuple[Room, ...]:
    """Return the rooms; each needs a name of its own, paths and yards may go without."""
    rooms: list[Room] = []
    for kind in GROUND:
        for number, feature in enumerate(kinds[kind], 1):
            drawn = feature.drawn
            name = drawn.name or (None if kind == "room" else f"{kind.title()} {number}")
            if name is None or any(name == room.name for room in rooms):
                raise feature.fail(f"a {kind} needs a name of its own, not {name!r}")
            height = getattr(drawn, "ceiling_m", None) or ceiling
            outdoor = kind != "room"
            paved = kind != "yard"
            holes = _holes(feature)
            rooms.append(Room(name, _corners(feature), height, outdoor, paved, holes=holes))
    return tuple(rooms)


def _pose(feature: Feature) -> Pose:
    return Pose(feature.shape.x, feature.shape.y, math.radians(feature.drawn.heading_deg))


def _camera(feature: Feature, name: str) -> FixedCamera:
    drawn = feature.drawn
    return FixedCamera(*_pose(feature), math.radians(drawn.field_of_view_deg), drawn.range_m, name)


def _detectors(features: Iterable[Feature]) -> tuple[Detector, ...]:
    """Return detectors in the order of the file, numbered by kind."""
    detectors: list[Detector] = []
    for feature in features:
        sensor = feature.kind.removesuffix("_detector")
        number = 1 + sum(other.kind == sensor for other in detectors)
        name = feature.drawn.name or f"{sensor}-{number}"
        detectors.append(Detector(name, sensor, feature.shape.x, feature.shape.y))
    return tuple(detectors)


def _exit(rooms: Lookup[Room], feature: Feature, name: str) -> Exit:
    """Return the exit; out is the side further out: rooms, outdoors, nothing drawn, or left."""
    x1, y1, x2, y2 = _ends(feature.shape)
    width = math.hypot(x2 - x1, y2 - y1)
    if width < MIN_EXIT:
        raise feature.fail(f"an exit is at least {MIN_EXIT:g} m wide, not {width:g} m")
    x = (x1 + x2) / 2
    y = (y1 + y2) / 2
    left = math.atan2(x2 - x1, y1 - y2)
    right = math.remainder(left + math.pi, math.tau)
    outwards = right if _how_far_out(rooms, x, y, right) > _how_far_out(rooms, x, y, left) else left
    return Exit(x, y, outwards, width, name)


def _ends(line: Any) -> list[float]:
    """Return the first and the last point of a line: x1, y1, x2, y2 [m]."""
    return [float(value) for value in np.ravel(line.coords)[[0, 1, -2, -1]]]


def _how_far_out(rooms: Lookup[Room], x: float, y: float, heading: float) -> int:
    """Classify the place beyond a door: 0 a room, 1 ground outdoors, 2 nothing drawn."""
    room = beyond(rooms, x, y, heading)
    return NOTHING if room is None else int(room.outdoor)


def _open_walls(
    kinds: dict[str, list[Feature]],
    rooms: tuple[Room, ...],
    exits: tuple[Exit, ...],
    lookup: Lookup[Room],
) -> tuple[Points, tuple[Points, ...], Any]:
    """Return walls opened at the doors `(n, 4)` [m], corners of solids, and the floor.

    An exit opens the wall only where ground is drawn beyond it: nobody drives off the plan.
    """
    walls = [feature.shape for feature in kinds["wall"]]
    solids = [wall for wall in walls if wall.geom_type == "Polygon"]
    ground = [room.area for room in rooms]
    lines = [wall for wall in walls if wall.geom_type != "Polygon"]
    drawn = shapely.union_all([*lines, *_rims(rooms, shapely.union_all(ground + solids))])
    doors = [feature.shape for feature in kinds["door"]] + [
        feature.shape
        for feature, exit_ in zip(kinds["exit"], exits, strict=True)
        if _how_far_out(lookup, exit_.x, exit_.y, exit_.heading) < NOTHING
    ]
    doorways = [door.buffer(DOOR_REACH, cap_style="flat") for door in doors]
    opened = shapely.difference(drawn, shapely.union_all(doorways))
    sills = [door.buffer(SILL, cap_style="flat") for door in doors]
    return (
        np.vstack([segments(shapely.line_merge(opened)), *map(_sides, solids)]),
        tuple(
            shapely.get_coordinates(piece.exterior)
            for solid in solids
            for piece in _without_holes(solid)
        ),
        shapely.difference(shapely.union_all(ground + sills), shapely.union_all(solids)),
    )


def _rims(rooms: tuple[Room, ...], drawn: Any) -> Iterator[Any]:
    """Return rims of holes in the floor where nothing else is drawn: nobody drives in."""
    for hole in (hole for room in rooms for hole in room.holes):
        bare: Any = shapely.difference(shapely.Polygon(hole), drawn)
        if bare.area > MIN_HOLE:
            yield shapely.intersection(shapely.LinearRing(hole), bare.buffer(NEAR_RIM))


def _sides(solid: Any) -> Points:
    """Return the sides `(n, 4)` [m] of a solid, cut where its pieces without holes are."""
    sides = np.vstack([segments(piece) for piece in _without_holes(solid)])
    keys = [side(each[:2], each[2:]) for each in sides]
    times = Counter(keys)  # two pieces share a cut, which is no side of the solid
    return sides[[times[each] == 1 for each in keys]] if solid.interiors else sides


def _without_holes(area: Any) -> Iterator[Any]:
    """Yield an area cut into pieces that have none."""
    if not area.interiors:
        yield area
        return
    xmin, ymin, xmax, ymax = area.bounds
    x = area.interiors[0].centroid.x
    for low, high in ((xmin, x), (x, xmax)):
        side = shapely.intersection(area, shapely.box(low, ymin, high, ymax))
        for piece in shapely.get_parts(side):
            if piece.geom_type == "Polygon":
                yield from _without_holes(piece)
