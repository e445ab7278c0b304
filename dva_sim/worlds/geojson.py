"""Drawn features: GeoJSON in longitude and latitude, as any GeoJSON editor saves it.

Plans: what the drawn features of a site come to, in metres.
"""

from __future__ import annotations

import json
import math
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, model_validator
from shapely.geometry import mapping, shape

from dva_sim.kernel.config import validate
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.suggestions import unknown
from dva_sim.kernel.yaml_files import load_yaml
from dva_sim.worlds.geo import GeoFrame, Pose
from dva_sim.worlds.maps import segments
from dva_sim.worlds.site_parts import (
    CEILING,
    DOOR_HEIGHT,
    QUALITIES,
    BaseStation,
    Detector,
    Exit,
    FixedCamera,
    FloorPlan,
    LinkQuality,
    Lookup,
    RadioCoverage,
    Room,
    Zone,
    beyond,
)

Points = NDArray[np.float64]
Fail = Callable[[str], ConfigError]

DIGITS = 9  # of a coordinate [deg]: a tenth of a millimetre


class DrawnFeature(BaseModel):
    """Properties of a feature; what an editor adds of its own is left alone."""

    model_config = ConfigDict(extra="ignore", frozen=True, allow_inf_nan=False)

    name: Annotated[str | None, BeforeValidator(lambda v: v if v is None else str(v))] = None


class DrawnRoom(DrawnFeature):
    """A room; without a height of its own it has the site's."""

    ceiling_m: Annotated[float, Field(ge=1.5, le=50)] | None = None


class DrawnDoor(DrawnFeature):
    """A door."""

    height_m: Annotated[float, Field(ge=1.5, le=10)] = DOOR_HEIGHT


class DrawnPose(DrawnFeature):
    """A place with a heading, counter-clockwise from east."""

    heading_deg: float = 0.0


class DrawnZone(DrawnFeature):
    """A part of the floor with a rule or a purpose."""

    use: Literal["restricted", "charging", "assembly"] = "restricted"


class DrawnCamera(DrawnPose):
    """A fixed camera."""

    field_of_view_deg: Annotated[float, Field(gt=0, le=360)] = 90.0
    range_m: Annotated[float, Field(gt=0, le=500)] = 15.0


class DrawnBaseStation(DrawnFeature):
    """An antenna."""

    radio: Literal["wifi", "lte", "nr"] = "wifi"


class DrawnWifi(DrawnFeature):
    """The quality of a link: a word, numbers, or a word and the numbers that differ from it."""

    quality: Literal["good", "fair", "poor", "none"] | None = None
    loss: Annotated[float, Field(ge=0, le=1)] | None = None
    rate_bps: Annotated[float, Field(ge=1e3)] | None = None
    extra_delay_s: Annotated[float, Field(ge=0, le=30)] | None = None

    @model_validator(mode="after")
    def _says_something(self) -> DrawnWifi:
        if self.quality is None and not self.numbers:
            raise ValueError("should have a quality (good, fair, poor, none) or numbers")
        return self

    @property
    def numbers(self) -> dict[str, float]:
        """Those that are given."""
        given = {name: getattr(self, name) for name in LinkQuality._fields}
        return {name: value for name, value in given.items() if value is not None}

    @property
    def link(self) -> LinkQuality:
        """All three numbers."""
        return QUALITIES[self.quality or "good"]._replace(**self.numbers)


class FeatureKind(NamedTuple):
    """How a kind of feature is drawn, and what its properties are."""

    shapes: tuple[str, ...]
    model: type[DrawnFeature] = DrawnFeature


