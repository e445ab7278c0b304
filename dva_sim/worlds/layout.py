"""A place where robots and people work: what is where on it, and what is free."""

from __future__ import annotations

import itertools
from collections import Counter
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.suggestions import hint
from dva_sim.worlds.compartments import NOWHERE, FloorPartition, of_floor, of_rooms
from dva_sim.worlds.geo import GeoFrame, Pose
from dva_sim.worlds.maps import FREE, OccupancyGrid
from dva_sim.worlds.site_parts import (
    CEILING,
    DOOR_HEIGHT,
    BaseStation,
    Compartment,
    Detector,
    Exit,
    FixedCamera,
    Lookup,
    Opening,
    RadioCoverage,
    Room,
    Zone,
)

Floats = NDArray[np.float64]

FOOTPRINT = 0.30  # radius that must fit at a robot base [m]
STANDING = 0.20  # radius that must fit where a person stands [m]


@dataclass(frozen=True, eq=False)
class Site:
    """A place where robots and people work.

    Attributes:
        name: Name of the site or of the map.
        frame: Where on earth its plane lies.
        walls: Segments x1, y1, x2, y2, shape `(n, 4)` [m].
        rooms: Named parts of the floor and of the ground outdoors; none on a bare map.
        doors: Openings in the walls, shape `(n, 4)` [m]; exits are not among them.
        robot_bases: Where robots start.
        guard_posts: Where guards wait.
        operator_desks: Where operators sit.
        detectors: Smoke, heat, CO, gas and water detectors.
        extent: xmin, ymin, xmax, ymax of everything [m].
        grid: What is free, occupied and unknown.
        solids: Corners `(k, 2)` [m] of filled obstacles such as shelves.
        door_heights: Of each door [m]; 2.1 m where nothing is said.
        exits: Ways to safety.
        zones: Parts of the floor with a rule or a purpose.
        cameras: Fixed cameras.
        base_stations: Antennas.
        wifi: Where the radio link has a quality of its own.
        ceiling: Of rooms that do not say [m].
    """

    name: str
    frame: GeoFrame
    walls: Floats
    rooms: tuple[Room, ...]
    doors: Floats
    robot_bases: tuple[Pose, ...]
    guard_posts: tuple[Pose, ...]
    operator_desks: tuple[Pose, ...]
    detectors: tuple[Detector, ...]
    extent: tuple[float, float, float, float]
    grid: OccupancyGrid
    solids: tuple[Floats, ...] = ()
    door_heights: tuple[float, ...] = ()
    exits: tuple[Exit, ...] = ()
    zones: tuple[Zone, ...] = ()
    cameras: tuple[FixedCamera, ...] = ()
    base_stations: tuple[BaseStation, ...] = ()
    wifi: tuple[RadioCoverage, ...] = ()
    ceiling: float = CEILING
    _cache: dict[object, NDArray[np.int64]] = field(default_factory=dict, repr=False)

    def room_at(self, x: float, y: float) -> str | None:
        """Name of the room around a point [m], or None outside all rooms."""
        room = self._rooms.at(x, y)
        return None if room is None else room.name

    def link_quality(self, x: float, y: float) -> RadioCoverage | None:
        """The coverage drawn around a point [m], the later over the earlier; None for none."""
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
        sides = Counter(_side(a, b) for solid in self.solids for a, b in itertools.pairwise(solid))
        walls = [_side(wall[:2], wall[2:]) for wall in self.walls]
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
        row, column = self.grid.to_cell(x, y)
        labels = self.partition.labels
        inside = 0 <= row < labels.shape[0] and 0 <= column < labels.shape[1]
        label = int(labels[row, column]) if inside else NOWHERE
        return None if label == NOWHERE else label

    @cached_property
    def partition(self) -> FloorPartition:
        """Compartments, openings, and whose each cell of the grid is."""
        if not self.rooms:
            return _blocks(self.grid)
        heights = self.door_heights or (DOOR_HEIGHT,) * len(self.doors)
        doors = zip(self.doors.tolist(), heights, strict=True)
        ways = [
            *((ends, height, "door") for ends, height in doors),
            *((way.ends, DOOR_HEIGHT, "exit") for way in self.exits),
        ]
        return of_rooms(self.grid, self.rooms, self.walls, ways)

    # --- places ------------------------------------------------------------------------

    def room(self, name: str) -> Room:
        """The room of that name.

        Raises:
            ConfigError: there is none; the message lists the rooms.
        """
        for room in self.rooms:
            if room.name == name:
                return room
        known = [room.name for room in self.rooms]
        told = hint(name, known, "rooms") if known else "a bare map names no rooms"
        raise ConfigError(f"site {self.name!r} has no room {name!r}; {told}")

    def is_free(self, x: float, y: float, clearance: float) -> bool:
        """Whether a disc of radius `clearance` [m] fits at a point [m], to within a cell."""
        return self.grid.state_at(x, y) == FREE and self.grid.clearance_at(x, y) >= clearance

    def sample_free(
        self,
        rng: np.random.Generator,
        clearance: float,
        room: str | None = None,
        near: tuple[float, float] | None = None,
        within: float = 2.0,
    ) -> tuple[float, float]:
        """A random free point that a robot can reach, or somebody slimmer if so asked.

        Args:
            rng: Source of luck.
            clearance: Radius that must fit at the point [m]; on the way there no more than a
                robot's has to, or doors would part the site.
            room: Only inside this room.
            near: Only around this point [m] ...
            within: ... nearer than this [m].

        Raises:
            ConfigError: no such room, or no free point there.
        """
        cells = self._free_cells(clearance, room)
        columns = self.grid.cells.shape[1]
        if near is not None and len(cells):
            middles = self.grid.to_xy(cells // columns + 0.5, cells % columns + 0.5)
            cells = cells[np.hypot(*(middles - near).T) < within]
        if not len(cells):
            where = f"room {room!r} of site {self.name!r}" if room else f"site {self.name!r}"
            near_text = f" within {within:g} m of {near}" if near else ""
            raise ConfigError(f"{where} has no free place of {clearance:g} m radius{near_text}")
        cell = int(cells[rng.integers(len(cells))])
        jitter = rng.random(2)
        x, y = self.grid.to_xy(cell // columns + jitter[0], cell % columns + jitter[1]).tolist()
        return x, y

    def _free_cells(self, clearance: float, room: str | None) -> NDArray[np.int64]:
        """Flat indices of the cells that `sample_free` chooses from, kept for the next time."""
        key = clearance, room
        if key not in self._cache:
            reached = self.grid.reachable(min(clearance, FOOTPRINT))
            cells = np.flatnonzero(reached & (self.grid.clearance >= clearance))
            if room is not None:
                import shapely

                columns = self.grid.cells.shape[1]
                middles = self.grid.to_xy(cells // columns + 0.5, cells % columns + 0.5)
                area: Any = shapely.Polygon(self.room(room).polygon)
                if self.room(room).outdoor:  # others may be drawn over it
                    number = self.rooms.index(self.room(room))
                    over = [shapely.Polygon(other.polygon) for other in self.rooms[:number]]
                    area = area - shapely.union_all(over)
                cells = cells[shapely.contains_xy(area, middles)]
            self._cache[key] = cells
        return self._cache[key]


def _side(a: Floats, b: Floats) -> frozenset[tuple[float, ...]]:
    """A segment in either direction, to the millimetre."""
    return frozenset(tuple(np.round(end, 3).tolist()) for end in (a, b))


@lru_cache(maxsize=4)
def _blocks(grid: OccupancyGrid) -> FloorPartition:
    """Sites of one bare map differ in their bases only."""
    return of_floor(grid, grid.floor(FOOTPRINT))
