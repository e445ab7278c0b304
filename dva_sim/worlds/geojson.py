"""Drawn features as GeoJSON in longitude and latitude, as any GeoJSON editor saves it."""

from __future__ import annotations

import json
import re
from collections import Counter
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
from dva_sim.worlds.geo import GeoFrame
from dva_sim.worlds.site_parts import (
    DOOR_HEIGHT,
    QUALITIES,
    LinkQuality,
)
from dva_sim.worlds.storeys import parse_storeys, to_choose_from


class DrawnFeature(BaseModel):
    """Properties of a feature; properties that an editor adds are ignored."""

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
        """The numbers that the feature gives."""
        numbers = {name: getattr(self, name) for name in LinkQuality._fields}
        return {name: value for name, value in numbers.items() if value is not None}

    @property
    def link(self) -> LinkQuality:
        """Loss, rate and delay; a missing one is that of the quality."""
        return QUALITIES[self.quality or "good"]._replace(**self.numbers)


class FeatureKind(NamedTuple):
    """Geometry and properties of a kind of feature."""

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


Points = NDArray[np.float64]
Fail = Callable[[str], ConfigError]

FARTHEST = 10e3  # maximum distance from the origin, where a plane is still accurate [m]
IN_PARTS = frozenset({"wall", "zone", "wifi"})  # may be drawn as several shapes in one feature
GEOMETRIC = frozenset(
    {"storey", "floor", "floor_level", "level_id", "ordinal", "layer", "min_level", "max_level"}
    | {"height", "min_height", "elevation", "ele", "z", "width", "thickness", "radius", "rotation"}
)  # properties that other programs draw by, and plans here ignore
DIGITS = 9  # decimals of a coordinate in degrees: a tenth of a millimetre


@dataclass(frozen=True, eq=False)
class Feature:
    """One thing on a plan.

    Attributes:
        kind: A key of `KINDS`.
        shape: Shapely geometry [m].
        properties: Properties as written in the file.
        fail: Function that makes an error at the feature's place in its file.
    """

    kind: str
    shape: Any
    properties: Mapping[str, Any] = field(default_factory=dict)
    fail: Fail = ConfigError

    @property
    def drawn(self) -> Any:
        """The properties, checked: an instance of its kind's model."""
        properties = {key: value for key, value in self.properties.items() if value is not None}
        return validate(KINDS[self.kind].model, properties, lambda text, _: self.fail(text))


# --- reading ---------------------------------------------------------------------------
def read_features(path: Path, frame: GeoFrame, level: str | None = None) -> Iterator[Feature]:
    """Read the features of a GeoJSON file, in its order.

    Args:
        path: The file.
        frame: Plane of the site.
        level: Storey to read; features that name no storey are on each.

    Raises:
        ConfigError: not GeoJSON, an unknown kind, a shape that does not suit its kind, a position
            that is no longitude and latitude or far from the origin, no room, no such storey, or
            several of which none was chosen.
    """
    text = read_text(path)
    collection = _collection(path, text)
    crs = _crs(collection)
    kinds = set()
    on = [parse_storeys(_properties(data)) for data in collection["features"]]
    _require_storey(path, on, level)
    for index, data in enumerate(collection["features"]):
        if level is not None and on[index] and level not in on[index]:
            continue
        fail = partial(_error, path, text, index)
        for feature in _parts(data, frame, crs, fail):
            kinds.add(feature.kind)
            yield feature
    if "room" not in kinds:
        raise ConfigError("the plan has no feature of kind 'room'", path)


def storeys(path: Path) -> list[str]:
    """Return the storeys among which a site has to choose; empty if its plan has only one.

    Raises:
        ConfigError: not GeoJSON.
    """
    features = _collection(path, read_text(path))["features"]
    return to_choose_from(map(parse_storeys, map(_properties, features)))


def doubts_of_plan(path: Path) -> list[str]:
    """List ignored properties that mean geometry elsewhere, in sentences without full stop.

    Raises:
        ConfigError: not GeoJSON.
    """
    features = _collection(path, read_text(path))["features"]
    counts = Counter(key for data in features for key in _properties(data) if key in GEOMETRIC)
    doubts = [f"property {key!r} of {n} features is ignored" for key, n in sorted(counts.items())]
    lifted = sum(any(map(_has_height, _positions(data))) for data in features)
    if lifted:
        doubts.append(f"{lifted} features have positions with a height, which is ignored")
    return doubts


def _positions(data: Any) -> Iterator[list[Any]]:
    geometry = data.get("geometry") if isinstance(data, dict) else None
    nested = [geometry.get("coordinates")] if isinstance(geometry, dict) else []
    while nested:
        item = nested.pop()
        if not isinstance(item, list):
            continue
        if item and not isinstance(item[0], list):
            yield item
        else:
            nested += item


