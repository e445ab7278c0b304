"""A place where robots and people work, and such places by name: drawn, generated, or a bare map.

On a bare ROS map the walls are the border of its floor; bases are placed by a seed.
"""

from __future__ import annotations

import itertools
import json
import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Annotated, Any, TypeVar

import numpy as np
import shapely
from numpy.typing import NDArray
from pydantic import Field, model_validator

from dva_sim.kernel import resources
from dva_sim.kernel.config import Config, validate
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.read_once import read_once
from dva_sim.kernel.streams import Streams
from dva_sim.kernel.suggestions import hint
from dva_sim.kernel.yaml_files import Document, load_yaml, with_named_files
from dva_sim.worlds.compartments import NO_COMPARTMENT, FloorPartition, of_floor, of_rooms
from dva_sim.worlds.drawn_plan import make_plan
from dva_sim.worlds.geo import GeoFrame, Pose
from dva_sim.worlds.geojson import Feature, doubts_of_plan, read_features
from dva_sim.worlds.maps import (
    FREE,
    MAX_CELLS,
    OccupancyGrid,
    load_ros_map,
    outline,
    rasterise,
    side,
)
from dva_sim.worlds.office_block import OfficeBlock, office_block
from dva_sim.worlds.site_parts import (
    CEILING,
    DOOR_HEIGHT,
    Compartment,
    Detector,
    FloorPlan,
    Lookup,
    Opening,
    RadioCoverage,
    Room,
)
from dva_sim.worlds.storeys import label_of

Floats = NDArray[np.float64]
T = TypeVar("T")

FOOTPRINT = 0.30  # radius that must fit at a robot base [m]
STANDING = 0.20  # radius that must fit where a person stands [m]