KINDS = {
    "wall": FeatureKind(("LineString", "MultiLineString", "Polygon")),
    "room": FeatureKind(("Polygon",), DrawnRoom),
    "path": FeatureKind(("Polygon",)),
    "yard": FeatureKind(("Polygon",)),
    "door": FeatureKind(("LineString",), DrawnDoor),
    "exit": FeatureKind(("LineString",)),
    "zone": FeatureKind(("Polygon",), DrawnZone),
    "wifi": FeatureKind(("Polygon",), DrawnWifi),
    "robot_base": FeatureKind(("Point",), DrawnPose),
    "guard_post": FeatureKind(("Point",), DrawnPose),
    "operator_desk": FeatureKind(("Point",), DrawnPose),
    "camera": FeatureKind(("Point",), DrawnCamera),
    "base_station": FeatureKind(("Point",), DrawnBaseStation),
    "smoke_detector": FeatureKind(("Point",)),
    "heat_detector": FeatureKind(("Point",)),
    "co_detector": FeatureKind(("Point",)),
    "gas_detector": FeatureKind(("Point",)),
    "water_detector": FeatureKind(("Point",)),
}


@dataclass(frozen=True, eq=False)
class Feature:
    """One thing on a plan.

    Attributes:
        kind: A key of `KINDS`.
        shape: Shapely geometry [m].
        properties: As written in the file.
        fail: Makes an error at the feature's place in its file.
    """

    kind: str
    shape: Any
    properties: Mapping[str, Any] = field(default_factory=dict)
    fail: Fail = ConfigError

    @property
    def drawn(self) -> Any:
        """The properties, checked: an instance of its kind's model."""
        given = {key: value for key, value in self.properties.items() if value is not None}
        return validate(KINDS[self.kind].model, given, lambda text, _: self.fail(text))


# --- reading ---------------------------------------------------------------------------
def read_features(path: Path, frame: GeoFrame) -> Iterator[Feature]:
    """The features of a GeoJSON file, in its order.

    Raises:
        ConfigError: not GeoJSON, an unknown kind, a shape that does not suit its kind, no room.
    """
    kinds = set()
    for index, data in enumerate(_features(path)):
        fail = partial(_error, path, index)
        try:
            feature = _feature(data, frame, fail)
        except (KeyError, TypeError, ValueError, AttributeError, IndexError) as error:
            raise fail(f"is not a GeoJSON feature: {error}") from error
        kinds.add(feature.kind)
        yield feature
    if "room" not in kinds:
        raise ConfigError("the plan has no feature of kind 'room'", path)


def _features(path: Path) -> list[Any]:
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except json.JSONDecodeError as error:
        raise ConfigError(f"is not JSON: {error.msg}", path, error.lineno, error.colno) from error
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError("cannot be read", path) from error
    except RecursionError:
        raise ConfigError("is nested too deeply", path) from None
    except ValueError as error:
        raise ConfigError(f"has a value that cannot be read: {error}", path) from error
    features = data.get("features") if isinstance(data, dict) else None
    if not isinstance(features, list):
        raise ConfigError("should be a GeoJSON FeatureCollection with 'features'", path, 1, 1)
    return features


def _error(path: Path, index: int, problem: str) -> ConfigError:
    """The mistake in a feature; only now is the file parsed again, for its line and column."""
    return load_yaml(path).error(f"feature {index + 1}: {problem}", ("features", index))


def _feature(feature: Any, frame: GeoFrame, fail: Fail) -> Feature:
    properties, geometry = feature["properties"], feature["geometry"]
    kind = properties.get("kind")
    if kind not in KINDS:
        raise fail(unknown("kind", kind, KINDS))
    if geometry["type"] not in KINDS[kind].shapes:
        allowed = " or ".join(KINDS[kind].shapes)
        raise fail(f"a {kind} is drawn as {allowed}, not {geometry['type']}")
    drawn: Any = shapely.transform(shape(geometry), lambda points: _to_xy(points, frame))
    if not np.isfinite(shapely.get_coordinates(drawn)).all() or drawn.is_empty:
        raise fail("has no usable coordinates")
    if geometry["type"] == "Polygon" and not drawn.is_valid:
        raise fail(f"the outline of this {kind} crosses itself")
    return Feature(kind, drawn, properties, fail)


def _to_xy(points: Points, frame: GeoFrame) -> Points:
    """Metres from longitude, latitude; to the millimetre, which is what nine digits hold."""
    return (
        np.array([frame.to_xy(latitude, longitude) for longitude, latitude in points]).round(3)
        + 0.0
    )