def _has_height(position: list[Any]) -> bool:
    return len(position) > 2 and position[2] not in (0, None)


def _properties(data: Any) -> Mapping[str, Any]:
    properties = data.get("properties") if isinstance(data, dict) else None
    return properties if isinstance(properties, dict) else {}


def _require_storey(path: Path, on: list[frozenset[str]], level: str | None) -> None:
    labels = to_choose_from(on) or sorted(frozenset().union(*on))
    if level is None and to_choose_from(on):
        text = f"has {len(labels)} storeys, by 'level': {listed(labels)}"
        raise ConfigError(f"{text}; a site reads one: add 'level: {labels[0]}' to it", path)
    if level is not None and level not in labels:
        there = f"its features are on {listed(labels)}" if labels else "no feature has a 'level'"
        raise ConfigError(f"has no storey {level}; {there}", path)


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
    """Return the coordinate reference system that a file names; empty after RFC 7946."""
    try:
        return str(collection["crs"]["properties"]["name"])
    except (KeyError, TypeError):
        return ""


def _error(path: Path, text: str, index: int, problem: str) -> ConfigError:
    """Return the mistake in a feature; only now is its line and column looked for."""
    at = _place(text, index)
    line = text.count("\n", 0, at) + 1
    column = at - text.rfind("\n", 0, at)
    return ConfigError(f"feature {index + 1}: {problem}", path, line, column)


def _place(text: str, index: int) -> int:
    """Return where a feature begins in the text of its file."""
    features = re.compile(r'"features"\s*:\s*\[').search(text)
    at = features.end() if features else 0
    decoder = json.JSONDecoder()
    gap = re.compile(r"[\s,]*")
    for _ in range(index):
        at = decoder.raw_decode(text, gap.match(text, at).end())[1]  # type: ignore[union-attr]
    return gap.match(text, at).end()  # type: ignore[union-attr]


def _parts(data: Any, frame: GeoFrame, crs: str, fail: Fail) -> Iterator[Feature]:
    """Yield a feature of the file; its parts one by one where its kind needs no name."""
    if not isinstance(data, dict):
        raise fail("should be a GeoJSON Feature, an object")
    properties = data.get("properties")
    geometry = data.get("geometry")
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
    """Return a geometry in the plane of the site, once its positions are known to lie there."""
    try:
        drawn: Any = shape(geometry)
    except (KeyError, TypeError, ValueError, IndexError, AttributeError, GEOSException):
        raise fail(f"its coordinates do not form a {geometry['type']}") from None
    positions = shapely.get_coordinates(drawn).tolist()
    if not positions or not np.isfinite(positions).all():
        raise fail("has no usable coordinates")
    for longitude, latitude in positions:
        if abs(longitude) > 180 or abs(latitude) > 90:
            text = (
                f"position {longitude:g}, {latitude:g} is not a longitude and latitude in degrees"
            )
            raise fail(text + _of_system(crs))
        if frame.distance(latitude, longitude) > FARTHEST:
            raise fail(_far(longitude, latitude, frame) + _of_system(crs))
    return shapely.transform(drawn, lambda points: _to_xy(points, frame))


def _of_system(crs: str) -> str:
    """Explain what to do about a file in another coordinate reference system."""
    if not crs or re.search(r"CRS84|4326", crs):
        return ""
    return f"; its crs is {crs!r}: save it in EPSG:4326 (WGS 84)"


def _far(longitude: float, latitude: float, frame: GeoFrame) -> str:
    """Return a position that lies far from the origin, and what may be the cause."""
    away = frame.distance(latitude, longitude) / 1e3
    origin = f"{frame.latitude:g}, {frame.longitude:g}"
    text = f"position {longitude:g}, {latitude:g} lies {away:,.0f} km from the site's origin"
    if abs(longitude) <= 90 and frame.distance(longitude, latitude) <= FARTHEST:
        return f"{text}: longitude comes first, then latitude"
    return f"{text} (latitude, longitude {origin}); at most {FARTHEST / 1e3:g} km"


def _to_xy(points: Points, frame: GeoFrame) -> Points:
    """Return metres from longitude, latitude; to the millimetre, which is what nine digits hold."""
    return (
        np.array([frame.to_xy(latitude, longitude) for longitude, latitude in points]).round(3)
        + 0.0
    )


# --- writing ---------------------------------------------------------------------------
def write_features(path: Path, features: Iterable[Feature], frame: GeoFrame) -> None:
    """Write a GeoJSON file that `read_features` reads, one feature a line."""
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
    """Return the longitude, latitude from metres."""
    degrees = np.array([frame.to_latlon(x, y) for x, y in points.tolist()])
    return degrees[:, ::-1].round(DIGITS)