@dataclass(frozen=True, eq=False, kw_only=True)
class Site(FloorPlan):
    """A place where robots and people work.

    Attributes:
        name: Name of the site or of the map.
        frame: Location of its plane on earth.
        extent: xmin, ymin, xmax, ymax of everything [m].
        grid: Free, occupied and unknown cells.
        ceiling: Default ceiling height of rooms [m].
    """

    name: str
    frame: GeoFrame
    extent: tuple[float, float, float, float]
    grid: OccupancyGrid
    ceiling: float = CEILING
    _kept: dict[object, Any] = field(default_factory=dict, repr=False)

    def kept(self, key: object, make: Callable[[], T]) -> T:
        """Return what `make` makes, cached for this site and its copies on the same grid."""
        key = self.grid, key
        if key not in self._kept:
            self._kept[key] = make()
        made: T = self._kept[key]
        return made

    def room_at(self, x: float, y: float) -> str | None:
        """Return the name of the room around a point [m], or None outside all rooms."""
        room = self._rooms.at(x, y)
        return None if room is None else room.name

    def link_quality(self, x: float, y: float) -> RadioCoverage | None:
        """Return the coverage drawn around a point [m], the later over the earlier, or None."""
        return self._wifi.at(x, y)

    @cached_property
    def _rooms(self) -> Lookup[Room]:
        return Lookup(self.rooms)

    @cached_property
    def _wifi(self) -> Lookup[RadioCoverage]:
        return Lookup(self.wifi[::-1])

    @cached_property
    def wall_lines(self) -> Floats:
        """The walls `(n, 4)` [m] without the sides of solids."""
        sides = Counter(side(a, b) for solid in self.solids for a, b in itertools.pairwise(solid))
        walls = [side(wall[:2], wall[2:]) for wall in self.walls]
        drawn = Counter(walls)
        keep = np.array([drawn[wall] > sides[wall] for wall in walls], dtype=bool)
        return np.asarray(self.walls[keep])

    # --- bodies of air -----------------------------------------------------------------

    @property
    def compartments(self) -> tuple[Compartment, ...]:
        """The rooms that are not outdoors; on a bare map, blocks of its floor."""
        return self.partition.compartments

    @property
    def openings(self) -> tuple[Opening, ...]:
        """Doors, exits and open borders between two compartments, or one and outdoors."""
        return self.partition.openings

    def compartment_at(self, x: float, y: float) -> int | None:
        """Index of the compartment around a point [m], to within a cell; None for none."""
        label = int(self.grid.look_up(self.partition.labels, x, y, NO_COMPARTMENT))
        return None if label == NO_COMPARTMENT else label

    @cached_property
    def partition(self) -> FloorPartition:
        """Compartments, openings, and whose each cell of the grid is."""
        return self.kept("partition", self._partition)

    def _partition(self) -> FloorPartition:
        if not self.rooms:
            return of_floor(self.grid, self.grid.floor(FOOTPRINT))
        heights = self.door_heights or (DOOR_HEIGHT,) * len(self.doors)
        doors = zip(self.doors.tolist(), heights, strict=True)
        ways = [
            *((ends, height, "door") for ends, height in doors),
            *((exit_.ends, DOOR_HEIGHT, "exit") for exit_ in self.exits),
        ]
        return of_rooms(self.grid, self.rooms, self.walls, ways)

    # --- places ------------------------------------------------------------------------

    def room(self, name: str) -> Room:
        """Return the room of that name.

        Raises:
            ConfigError: there is none; the message lists the rooms.
        """
        for room in self.rooms:
            if room.name == name:
                return room
        names = [room.name for room in self.rooms]
        text = hint(name, names, "rooms") if names else "a bare map names no rooms"
        raise ConfigError(f"site {self.name!r} has no room {name!r}; {text}")

    def is_free(self, x: float, y: float, clearance: float) -> bool:
        """Return True if a disc of radius `clearance` [m] fits at a point [m], to within a cell."""
        return self.grid.state_at(x, y) == FREE and self.grid.clearance_at(x, y) >= clearance

    def sample_free(
        self, rng: np.random.Generator, clearance: float, room: str | None = None
    ) -> tuple[float, float]:
        """Return a random free point that a robot, or a body of another clearance, can reach.

        Args:
            rng: Random generator.
            clearance: Radius that must fit at the point [m]; on the way there no more than a
                robot's has to, or doors would part the site.
            room: Only inside this room.

        Raises:
            ConfigError: no such room, or no free point there.
        """
        cells = self.kept((clearance, room), lambda: self._free_cells(clearance, room))
        columns = self.grid.cells.shape[1]
        if not len(cells):
            where = f"room {room!r} of site {self.name!r}" if room else f"site {self.name!r}"
            raise ConfigError(f"{where} has no free place of {clearance:g} m radius")
        cell = int(cells[rng.integers(len(cells))])
        jitter = rng.random(2)
        x, y = self.grid.to_xy(cell // columns + jitter[0], cell % columns + jitter[1]).tolist()
        return x, y

    def place_in(self, room: str) -> tuple[float, float] | None:
        """Return the place nearest to a room's middle [m] that a robot can reach, or None.

        Raises:
            ConfigError: no such room.
        """
        cells = self._free_cells(FOOTPRINT, room)
        if not len(cells):
            return None
        columns = self.grid.cells.shape[1]
        places = self.grid.to_xy(cells // columns + 0.5, cells % columns + 0.5)
        middle = self.ground_of(self.room(room)).centroid
        offsets = places - np.array([middle.x, middle.y])
        x, y = places[np.argmin(np.hypot(*offsets.T))].tolist()
        return x, y

    def floor_near(self, x: float, y: float, within: float) -> tuple[float, float] | None:
        """Return the place that a robot can reach nearest to a point [m], in the same room.

        Args:
            x: To the east [m].
            y: To the north [m].
            within: Farthest from the point [m].

        Returns:
            The point itself where a robot can stand there; None if there is no such place.
        """
        places = self.free_middles(FOOTPRINT)
        gaps = np.hypot(*(places - (x, y)).T)
        room = self.room_at(x, y)
        near = np.flatnonzero(gaps <= within)
        for index in near[np.argsort(gaps[near])]:
            near_x, near_y = places[index].tolist()
            if room in (None, self.room_at(near_x, near_y)):
                is_there = gaps[index] <= self.grid.resolution
                return (x, y) if is_there else (near_x, near_y)
        return None

    def free_middles(self, clearance: float) -> Floats:
        """Return middles `(n, 2)` [m] of all cells that `sample_free` chooses from."""
        columns = self.grid.cells.shape[1]
        cells = self.kept((clearance, None), lambda: self._free_cells(clearance, None))
        return self.grid.to_xy(cells // columns + 0.5, cells % columns + 0.5)

    def _free_cells(self, clearance: float, room: str | None) -> NDArray[np.int64]:
        """Return the flat indices of the cells that `sample_free` chooses from."""
        grid = self.grid
        margin = min(clearance, FOOTPRINT)
        reached = self.kept(("reached", margin), lambda: grid.reachable(margin))
        free = reached & (grid.clearance >= clearance)
        if room is None:
            return np.flatnonzero(free)
        room_there = self.room(room)
        window = grid.window(room_there.polygon)
        inside = np.nonzero(free[window])
        rows, columns = (indices + part.start for indices, part in zip(inside, window, strict=True))
        middles = grid.to_xy(rows + 0.5, columns + 0.5)
        cells: NDArray[np.int64] = rows * grid.cells.shape[1] + columns
        return cells[shapely.contains_xy(self.ground_of(room_there), middles)]

    def ground_of(self, room: Room) -> Any:
        """Return the shapely area of a room; of ground outdoors what nothing else is drawn over."""
        area: Any = room.area
        if not room.outdoor:
            return area
        over = self.rooms[: self.rooms.index(room)]
        return area - shapely.union_all([other.area for other in over])


# A bare map does not say where on earth it is: the campus in Monte de Caparica.
DEFAULT_FRAME = GeoFrame(38.6612, -9.2058)
PLANS = (".geojson", ".json")
DESKS = 2  # operator desks on a bare map
BASE_SPACING = 1.5  # distance between places that are not drawn [m]
PASSED_BY = 0.5  # radius that must fit at places of a plan: mostly more than at doors [m]
MAX_DETECTORS = 2000  # maximum detectors of a kind on a bare map; larger floors have fewer per area
AT_RANDOM = 100  # random tries before all remaining cells are looked at
DETECTOR_SPACING = {"smoke": 8.0, "gas": 10.0, "water": 11.0}  # lattice on a bare map [m]


def map_site(
    path: str | Path, seed: int, robots: int, guards: int, radius: float = FOOTPRINT
) -> Site:
    """Return a bare ROS map as a site: bases and posts placed by `seed` on known, reachable floor.

    The walls are the border of the largest area that a robot can reach.

    Args:
        path: The map's YAML file.
        seed: Chooses the places; robot 1 stands at the same place however many there are.
        robots: Number of robot bases.
        guards: Number of guard posts.
        radius: Radius of the largest robot [m].

    Raises:
        ConfigError: the map is missing or not valid, or has no room for so many.
    """
    file = resources.find(str(path), "worlds").resolve()
    return _map_site(_bare_map(file), seed, robots, guards, max(radius, FOOTPRINT))


@lru_cache(maxsize=64)
def _map_site(bare: Site, seed: int, robots: int, guards: int, radius: float) -> Site:
    desks = _scatter(bare, Streams(seed), "operator-desk", DESKS, FOOTPRINT)
    return replace(_settled(bare, seed, robots, guards, radius), operator_desks=desks)


def with_places(site: Site, seed: int, robots: int, guards: int, radius: float = FOOTPRINT) -> Site:
    """Return a site with a base for each robot and a post for each guard, however few are drawn.

    Args:
        seed: Chooses the places that are not drawn; who stands where does not depend on how
            many more there are of the same kind.
        robots: Number of robots.
        guards: Number of guards.
        radius: Radius of the largest robot [m].

    Raises:
        ConfigError: not so many fit; the message tells how many do.
    """
    if robots <= len(site.robot_bases) and guards <= len(site.guard_posts):
        return site
    return _settled(site, seed, robots, guards, max(radius, PASSED_BY))


@lru_cache(maxsize=64)
def _settled(site: Site, seed: int, robots: int, guards: int, radius: float) -> Site:
    streams = Streams(seed)
    bases = site.robot_bases
    posts = site.guard_posts
    bases += _scatter(
        site=site,
        streams=streams,
        what="robot-base",
        count=robots,
        radius=radius,
        drawn=bases,
        others=posts,
    )
    person = min(radius, PASSED_BY)
    posts += _scatter(
        site=site,
        streams=streams,
        what="guard-post",
        count=guards,
        radius=person,
        drawn=posts,
        others=bases,
    )
    # The copy shares the grid and the cache of free cells: they depend on the plan alone.
    return replace(site, robot_bases=bases, guard_posts=posts)


@read_once(with_named_files)
def _bare_map(path: Path) -> Site:
    """Return all of a map's site that does not depend on the seed."""
    grid = load_ros_map(path)
    reached = grid.reachable(FOOTPRINT)
    if not reached.any():
        raise ConfigError(f"has no known-free floor that a robot of {FOOTPRINT:g} m fits on", path)
    try:
        walls = outline(grid, grid.floor(FOOTPRINT))
    except ConfigError as error:
        raise ConfigError(error.problem, path) from None
    xy = walls.reshape(-1, 2)
    return Site(
        name=path.stem,
        frame=DEFAULT_FRAME,
        walls=walls,
        detectors=_lattice(grid, reached),
        extent=(*map(float, xy.min(axis=0)), *map(float, xy.max(axis=0))),  # type: ignore[arg-type]
        grid=grid,
    )


def _scatter(
    site: Site,
    streams: Streams,
    what: str,
    count: int,
    radius: float,
    drawn: Sequence[Pose] = (),
    others: Sequence[Pose] = (),
) -> tuple[Pose, ...]:
    """Return the places that are missing from `count`, apart from all others, each by its stream.

    Raises:
        ConfigError: not so many fit.
    """
    apart = max(BASE_SPACING, 2.5 * radius)
    places = _Places(site, radius + 2 * site.grid.resolution, apart, (*drawn, *others))
    poses: list[Pose] = []
    for number in range(len(drawn) + 1, count + 1):
        rng = streams.fresh(f"site/{what}-{number}")
        place = places.draw(rng)
        if place is None:
            kind = what.partition("-")[0]
            fit = f"{number - 1} {kind}s of the scenario's {count}"
            raise ConfigError(f"site {site.name!r} has room for {fit}")
        poses.append(Pose(*place, float(rng.uniform(-np.pi, np.pi))))
    return tuple(poses)


class _Places:
    """Free places apart from each other, until none is left.

    Args:
        clearance: Radius that must fit at each [m].
        apart: The least distance between two [m].
        taken: Places that are taken already.
    """

    def __init__(self, site: Site, clearance: float, apart: float, taken: Iterable[Pose]) -> None:
        self._site = site
        self._clearance = clearance
        self._apart = apart
        self._taken = np.array([(pose.x, pose.y) for pose in taken]).reshape(-1, 2)
        self._left: Floats | None = None  # middles `(n, 2)` of free cells, once they are few

    def draw(self, rng: np.random.Generator) -> tuple[float, float] | None:
        """Take one more place [m] and return it; None if none is left."""
        place = self._at_random(rng) if self._left is None else None
        if place is None:
            place = self._of_those_left(rng)
        if place is not None:
            self._taken = np.vstack([self._taken, place])
            if self._left is not None:
                self._left = self._left[self._are_free(self._left, place)]
        return place

    def _at_random(self, rng: np.random.Generator) -> tuple[float, float] | None:
        for _ in range(AT_RANDOM):
            place = self._site.sample_free(rng, self._clearance)
            if self._are_free(self._taken, place).all():
                return place
        return None

    def _of_those_left(self, rng: np.random.Generator) -> tuple[float, float] | None:
        if self._left is None:
            self._left = self._site.free_middles(self._clearance)
            for place in self._taken.tolist():
                self._left = self._left[self._are_free(self._left, place)]
        if not len(self._left):
            return None
        x, y = self._left[rng.integers(len(self._left))].tolist()
        return x, y

    def _are_free(self, points: Floats, place: Sequence[float]) -> NDArray[np.bool_]:
        """Return which points `(n, 2)` are far enough from a place [m]."""
        free: NDArray[np.bool_] = np.hypot(*(points - place).T) >= self._apart
        return free


def _lattice(grid: OccupancyGrid, reached: NDArray[np.bool_]) -> tuple[Detector, ...]:
    """Return detectors on square lattices of cells that can be reached."""
    detectors = []
    sparse = math.ceil(math.sqrt(np.count_nonzero(reached) / MAX_DETECTORS))
    for kind, spacing in DETECTOR_SPACING.items():
        step = max(1, round(spacing / grid.resolution), sparse)
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
    level: float | str | None = None
    generate: OfficeBlock | None = None
    resolution_m: Annotated[float, Field(gt=0.005, le=0.5)] = 0.05
    ceiling_m: Annotated[float, Field(ge=1.5, le=50)] = CEILING

    @model_validator(mode="after")
    def _one_plan(self) -> SiteFile:
        if (self.plan is None) == (self.generate is None):
            raise ValueError("should have a plan (a GeoJSON file) or generate, and not both")
        if self.level is not None and self.plan is None:
            raise ValueError("a level is a storey of a plan, and generate makes one storey")
        return self


def load_site(name_or_path: str | Path, options: Mapping[str, Any] | None = None) -> Site:
    """Read a site in our own format, by name or path.

    Args:
        name_or_path: Such as `caparica`.
        options: Replace keys of `generate`, such as the seed, where a site is generated.

    Raises:
        ConfigError: not found, unknown key or kind, a base inside a wall.
    """
    path = resources.find(str(name_or_path), "worlds").resolve()
    return _load_site(path, json.dumps(dict(options or {}), sort_keys=True))


@read_once(with_named_files, most=16)
def _load_site(path: Path, options: str) -> Site:
    if path.suffix in PLANS:
        raise ConfigError(f"is a plan; {_site_of_plan(path)}", path)
    document = load_yaml(path)
    if "image" in document.data and "plan" not in document.data:
        problem = "is a bare ROS map; give it as site.map, not as site.name"
        raise document.error(problem, ("image",))
    config = validate(SiteFile, document.data, document.error)
    frame = GeoFrame(config.origin.latitude, config.origin.longitude)
    features = _features(config, document, frame, json.loads(options))
    plan, floor = make_plan(features, config.ceiling_m)
    _check_size(floor, config, document)
    site = Site(
        **vars(plan),
        name=config.name,
        frame=frame,
        extent=floor.bounds,
        grid=rasterise(floor, plan.walls, config.resolution_m),
        ceiling=config.ceiling_m,
    )
    for feature in features:
        radius = {"robot_base": FOOTPRINT, "guard_post": STANDING}.get(feature.kind, 0.0)
        if radius and not site.is_free(feature.shape.x, feature.shape.y, radius):
            text = f"{feature.kind} needs {radius:g} m of free floor around it: it is in a wall"
            raise feature.fail(text)
    return site


def doubts_of_site(document: Document) -> list[str]:
    """List the ignored parts of a valid site's plan, in sentences without full stop."""
    plan = document.data.get("plan")
    return [] if plan is None else doubts_of_plan(document.file.parent / plan)


def _site_of_plan(path: Path) -> str:
    """Name the site that has a plan, or explain how one is written."""
    for file in sorted(path.parent.glob("*.yaml")):
        with suppress(ConfigError):
            if load_yaml(file).data.get("plan") == path.name:
                return f"give its site: {file}"
    return f"give a site: a YAML file with name, origin and 'plan: {path.name}'"


def _check_size(floor: Any, config: SiteFile, document: Document) -> None:
    """Refuse a plan whose grid would take gigabytes."""
    xmin, ymin, xmax, ymax = floor.bounds
    width = xmax - xmin
    depth = ymax - ymin
    cell = config.resolution_m
    cells = width * depth / cell**2
    if cells > MAX_CELLS:
        raise document.error(
            f"the plan is {width:,.0f} by {depth:,.0f} m: {cells / 1e6:,.0f} million cells of "
            f"{cell:g} m, at most {MAX_CELLS / 1e6:g} million; draw less or give larger cells",
            ("resolution_m",),
        )


def _features(
    config: SiteFile, document: Document, frame: GeoFrame, options: Mapping[str, Any]
) -> tuple[Feature, ...]:
    if config.generate is not None:
        return office_block(_with_options(config.name, config.generate, options))
    if options:
        names = ", ".join(options)
        raise ConfigError(f"site {config.name!r} is drawn and takes no options; given: {names}")
    file = document.file.parent / str(config.plan)
    if not resources.is_file(file):
        raise document.error(f"plan {config.plan!r} not found", ("plan",))
    level = None if config.level is None else label_of(config.level)
    return tuple(read_features(file, frame, level))


def _with_options(name: str, block: OfficeBlock, options: Mapping[str, Any]) -> OfficeBlock:
    keys = [key for key in type(block).model_fields if key != "kind"]
    for key in options:
        if key not in keys:
            raise ConfigError(f"site {name!r} has no option {key!r}; {hint(key, keys)}")
    data = block.model_dump() | dict(options)
    return validate(OfficeBlock, data, lambda text, _: ConfigError(f"site {name!r}: {text}"))
