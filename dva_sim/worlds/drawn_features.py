"""Kinds of features on a plan, and the properties that each may have."""

from __future__ import annotations

from typing import Annotated, Literal, NamedTuple

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, model_validator

from dva_sim.worlds.site_parts import (
    DOOR_HEIGHT,
    QUALITIES,
    LinkQuality,
)


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