# --- writing ---------------------------------------------------------------------------
def write_features(path: Path, features: Iterable[Feature], frame: GeoFrame) -> None:
    """A GeoJSON file that `read_features` reads, one feature a line."""
    lines = []
    for feature in features:
        there = shapely.transform(feature.shape, lambda points: _to_degrees(points, frame))
        properties = {"kind": feature.kind, **feature.properties}
        ring = feature.shape.geom_type == "LinearRing"  # which GeoJSON does not know
        geometry = mapping(shapely.LineString(there) if ring else there)
        lines.append(
            json.dumps({"type": "Feature", "properties": properties, "geometry": geometry})
        )
    body = ",\n".join(lines)
    text = f'{{"type": "FeatureCollection", "features": [\n{body}\n]}}\n'
    path.write_text(text, encoding="utf-8")


def _to_degrees(points: Points, frame: GeoFrame) -> Points:
    """Longitude, latitude from metres."""
    degrees = np.array([frame.to_latlon(x, y) for x, y in points.tolist()])
    return degrees[:, ::-1].round(DIGITS)


DOOR_REACH = 0.15  # a door opens walls this near to its line [m]
SILL = 0.5  # floor on both sides of a door, in case the rooms drawn do not meet [m]
LEAST_EXIT = 0.5  # [m]
NOTHING = 2  # further out than rooms (0) and ground outdoors (1)
GROUND = ("room", "path", "yard")  # where two overlap, the first of these counts


def make_plan(features: Iterable[Feature], ceiling: float = CEILING) -> tuple[FloorPlan, Any]:
    """What is on a plan, and its floor: a shapely area without the solids.

    Args:
        features: In the order of the file.
        ceiling: Of rooms that do not say [m].

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
        zones=tuple(Zone(n, _corners(f), f.drawn.use) for f, n in _numbered(kinds, "zone")),
        cameras=tuple(_camera(*numbered) for numbered in _numbered(kinds, "camera")),
        base_stations=tuple(
            BaseStation(f.shape.x, f.shape.y, f.drawn.radio, n)
            for f, n in _numbered(kinds, "base_station")
        ),
        wifi=tuple(
            RadioCoverage(n, _corners(f), f.drawn.link) for f, n in _numbered(kinds, "wifi")
        ),
    )
    return plan, floor


def _numbered(kinds: dict[str, list[Feature]], kind: str) -> list[tuple[Feature, str]]:
    """The features of a kind, each with its name; the nameless are numbered."""
    what = kind.replace("_", "-")
    return [(f, f.drawn.name or f"{what}-{n}") for n, f in enumerate(kinds[kind], 1)]


def _corners(feature: Feature) -> Points:
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
    room = beyond(rooms, x, y, heading)
    return NOTHING if room is None else int(room.outdoor)


def _open_walls(
    kinds: dict[str, list[Feature]],
    rooms: tuple[Room, ...],
    exits: tuple[Exit, ...],
    lookup: Lookup[Room],
) -> tuple[Points, tuple[Points, ...], Any]:
    """Walls opened at the doors `(n, 4)` [m], corners of solids, and the floor.

    An exit opens the wall only where ground is drawn beyond it: nobody drives off the plan.
    """
    walls = [feature.shape for feature in kinds["wall"]]
    solids = [wall for wall in walls if wall.geom_type == "Polygon"]
    drawn = shapely.union_all([wall for wall in walls if wall.geom_type != "Polygon"])
    doors = [feature.shape for feature in kinds["door"]] + [
        feature.shape
        for feature, way in zip(kinds["exit"], exits, strict=True)
        if _how_far_out(lookup, way.x, way.y, way.heading) < NOTHING
    ]
    doorways = [door.buffer(DOOR_REACH, cap_style="flat") for door in doors]
    opened = shapely.difference(drawn, shapely.union_all(doorways))
    ground = [shapely.Polygon(room.polygon) for room in rooms]
    sills = [door.buffer(SILL, cap_style="flat") for door in doors]
    return (
        np.vstack([segments(shapely.line_merge(opened)), *map(segments, solids)]),
        tuple(shapely.get_coordinates(solid.exterior) for solid in solids),
        shapely.difference(shapely.union_all(ground + sills), shapely.union_all(solids)),
    )
