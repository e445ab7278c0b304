"""Drawn features: GeoJSON in longitude and latitude, as any GeoJSON editor saves it."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, model_validator

from dva_sim.config import load_yaml, validate
from dva_sim.errors import ConfigError
from dva_sim.guesses import unknown
from dva_sim.worlds.geo import GeoFrame
from dva_sim.worlds.parts import DOOR_HEIGHT, QUALITIES, LinkQuality

Points = NDArray[np.float64]
Fail = Callable[[str], ConfigError]

DIGITS = 9  # of a coordinate [deg]: a tenth of a millimetre


class Drawn(BaseModel):
    """Properties of a feature; what an editor adds of its own is left alone."""

    model_config = ConfigDict(extra="ignore", frozen=True, allow_inf_nan=False)

    name: Annotated[str | None, BeforeValidator(lambda v: v if v is None else str(v))] = None


class DrawnRoom(Drawn):
    """A room; without a height of its own it has the site's."""

    ceiling_m: Annotated[float, Field(ge=1.5, le=50)] | None = None


class DrawnDoor(Drawn):
    """A door."""

    height_m: Annotated[float, Field(ge=1.5, le=10)] = DOOR_HEIGHT


class DrawnPose(Drawn):
    """A place with a heading, counter-clockwise from east."""

    heading_deg: float = 0.0


class DrawnZone(Drawn):
    """A part of the floor with a rule or a purpose."""

    use: Literal["restricted", "charging", "assembly"] = "restricted"


class DrawnCamera(DrawnPose):
    """A fixed camera."""

    field_of_view_deg: Annotated[float, Field(gt=0, le=360)] = 90.0
    range_m: Annotated[float, Field(gt=0, le=500)] = 15.0


class DrawnBaseStation(Drawn):
    """An antenna."""

    radio: Literal["wifi", "lte", "nr"] = "wifi"


class DrawnWifi(Drawn):
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


class Kind(NamedTuple):
    """How a kind of feature is drawn, and what its properties are."""

    shapes: tuple[str, ...]
    model: type[Drawn] = Drawn


KINDS = {
    "wall": Kind(("LineString", "MultiLineString", "Polygon")),
    "room": Kind(("Polygon",), DrawnRoom),
    "path": Kind(("Polygon",)),
    "yard": Kind(("Polygon",)),
    "door": Kind(("LineString",), DrawnDoor),
    "exit": Kind(("LineString",)),
    "zone": Kind(("Polygon",), DrawnZone),
    "wifi": Kind(("Polygon",), DrawnWifi),
    "robot_base": Kind(("Point",), DrawnPose),
    "guard_post": Kind(("Point",), DrawnPose),
    "operator_desk": Kind(("Point",), DrawnPose),
    "camera": Kind(("Point",), DrawnCamera),
    "base_station": Kind(("Point",), DrawnBaseStation),
    "smoke_detector": Kind(("Point",)),
    "heat_detector": Kind(("Point",)),
    "co_detector": Kind(("Point",)),
    "gas_detector": Kind(("Point",)),
    "water_detector": Kind(("Point",)),
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
        ConfigError: not GeoJSON, an unknown kind, a shape that does not suit its kind.
    """
    for index, feature in enumerate(_features(path)):
        fail = partial(_error, path, index)
        try:
            yield _feature(feature, frame, fail)
        except (KeyError, TypeError, ValueError, AttributeError, IndexError) as error:
            raise fail(f"is not a GeoJSON feature: {error}") from error


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
    import shapely
    from shapely.geometry import shape

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
    import shapely
    from shapely.geometry import mapping

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
