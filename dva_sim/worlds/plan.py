"""Drawn plans: GeoJSON in longitude and latitude, as any GeoJSON editor saves it."""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dva_sim.config import load_yaml
from dva_sim.errors import ConfigError
from dva_sim.worlds.geo import GeoFrame, Pose
from dva_sim.worlds.maps import segments

Points = NDArray[np.float64]
Fail = Callable[[str], ConfigError]

SHAPES = {
    "wall": ("LineString", "MultiLineString", "Polygon"),
    "room": ("Polygon",),
    "door": ("LineString",),
    "robot_base": ("Point",),
    "guard_post": ("Point",),
    "operator_desk": ("Point",),
    "smoke_detector": ("Point",),
    "gas_detector": ("Point",),
    "water_detector": ("Point",),
}
DOOR_REACH = 0.15  # a door opens walls this near to its line [m]
SILL = 0.5  # floor on both sides of a door, in case the rooms drawn do not meet [m]


@dataclass
class Plan:
    """What a GeoJSON file holds, in metres.

    Attributes:
        floor: Shapely area of rooms and doorways without the solids.
        walls: Segments `(n, 4)` [m], opened at the doors.
        doors: Segments `(n, 4)` [m].
        rooms: Names and corners `(k, 2)` [m].
        solids: Corners `(k, 2)` [m] of walls drawn as areas.
        detectors: Name, kind, x, y [m].
        places: Poses by kind, each with what makes an error at its place in the file.
    """

    floor: Any = None
    walls: Points = field(default_factory=lambda: np.empty((0, 4)))
    doors: Points = field(default_factory=lambda: np.empty((0, 4)))
    rooms: list[tuple[str, Points]] = field(default_factory=list)
    solids: tuple[Points, ...] = ()
    detectors: list[tuple[str, str, float, float]] = field(default_factory=list)
    places: dict[str, list[tuple[Pose, Fail]]] = field(default_factory=lambda: defaultdict(list))

    def poses(self, kind: str) -> tuple[Pose, ...]:
        """All poses of a kind, in the order of the file."""
        return tuple(pose for pose, _ in self.places[kind])


def read_plan(path: Path, frame: GeoFrame) -> Plan:
    """Read a plan.

    Raises:
        ConfigError: not GeoJSON, an unknown kind, a shape that does not suit its kind.
    """
    plan = Plan()
    lines: dict[str, list[Any]] = defaultdict(list)
    for index, feature in enumerate(_features(path)):
        fail = partial(_error, path, index)
        try:
            _take(plan, lines, feature, frame, fail)
        except (KeyError, TypeError, ValueError, AttributeError, IndexError) as error:
            raise fail(f"is not a GeoJSON feature: {error}") from error
    if not plan.rooms:
        raise ConfigError("the plan has no feature of kind 'room'", path)
    _assemble(plan, lines)
    return plan


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


def _take(
    plan: Plan, lines: dict[str, list[Any]], feature: Any, frame: GeoFrame, fail: Fail
) -> None:
    """Put one feature where it belongs."""
    import shapely
    from shapely.geometry import shape

    properties, geometry = feature["properties"], feature["geometry"]
    kind = properties.get("kind")
    if kind not in SHAPES:
        raise fail(f"unknown kind {kind!r}; known: {', '.join(SHAPES)}")
    if geometry["type"] not in SHAPES[kind]:
        allowed = " or ".join(SHAPES[kind])
        raise fail(f"a {kind} is drawn as {allowed}, not {geometry['type']}")
    drawn: Any = shapely.transform(shape(geometry), lambda points: _to_xy(points, frame))
    if not np.isfinite(shapely.get_coordinates(drawn)).all() or drawn.is_empty:
        raise fail("has no usable coordinates")
    if geometry["type"] == "Polygon" and not drawn.is_valid:
        raise fail(f"the outline of this {kind} crosses itself")
    if kind == "room":
        name = properties.get("name")
        if not isinstance(name, str) or any(name == other for other, _ in plan.rooms):
            raise fail(f"a room needs a name of its own, not {name!r}")
        plan.rooms.append((name, shapely.get_coordinates(drawn.exterior)[:-1]))
    elif kind in ("wall", "door"):
        lines[kind].append(drawn)
    elif kind.endswith("_detector"):
        sensor = kind.removesuffix("_detector")
        number = 1 + sum(other == sensor for _, other, _, _ in plan.detectors)
        name = str(properties.get("name", f"{sensor}-{number}"))
        plan.detectors.append((name, sensor, drawn.x, drawn.y))
    else:
        heading = np.radians(float(properties.get("heading_deg", 0.0)))
        plan.places[kind].append((Pose(drawn.x, drawn.y, float(heading)), fail))


def _to_xy(points: Points, frame: GeoFrame) -> Points:
    """Metres from longitude, latitude; to the millimetre, which is what nine digits hold."""
    return (
        np.array([frame.to_xy(latitude, longitude) for longitude, latitude in points]).round(3)
        + 0.0
    )


def _assemble(plan: Plan, lines: dict[str, list[Any]]) -> None:
    """Open the walls at the doors and find the floor."""
    import shapely

    solids = [wall for wall in lines["wall"] if wall.geom_type == "Polygon"]
    drawn = shapely.union_all([wall for wall in lines["wall"] if wall.geom_type != "Polygon"])
    doorways = [door.buffer(DOOR_REACH, cap_style="flat") for door in lines["door"]]
    opened = shapely.difference(drawn, shapely.union_all(doorways))
    plan.walls = np.vstack([segments(shapely.line_merge(opened)), *map(segments, solids)])
    plan.doors = np.array([np.ravel(door.coords)[[0, 1, -2, -1]] for door in lines["door"]])
    plan.doors = plan.doors.reshape(-1, 4)
    plan.solids = tuple(shapely.get_coordinates(solid.exterior) for solid in solids)
    rooms = [shapely.Polygon(corners) for _, corners in plan.rooms]
    sills = [door.buffer(SILL, cap_style="flat") for door in lines["door"]]
    plan.floor = shapely.difference(shapely.union_all(rooms + sills), shapely.union_all(solids))
