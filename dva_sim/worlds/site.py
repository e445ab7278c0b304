"""Bare ROS maps as sites: walls from the border of the floor, bases placed by a seed.

Sites by name: drawn, generated, or from a bare ROS map.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from dva_sim.kernel import resources
from dva_sim.kernel.config import Config, Document, load_yaml, validate
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.streams import Streams
from dva_sim.kernel.suggestions import hint
from dva_sim.worlds.geo import GeoFrame, Pose
from dva_sim.worlds.geojson import FloorPlan, make_plan, read_plan
from dva_sim.worlds.layout import FOOTPRINT, STANDING, Site
from dva_sim.worlds.maps import OccupancyGrid, load_ros_map, outline, rasterise
from dva_sim.worlds.office_block import OfficeBlock, office_block
from dva_sim.worlds.site_parts import CEILING, Detector, Room

__all__ = [
    "DEFAULT_FRAME",
    "FOOTPRINT",
    "Detector",
    "Pose",
    "Room",
    "Site",
    "SiteFile",
    "load_site",
    "map_site",
]


# A bare map does not say where on earth it is: the campus in Monte de Caparica.
DEFAULT_FRAME = GeoFrame(38.6612, -9.2058)
DESKS = 2  # operator desks on a bare map
BASE_SPACING = 1.5  # between the bases placed on a bare map [m]
DETECTOR_SPACING = {"smoke": 8.0, "gas": 10.0, "water": 11.0}  # lattice on a bare map [m]


def map_site(path: str | Path, seed: int, robots: int, guards: int) -> Site:
    """A bare ROS map as a site: bases and posts placed by `seed` on known, reachable floor.

    The walls are the border of the largest area that a robot can reach.

    Args:
        path: The map's YAML file.
        seed: Chooses the places; robot 1 stands at the same place however many there are.
        robots: Number of robot bases.
        guards: Number of guard posts.

    Raises:
        ConfigError: the map is missing or not valid, or no robot fits anywhere.
    """
    return _map_site(resources.find(str(path), "worlds").resolve(), seed, robots, guards)


@lru_cache(maxsize=64)
def _map_site(path: Path, seed: int, robots: int, guards: int) -> Site:
    bare, streams = _bare_map(path), Streams(seed)
    bases = _scatter(bare, streams, "robot-base", robots, FOOTPRINT)
    posts = _scatter(bare, streams, "guard-post", guards, FOOTPRINT)
    desks = _scatter(bare, streams, "operator-desk", DESKS, FOOTPRINT)
    # The copy shares the grid and the cache of free cells: they depend on the map alone.
    return replace(bare, robot_bases=bases, guard_posts=posts, operator_desks=desks)


@lru_cache(maxsize=4)
def _bare_map(path: Path) -> Site:
    """All of a map's site that does not depend on the seed."""
    grid = load_ros_map(path)
    reached = grid.reachable(FOOTPRINT)
    if not reached.any():
        raise ConfigError(f"has no known-free floor that a robot of {FOOTPRINT:g} m fits on", path)
    walls = outline(grid, grid.floor(FOOTPRINT))
    xy = walls.reshape(-1, 2)
    return Site(
        name=path.stem,
        frame=DEFAULT_FRAME,
        walls=walls,
        rooms=(),
        doors=np.empty((0, 4)),
        robot_bases=(),
        guard_posts=(),
        operator_desks=(),
        detectors=_lattice(grid, reached),
        extent=(*map(float, xy.min(axis=0)), *map(float, xy.max(axis=0))),  # type: ignore[arg-type]
        grid=grid,
    )


def _scatter(
    site: Site, streams: Streams, what: str, count: int, radius: float
) -> tuple[Pose, ...]:
    """Places apart from each other; each has a stream of its own."""
    places: list[Pose] = []
    for number in range(1, count + 1):
        rng = streams.fresh(f"site/{what}-{number}")
        for _ in range(100):
            x, y = site.sample_free(rng, radius + 2 * site.grid.resolution)
            if all(np.hypot(x - p.x, y - p.y) >= BASE_SPACING for p in places):
                break
        else:
            raise ConfigError(f"map {site.name!r} has no room for {count} {what}s")
        places.append(Pose(x, y, float(rng.uniform(-np.pi, np.pi))))
    return tuple(places)


