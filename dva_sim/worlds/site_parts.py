"""Parts of a site: rooms, detectors, exits, zones, cameras, radio and its coverage."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from dva_sim.worlds.geo import Pose

Points = NDArray[np.float64]
CEILING = 3.0  # default height of a room [m]
SQUARE = 4.0  # side of the squares by which nearby areas are indexed [m]
DOOR_HEIGHT = 2.1  # default height of a door [m]


@dataclass(frozen=True, eq=False)
class NamedArea:
    """A named part of the plane.

    Attributes:
        name: Its name.
        polygon: Corners `(k, 2)` of its outline [m].
        holes: Corners `(k, 2)` of each hole in it [m].
    """

    name: str
    polygon: Points
    holes: tuple[Points, ...] = field(default=(), kw_only=True)

    def contains(self, x: float, y: float) -> bool:
        """Return True if a point [m] lies inside: a ray from it crosses the border an odd time."""
        odd = False
        for corners in self._rings:
            px, py = corners[-1]
            for qx, qy in corners:
                if (py > y) != (qy > y) and px + (y - py) * (qx - px) / (qy - py) > x:
                    odd = not odd
                px = qx
                py = qy
        return odd

    @cached_property
    def _rings(self) -> list[list[tuple[float, float]]]:
        return [[(float(x), float(y)) for x, y in ring] for ring in (self.polygon, *self.holes)]

    @cached_property
    def area(self) -> Any:
        """The polygon as a shapely geometry."""
        import shapely  # late: start-up

        return shapely.Polygon(self.polygon, self.holes)

    @cached_property
    def box(self) -> tuple[float, float, float, float]:
        """xmin, ymin, xmax, ymax [m]."""
        xmin, ymin = self.polygon.min(axis=0)
        xmax, ymax = self.polygon.max(axis=0)
        return float(xmin), float(ymin), float(xmax), float(ymax)


T = TypeVar("T", bound=NamedArea)


class Lookup(Generic[T]):
    """Areas by point; where some overlap, the first counts.

    Args:
        areas: In order of precedence.
    """

    def __init__(self, areas: Sequence[T]) -> None:
        self._boxes = np.array([area.box for area in areas]).reshape(-1, 4)
        self._areas = areas
        self._near: dict[tuple[int, int], list[T]] = {}

    def at(self, x: float, y: float) -> T | None:
        """Return the area around a point [m], or None outside all."""
        square = math.floor(x / SQUARE), math.floor(y / SQUARE)
        near = self._near.get(square)
        if near is None:
            near = self._areas_near(*square)
            if near:  # else it may be any place on earth
                self._near[square] = near
        return next((area for area in near if area.contains(x, y)), None)

    def _areas_near(self, column: int, row: int) -> list[T]:
        """Return the areas whose box touches a square of a lattice."""
        low = np.array([column, row]) * SQUARE
        high = np.array([column + 1, row + 1]) * SQUARE
        touch = np.all((self._boxes[:, :2] <= high) & (self._boxes[:, 2:] >= low), axis=1)
        return [self._areas[index] for index in np.flatnonzero(touch).tolist()]


@dataclass(frozen=True, eq=False)
class Room(NamedArea):
    """A named part of the floor, or of the ground outdoors.

    Attributes:
        ceiling: Height [m]; without meaning outdoors.
        outdoor: A path or a yard.
        paved: Outdoors: a path; else grass.
    """

    ceiling: float = CEILING
    outdoor: bool = False
    paved: bool = True


PROBES = (0.06, 0.2, 0.35, 0.5)  # distances from a door at which areas beside it are looked up [m]


def beyond(rooms: Lookup[Room], x: float, y: float, heading: float) -> Room | None:
    """Find the room on one side of a door, given its middle [m] and the direction [rad]."""
    cos = math.cos(heading)
    sin = math.sin(heading)
    beyond_door = (rooms.at(x + far * cos, y + far * sin) for far in PROBES)
    return next((room for room in beyond_door if room is not None), None)


@dataclass(frozen=True, eq=False)
class Zone(NamedArea):
    """A part of the floor with a rule or a purpose: `use` is restricted, charging or assembly."""

    use: str = "restricted"


class LinkQuality(NamedTuple):
    """Quality of a radio link at a place, in addition to the link's own.

    Attributes:
        loss: Probability that a packet is lost, each way.
        rate_bps: Upper bound of the rate [bit/s].
        extra_delay_s: One-way delay added [s].
    """

    loss: float
    rate_bps: float
    extra_delay_s: float

    def is_as_bad_as(self, other: LinkQuality) -> bool:
        """Return True if any of its three numbers is at least as bad; `none` loses everything."""
        lossy = 0 < other.loss <= self.loss
        return (
            lossy
            or self.rate_bps <= other.rate_bps
            or 0 < other.extra_delay_s <= self.extra_delay_s
        )


# Assumed, in the order in which a link fades; nobody measured them on these sites.
QUALITIES = {
    "good": LinkQuality(0.0, 20e6, 0.0),
    "fair": LinkQuality(0.02, 5e6, 0.010),
    "poor": LinkQuality(0.10, 1e6, 0.050),
    "none": LinkQuality(1.0, 1e3, 0.0),
}


@dataclass(frozen=True, eq=False)
class RadioCoverage(NamedArea):
    """Area in which the radio link has a quality of its own."""

    quality: LinkQuality = QUALITIES["good"]

    @property
    def grade(self) -> str:
        """The name of the worst quality that it is at least as bad as; good if of none."""
        worse = (n for n in reversed(QUALITIES) if self.quality.is_as_bad_as(QUALITIES[n]))
        return next(worse, "good")


@dataclass(frozen=True)
class Detector:
    """A fixed detector: `kind` is smoke, heat, co, gas or water; position [m]."""

    name: str
    kind: str
    x: float
    y: float


class Exit(NamedTuple):
    """A way to safety: its middle [m], the heading outwards [rad], its width [m]."""

    x: float
    y: float
    heading: float
    width: float
    name: str

    @property
    def ends(self) -> tuple[float, float, float, float]:
        """From jamb to jamb: x1, y1, x2, y2 [m], out lying to the left."""
        dx = self.width / 2 * math.sin(self.heading)
        dy = -self.width / 2 * math.cos(self.heading)
        return self.x - dx, self.y - dy, self.x + dx, self.y + dy


class FixedCamera(NamedTuple):
    """A camera on a wall or a mast; angles [rad], how far it shows people [m]."""

    x: float
    y: float
    heading: float
    field_of_view: float
    range: float
    name: str


class BaseStation(NamedTuple):
    """An antenna: its kind of network (wifi, lte, nr) and position [m]."""

    x: float
    y: float
    radio: str
    name: str


@dataclass(frozen=True, eq=False, kw_only=True)
class FloorPlan:
    """Layout of a site.

    Attributes:
        walls: Segments x1, y1, x2, y2, opened at the doors, shape `(n, 4)` [m].
        rooms: Named parts of the floor and of the ground outdoors; none on a bare map.
        doors: Openings in the walls, shape `(n, 4)` [m]; exits are not among them.
        robot_bases: Starting poses of robots.
        guard_posts: Waiting poses of guards.
        operator_desks: Seats of operators.
        detectors: Smoke, heat, CO, gas and water detectors.
        solids: Corners `(k, 2)` [m] of filled obstacles such as shelves.
        door_heights: Height of each door [m]; 2.1 m by default.
        exits: Ways to safety.
        zones: Parts of the floor with a rule or a purpose.
        cameras: Fixed cameras.
        base_stations: Antennas.
        wifi: Areas with a radio quality of their own.
    """

    walls: Points
    rooms: tuple[Room, ...] = ()
    doors: Points = field(default_factory=lambda: np.empty((0, 4)))
    robot_bases: tuple[Pose, ...] = ()
    guard_posts: tuple[Pose, ...] = ()
    operator_desks: tuple[Pose, ...] = ()
    detectors: tuple[Detector, ...] = ()
    solids: tuple[Points, ...] = ()
    door_heights: tuple[float, ...] = ()
    exits: tuple[Exit, ...] = ()
    zones: tuple[Zone, ...] = ()
    cameras: tuple[FixedCamera, ...] = ()
    base_stations: tuple[BaseStation, ...] = ()
    wifi: tuple[RadioCoverage, ...] = ()


@dataclass(frozen=True, eq=False)
class Compartment:
    """A body of air: what fills with smoke, gas or water by itself.

    Attributes:
        name: Name of its room; on a bare map the number of a block of the floor.
        area: Area of its floor, solids included [m^2].
        ceiling: Height [m].
        polygon: Corners `(k, 2)` [m], or None where only its cells are known (bare maps).
    """

    name: str
    area: float
    ceiling: float
    polygon: Points | None


class Opening(NamedTuple):
    """Opening through which air, water and people pass between two compartments.

    Attributes:
        room_a: Name of a compartment.
        room_b: Name of the other one; None for outdoors.
        x1: One end [m].
        y1: One end [m].
        x2: The other end [m].
        y2: The other end [m].
        width: From end to end [m].
        height: From the floor [m].
        kind: door, exit, or border: no wall between the two.
    """

    room_a: str
    room_b: str | None
    x1: float
    y1: float
    x2: float
    y2: float
    width: float
    height: float
    kind: str
