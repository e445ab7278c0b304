"""Bare ROS maps as sites: walls from the border of the floor, bases placed by a seed."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dva_sim import resources
from dva_sim.errors import ConfigError
from dva_sim.streams import Streams
from dva_sim.worlds.geo import GeoFrame, Pose
from dva_sim.worlds.layout import FOOTPRINT, Site
from dva_sim.worlds.maps import OccupancyGrid, load_ros_map, outline
from dva_sim.worlds.parts import Detector

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