def _lattice(grid: OccupancyGrid, reached: NDArray[np.bool_]) -> tuple[Detector, ...]:
    """Detectors on square lattices of cells that can be reached."""
    detectors = []
    for kind, spacing in DETECTOR_SPACING.items():
        step = max(1, round(spacing / grid.resolution))
        rows, columns = np.nonzero(reached[step // 2 :: step, step // 2 :: step])
        points = grid.to_xy(rows * step + step // 2 + 0.5, columns * step + step // 2 + 0.5)
        for number, (x, y) in enumerate(points.tolist(), 1):
            detectors.append(Detector(f"{kind}-{number}", kind, x, y))
    return tuple(detectors)


class SiteFile(Config):
    """`worlds/NAME.yaml`: where the origin lies, and which plan belongs to it.

    The plan is drawn, in a GeoJSON file, or generated.
    """

    class Origin(Config):
        """Geographic position of x = y = 0 [deg]."""

        latitude: Annotated[float, Field(gt=-89, lt=89)]
        longitude: Annotated[float, Field(ge=-180, le=180)]

    name: str
    description: str = ""
    origin: Origin
    plan: str | None = None
    generate: OfficeBlock | None = None
    resolution_m: Annotated[float, Field(gt=0.005, le=0.5)] = 0.05
    ceiling_m: Annotated[float, Field(ge=1.5, le=50)] = CEILING

    @model_validator(mode="after")
    def _one_plan(self) -> SiteFile:
        if (self.plan is None) == (self.generate is None):
            raise ValueError("should have a plan (a GeoJSON file) or generate, and not both")
        return self


def load_site(name_or_path: str | Path, options: Mapping[str, Any] | None = None) -> Site:
    """Read a site in our own format, by name or path; once per process.

    Args:
        name_or_path: Such as `caparica`.
        options: Replace keys of `generate`, such as the seed, where a site is generated.

    Raises:
        ConfigError: not found, unknown key or kind, a base inside a wall.
    """
    path = resources.find(str(name_or_path), "worlds").resolve()
    return _load_site(path, json.dumps(dict(options or {}), sort_keys=True))


@lru_cache(maxsize=16)
def _load_site(path: Path, options: str) -> Site:
    document = load_yaml(path)
    if "image" in document.data and "plan" not in document.data:
        problem = "is a bare ROS map; give it as site.map, not as site.name"
        raise document.error(problem, ("image",))
    config = validate(SiteFile, document.data, document.error)
    frame = GeoFrame(config.origin.latitude, config.origin.longitude)
    plan = _plan(config, document, frame, json.loads(options))
    return _site(config, frame, plan)


def _plan(
    config: SiteFile, document: Document, frame: GeoFrame, options: Mapping[str, Any]
) -> FloorPlan:
    if config.generate is not None:
        wanted = _with_options(config.name, config.generate, options)
        return make_plan(office_block(wanted), config.ceiling_m)
    if options:
        given = ", ".join(options)
        raise ConfigError(f"site {config.name!r} is drawn and takes no options; given: {given}")
    file = document.file.parent / str(config.plan)
    if not resources.is_file(file):
        raise document.error(f"plan {config.plan!r} not found", ("plan",))
    return read_plan(file, frame, config.ceiling_m)


def _with_options(name: str, block: OfficeBlock, options: Mapping[str, Any]) -> OfficeBlock:
    known = [key for key in type(block).model_fields if key != "kind"]
    for key in options:
        if key not in known:
            raise ConfigError(f"site {name!r} has no option {key!r}; {hint(key, known)}")
    data = block.model_dump() | dict(options)
    return validate(OfficeBlock, data, lambda text, _: ConfigError(f"site {name!r}: {text}"))


def _site(config: SiteFile, frame: GeoFrame, plan: FloorPlan) -> Site:
    site = Site(
        name=config.name,
        frame=frame,
        walls=plan.walls,
        rooms=plan.rooms,
        doors=plan.doors,
        robot_bases=plan.poses("robot_base"),
        guard_posts=plan.poses("guard_post"),
        operator_desks=plan.poses("operator_desk"),
        detectors=plan.detectors,
        extent=plan.floor.bounds,
        grid=rasterise(plan.floor, plan.walls, config.resolution_m),
        solids=plan.solids,
        door_heights=plan.door_heights,
        exits=plan.exits,
        zones=plan.zones,
        cameras=plan.cameras,
        base_stations=plan.base_stations,
        wifi=plan.wifi,
        ceiling=config.ceiling_m,
    )
    for kind, radius in (("robot_base", FOOTPRINT), ("guard_post", STANDING)):
        for pose, error in plan.places[kind]:
            if not site.is_free(pose.x, pose.y, radius):
                raise error(f"{kind} needs {radius:g} m of free floor around it: it is in a wall")
    return site
