"""Drawn features: GeoJSON in longitude and latitude, as any GeoJSON editor saves it.

Plans: what the drawn features of a site come to, in metres.
"""

from __future__ import annotations

import json
import math
import re
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, model_validator
from shapely.errors import GEOSException
from shapely.geometry import mapping, shape

from dva_sim.kernel.config import validate
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.suggestions import listed, unknown
from dva_sim.kernel.yaml_files import read_text
from dva_sim.worlds.geo import GeoFrame, Pose
from dva_sim.worlds.maps import segments, side
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

FARTHEST = 10e3  # from the origin, where a plane still is as good as the earth [m]
IN_PARTS = frozenset({"wall", "zone", "wifi"})  # may be drawn as several shapes in one feature
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
        ConfigError: not GeoJSON, an unknown kind, a shape that does not suit its kind, a position
            that is no longitude and latitude or far from the origin, no room.
    """
    text = read_text(path)
    collection = _collection(path, text)
    crs = _crs(collection)
    kinds = set()
    for index, data in enumerate(collection["features"]):
        fail = partial(_error, path, text, index)
        for feature in _parts(data, frame, crs, fail):
            kinds.add(feature.kind)
            yield feature
    if "room" not in kinds:
        raise ConfigError("the plan has no feature of kind 'room'", path)


def _collection(path: Path, text: str) -> dict[str, Any]:
    try:
        data = json.loads(text)
    except json.JSONDecodeError as error:
        raise ConfigError(f"is not JSON: {error.msg}", path, error.lineno, error.colno) from error
    except RecursionError:
        raise ConfigError("is nested too deeply", path) from None
    except ValueError as error:
        raise ConfigError(f"has a value that cannot be read: {error}", path) from error
    if not isinstance(data, dict) or not isinstance(data.get("features"), list):
        raise ConfigError("should be a GeoJSON FeatureCollection with 'features'", path, 1, 1)
    return data


def _crs(collection: Mapping[str, Any]) -> str:
    """The coordinate reference system that a file names, as before RFC 7946; empty if none."""
    try:
        return str(collection["crs"]["properties"]["name"])
    except (KeyError, TypeError):
        return ""


def _error(path: Path, text: str, index: int, problem: str) -> ConfigError:
    """The mistake in a feature; only now is its line and column looked for."""
    at = _place(text, index)
    line, column = text.count("\n", 0, at) + 1, at - text.rfind("\n", 0, at)
    return ConfigError(f"feature {index + 1}: {problem}", path, line, column)


def _place(text: str, index: int) -> int:
    """Where a feature begins in the text of its file."""
    features = re.compile(r'"features"\s*:\s*\[').search(text)
    at = features.end() if features else 0
    decoder, gap = json.JSONDecoder(), re.compile(r"[\s,]*")
    for _ in range(index):
        at = decoder.raw_decode(text, gap.match(text, at).end())[1]  # type: ignore[union-attr]
    return gap.match(text, at).end()  # type: ignore[union-attr]


def _parts(data: Any, frame: GeoFrame, crs: str, fail: Fail) -> Iterator[Feature]:
    """A feature of the file; where its kind needs no name of its own, its parts one by one."""
    if not isinstance(data, dict):
        raise fail("should be a GeoJSON Feature, an object")
    properties, geometry = data.get("properties"), data.get("geometry")
    if not isinstance(properties, dict | None):
        raise fail("its 'properties' should be an object")
    properties = properties or {}
    kind = properties.get("kind")
    if kind is None:
        raise fail(f"has no property 'kind'; kinds: {listed(KINDS, len(KINDS))}")
    if not isinstance(kind, str) or kind not in KINDS:
        raise fail(unknown("kind", kind, KINDS))
    if not isinstance(geometry, dict) or "type" not in geometry:
        raise fail(f"this {kind} has no geometry")
    shapes = KINDS[kind].shapes
    drawn_as = str(geometry["type"])
    if drawn_as not in shapes and drawn_as.removeprefix("Multi") not in shapes:
        raise fail(f"a {kind} is drawn as {' or '.join(shapes)}, not {drawn_as}")
    drawn = _in_metres(geometry, frame, crs, fail)
    parts = [drawn] if drawn_as in shapes else list(shapely.get_parts(drawn))
    if len(parts) > 1 and kind not in IN_PARTS:
        raise fail(f"this {kind} has {len(parts)} parts; draw each as a feature of its own")
    for part in parts:
        if part.geom_type == "Polygon" and not part.is_valid:
            reason = shapely.is_valid_reason(part).partition("[")[0].lower()
            raise fail(f"the outline of this {kind} crosses or touches itself ({reason})")
        yield Feature(kind, part, properties, fail)


def _in_metres(geometry: dict[str, Any], frame: GeoFrame, crs: str, fail: Fail) -> Any:
    """A geometry in the plane of the site, once its positions are known to lie there."""
    try:
        drawn: Any = shape(geometry)
    except (KeyError, TypeError, ValueError, IndexError, AttributeError, GEOSException):
        raise fail(f"its coordinates do not form a {geometry['type']}") from None
    positions = shapely.get_coordinates(drawn).tolist()
    if not positions or not np.isfinite(positions).all():
        raise fail("has no usable coordinates")
    for longitude, latitude in positions:
        if abs(longitude) > 180 or abs(latitude) > 90:
            told = (
                f"position {longitude:g}, {latitude:g} is not a longitude and latitude in degrees"
            )
            raise fail(told + _of_system(crs))
        if frame.distance(latitude, longitude) > FARTHEST:
            raise fail(_far(longitude, latitude, frame) + _of_system(crs))
    return shapely.transform(drawn, lambda points: _to_xy(points, frame))


def _of_system(crs: str) -> str:
    """What to do about a file in another coordinate reference system."""
    if not crs or re.search(r"CRS84|4326", crs):
        return ""
    return f"; its crs is {crs!r}: save it in EPSG:4326 (WGS 84)"


def _far(longitude: float, latitude: float, frame: GeoFrame) -> str:
    """A position that lies far from the origin, and what may be the cause."""
    away = frame.distance(latitude, longitude) / 1e3
    origin = f"{frame.latitude:g}, {frame.longitude:g}"
    told = f"position {longitude:g}, {latitude:g} lies {away:,.0f} km from the site's origin"
    if abs(longitude) <= 90 and frame.distance(longitude, latitude) <= FARTHEST:
        return f"{told}: longitude comes first, then latitude"
    return f"{told} (latitude, longitude {origin}); at most {FARTHEST / 1e3:g} km"


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
LEAST_HOLE = 1e-4  # a smaller one comes from lines that do not quite meet [m^2]
NEAR_RIM = 1e-3  # of a hole [m]
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
    """The features of a kind, each with its name; the nameless are numbered."""
    what = kind.replace("_", "-")
    return [(f, f.drawn.name or f"{what}-{n}") for n, f in enumerate(kinds[kind], 1)]


def _corners(feature: Feature) -> Points:
    return shapely.get_coordinates(feature.shape.exterior)[:-1]


def _holes(feature: Feature) -> tuple[Points, ...]:
    return tuple(shapely.get_coordinates(hole)[:-1] for hole in feature.shape.interiors)


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
            holes = _holes(feature)
            rooms.append(Room(name, _corners(feature), height, outdoor, paved, holes=holes))
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
    ground = [room.area for room in rooms]
    lines = [wall for wall in walls if wall.geom_type != "Polygon"]
    drawn = shapely.union_all([*lines, *_rims(rooms, shapely.union_all(ground + solids))])
    doors = [feature.shape for feature in kinds["door"]] + [
        feature.shape
        for feature, way in zip(kinds["exit"], exits, strict=True)
        if _how_far_out(lookup, way.x, way.y, way.heading) < NOTHING
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
    """The rims of holes in the floor, where nothing else is drawn in them: nobody drives in."""
    for hole in (hole for room in rooms for hole in room.holes):
        bare: Any = shapely.difference(shapely.Polygon(hole), drawn)
        if bare.area > LEAST_HOLE:
            yield shapely.intersection(shapely.LinearRing(hole), bare.buffer(NEAR_RIM))


def _sides(solid: Any) -> Points:
    """The sides `(n, 4)` [m] of a solid, cut where its pieces without holes are."""
    sides = np.vstack([segments(piece) for piece in _without_holes(solid)])
    known = [side(each[:2], each[2:]) for each in sides]
    times = Counter(known)  # two pieces share a cut, which is no side of the solid
    return sides[[times[each] == 1 for each in known]] if solid.interiors else sides


def _without_holes(area: Any) -> Iterator[Any]:
    """An area cut into pieces that have none."""
    if not area.interiors:
        yield area
        return
    (xmin, ymin, xmax, ymax), x = area.bounds, area.interiors[0].centroid.x
    for low, high in ((xmin, x), (x, xmax)):
        side = shapely.intersection(area, shapely.box(low, ymin, high, ymax))
        for piece in shapely.get_parts(side):
            if piece.geom_type == "Polygon":
                yield from _without_holes(piece)
