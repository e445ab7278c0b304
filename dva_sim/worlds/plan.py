"""Plans: what the drawn features of a site come to, in metres."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dva_sim.errors import ConfigError
from dva_sim.worlds.drawing import Fail, Feature, read_features
from dva_sim.worlds.geo import GeoFrame, Pose
from dva_sim.worlds.maps import segments
from dva_sim.worlds.parts import (
    CEILING,
    BaseStation,
    Coverage,
    Detector,
    Exit,
    FixedCamera,
    Lookup,
    Room,
    Zone,
)

Points = NDArray[np.float64]

DOOR_REACH = 0.15  # a door opens walls this near to its line [m]
SILL = 0.5  # floor on both sides of a door, in case the rooms drawn do not meet [m]
BEYOND = (0.06, 0.2, 0.35, 0.5)  # how far from an exit to look for what lies there [m]
LEAST_EXIT = 0.5  # [m]
NOTHING = 2  # further out than rooms (0) and ground outdoors (1)
GROUND = ("room", "path", "yard")  # where two overlap, the first of these counts


@dataclass
class Plan:
    """What a site's features come to, in metres.

    Attributes:
        floor: Shapely area of rooms, outdoor ground and doorways without the solids.
        walls: Segments `(n, 4)` [m], opened at the doors.
        doors: Segments `(n, 4)` [m].
        door_heights: Of each door [m].
        rooms: Rooms, then paths, then yards.
        solids: Corners `(k, 2)` [m] of walls drawn as areas.
        places: Poses by kind, each with what makes an error at its place in the file.
    """

    floor: Any = None
    walls: Points = field(default_factory=lambda: np.empty((0, 4)))
    doors: Points = field(default_factory=lambda: np.empty((0, 4)))
    door_heights: tuple[float, ...] = ()
    rooms: tuple[Room, ...] = ()
    solids: tuple[Points, ...] = ()
    exits: tuple[Exit, ...] = ()
    zones: tuple[Zone, ...] = ()
    wifi: tuple[Coverage, ...] = ()
    cameras: tuple[FixedCamera, ...] = ()
    base_stations: tuple[BaseStation, ...] = ()
    detectors: tuple[Detector, ...] = ()
    places: dict[str, list[tuple[Pose, Fail]]] = field(default_factory=lambda: defaultdict(list))

    def poses(self, kind: str) -> tuple[Pose, ...]:
        """All poses of a kind, in the order of the file."""
        return tuple(pose for pose, _ in self.places[kind])


def read_plan(path: Path, frame: GeoFrame, ceiling: float = CEILING) -> Plan:
    """Read a plan; `ceiling` [m] is that of rooms that do not say.

    Raises:
        ConfigError: not GeoJSON, an unknown kind, a shape that does not suit its kind.
    """
    plan = make_plan(read_features(path, frame), ceiling)
    if not plan.rooms:
        raise ConfigError("the plan has no feature of kind 'room'", path)
    return plan


def make_plan(features: Iterable[Feature], ceiling: float = CEILING) -> Plan:
    """Put features together.

    Raises:
        ConfigError: a property that does not suit its kind.
    """
    features = tuple(features)
    kinds: dict[str, list[Feature]] = defaultdict(list)
    for feature in features:
        kinds[feature.kind].append(feature)
    plan = Plan(rooms=_rooms(kinds, ceiling))
    lookup = Lookup(plan.rooms)
    plan.exits = tuple(_exit(lookup, *numbered) for numbered in _numbered(kinds, "exit"))
    plan.zones = tuple(Zone(n, _corners(f), f.drawn.use) for f, n in _numbered(kinds, "zone"))
    plan.wifi = tuple(Coverage(n, _corners(f), f.drawn.link) for f, n in _numbered(kinds, "wifi"))
    plan.cameras = tuple(_camera(*numbered) for numbered in _numbered(kinds, "camera"))
    plan.base_stations = tuple(
        BaseStation(f.shape.x, f.shape.y, f.drawn.radio, n)
        for f, n in _numbered(kinds, "base_station")
    )
    plan.detectors = _detectors(features)
    for kind in ("robot_base", "guard_post", "operator_desk"):
        for feature in kinds[kind]:
            plan.places[kind].append((_pose(feature), feature.fail))
    _open_walls(plan, kinds, lookup)
    return plan


def _numbered(kinds: dict[str, list[Feature]], kind: str) -> list[tuple[Feature, str]]:
    """The features of a kind, each with its name; the nameless are numbered."""
    what = kind.replace("_", "-")
    return [(f, f.drawn.name or f"{what}-{n}") for n, f in enumerate(kinds[kind], 1)]


def _corners(feature: Feature) -> Points:
    import shapely

    return shapely.get_coordinates(feature.shape.exterior)[:-1]


def _rooms(kinds: dict[str, list[Feature]], ceiling: float) -> tuple[Room, ...]:
    """Rooms need names of their own; paths and yards may go without."""
    rooms: list[Room] = []
    for kind in GROUND:
        for number, feature in enumerate(kinds[kind], 1):
            drawn = feature.drawn
            name = drawn.name or (None if kind == "room" else f"{kind.title()} {number}")
            if name is None or any(name == room.name for room in rooms):
                raise feature.fail(f"a {kind} needs a name of its own, not {name!r}")
            height = getattr(drawn, "ceiling_m", None) or ceiling
            outdoor, paved = kind != "room", kind != "yard"
            rooms.append(Room(name, _corners(feature), height, outdoor, paved))
    return tuple(rooms)


def _pose(feature: Feature) -> Pose:
    return Pose(feature.shape.x, feature.shape.y, math.radians(feature.drawn.heading_deg))


def _camera(feature: Feature, name: str) -> FixedCamera:
    drawn = feature.drawn
    return FixedCamera(*_pose(feature), math.radians(drawn.field_of_view_deg), drawn.range_m, name)


def _detectors(features: Iterable[Feature]) -> tuple[Detector, ...]:
    """In the order of the file, numbered by kind."""
    found: list[Detector] = []
    for feature in features:
        if feature.kind.endswith("_detector"):
            sensor = feature.kind.removesuffix("_detector")
            number = 1 + sum(other.kind == sensor for other in found)
            name = feature.drawn.name or f"{sensor}-{number}"
            found.append(Detector(name, sensor, feature.shape.x, feature.shape.y))
    return tuple(found)


def _exit(rooms: Lookup[Room], feature: Feature, name: str) -> Exit:
    """Out is the side further out: rooms, ground outdoors, nothing drawn; if alike, the left."""
    x1, y1, x2, y2 = _ends(feature.shape)
    width = math.hypot(x2 - x1, y2 - y1)
    if width < LEAST_EXIT:
        raise feature.fail(f"an exit is at least {LEAST_EXIT:g} m wide, not {width:g} m")
    x, y, left = (x1 + x2) / 2, (y1 + y2) / 2, math.atan2(x2 - x1, y1 - y2)
    right = math.remainder(left + math.pi, math.tau)
    outwards = right if _how_far_out(rooms, x, y, right) > _how_far_out(rooms, x, y, left) else left
    return Exit(x, y, outwards, width, name)


def _ends(line: Any) -> list[float]:
    """The first and the last point of a line: x1, y1, x2, y2 [m]."""
    return [float(value) for value in np.ravel(line.coords)[[0, 1, -2, -1]]]


def _how_far_out(rooms: Lookup[Room], x: float, y: float, heading: float) -> int:
    """What lies beyond a door: 0 a room, 1 ground outdoors, 2 nothing drawn."""
    for far in BEYOND:
        px, py = x + far * math.cos(heading), y + far * math.sin(heading)
        room = rooms.at(px, py)
        if room is not None:
            return int(room.outdoor)
    return NOTHING


def _open_walls(plan: Plan, kinds: dict[str, list[Feature]], rooms: Lookup[Room]) -> None:
    """Open the walls at the doors and find the floor.

    An exit opens the wall only where ground is drawn beyond it: nobody drives off the plan.
    """
    import shapely

    walls = [feature.shape for feature in kinds["wall"]]
    solids = [wall for wall in walls if wall.geom_type == "Polygon"]
    drawn = shapely.union_all([wall for wall in walls if wall.geom_type != "Polygon"])
    exits = [
        feature.shape
        for feature, way in zip(kinds["exit"], plan.exits, strict=True)
        if _how_far_out(rooms, way.x, way.y, way.heading) < NOTHING
    ]
    doors = [feature.shape for feature in kinds["door"]] + exits
    doorways = [door.buffer(DOOR_REACH, cap_style="flat") for door in doors]
    opened = shapely.difference(drawn, shapely.union_all(doorways))
    plan.walls = np.vstack([segments(shapely.line_merge(opened)), *map(segments, solids)])
    plan.doors = np.array([_ends(door.shape) for door in kinds["door"]]).reshape(-1, 4)
    plan.door_heights = tuple(door.drawn.height_m for door in kinds["door"])
    plan.solids = tuple(shapely.get_coordinates(solid.exterior) for solid in solids)
    ground = [shapely.Polygon(room.polygon) for room in plan.rooms]
    sills = [door.buffer(SILL, cap_style="flat") for door in doors]
    plan.floor = shapely.difference(shapely.union_all(ground + sills), shapely.union_all(solids))
