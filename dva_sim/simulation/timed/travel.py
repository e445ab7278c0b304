"""Travel in a shift: between places without a map, on a plane, or planned on a site.

On a site there are a few places in each room. Paths between fixed places are planned once per
process. From a point under way, where planning would cost more than the rest of the run, the path
leads straight to a visible goal, door or opening, and on from there.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Literal, Protocol

import numpy as np
from typing_extensions import override

from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.streams import Streams
from dva_sim.kernel.suggestions import unknown
from dva_sim.protocol import messages as m
from dva_sim.simulation.timed.distributions import Floats, Law
from dva_sim.simulation.timed.scenario import Point, TimedScenario
from dva_sim.worlds.geo import GeoFrame, Pose
from dva_sim.worlds.hazards import KINDS, first_detection, make_hazard
from dva_sim.worlds.planning import Planner
from dva_sim.worlds.site import DEFAULT_FRAME, FOOTPRINT, Site, load_site


class Occurrence(Protocol):
    """Something that happens at a place, as far as paths to it are its own."""

    stream: int
    index: int


PLACE_STEP_DEG = 1e-10  # offset between events at one place, which makes positions unique [deg]
EVENT_STEP_DEG = 1e-5  # offset where places do not matter, so that no two events are merged [deg]
NUMBERED = 4096  # positions at one place before they repeat


class Place:
    """A place: x, y [m], its form in messages, and its zone (-1: none).

    Attributes:
        fixed: The place that is there in every run, if there is one: ways to it are kept.
        about: The incident that happens here, if one does.
    """

    __slots__ = ("about", "fixed", "position", "x", "y", "zone")

    def __init__(
        self, x: float, y: float, position: m.Position, zone: int = -1, fixed: Place | None = None
    ) -> None:
        self.x = x
        self.y = y
        self.position = position
        self.zone = zone
        self.fixed = fixed
        self.about: Occurrence | None = None

    @property
    def point(self) -> Point:
        """x, y [m]."""
        return self.x, self.y


class Terrain:
    """Terrain without distances: everything is in one place.

    Attributes:
        zones: Names of the zones.
        frame: Location on earth.
        placed: True if events have random places.
    """

    placed = False

    def __init__(
        self, zones: Sequence[str], frame: GeoFrame = DEFAULT_FRAME, apart: float = EVENT_STEP_DEG
    ) -> None:
        self.zones = list(zones)
        self.frame = frame
        self._apart = apart
        self._known: dict[m.Position, Place] = {}
        self._points: dict[Point, Place] = {}
        self._numbered = 0

    # --- places ------------------------------------------------------------------------

    def place(self, x: float, y: float, zone: int = -1) -> Place:
        """Return a place at a point [m]."""
        return Place(x, y, m.Position(*self.frame.to_latlon(x, y)), zone)

    def fix(self, x: float, y: float, zone: int = -1) -> Place:
        """Return a place that stays, such as a base."""
        place = self.place(x, y, zone)
        place.fixed = place
        self._known[place.position] = place
        return place

    def remember(self, place: Place) -> Place:
        """Keep a place under its position until it is forgotten; fixed ones are always kept."""
        return self._known.setdefault(place.position, place)

    def forget(self, place: Place) -> None:
        """Forget a place that is no longer used."""
        if self._known.get(place.position) is place and place.fixed is not place:
            del self._known[place.position]

    def known_at(self, position: m.Position) -> Place:
        """Return the place at the position in a message."""
        place = self._known.get(position)
        if place is None:
            x, y = self.frame.to_xy(position.latitude, position.longitude)
            place = Place(x, y, position)
        return place

    def event_place(self, zone: int, u: float, v: float) -> Place:
        """Return the place of an event by two uniform random numbers, at a position of its own."""
        return self.apart(self._middle(zone))

    def exact_place(self, x: float, y: float, zone: str | None) -> Place:
        """Return the place of an event at a point [m], at a position of its own."""
        number = -1 if zone is None else self.zones.index(zone)
        return self.apart(self._known_at_point(x, y, number))

    def _known_at_point(self, x: float, y: float, zone: int) -> Place:
        """Return a place that stays, so that ways to it are planned once."""
        place = self._points.get((x, y))
        if place is None:
            place = self._points[x, y] = self.fix(x, y, zone)
        return place

    def apart(self, place: Place) -> Place:
        """Return a copy of the place under a unique position."""
        self._numbered = self._numbered % NUMBERED + 1
        at = place.position
        position = m.Position(at.latitude + self._apart * self._numbered, at.longitude)
        return Place(place.x, place.y, position, place.zone, place.fixed)

    def named(self, name: str, number: int) -> Place:
        """Return a base or station by name; the `number`-th that asks gets the `number`-th post.

        Raises:
            ConfigError: there is no such place.
        """
        if name in self.zones:
            return self.centre(self.zones.index(name))
        raise ConfigError(unknown("place", name, self.zones, "zones"))

    def centre(self, zone: int) -> Place:
        """Return a place that stands for a zone."""
        return self._middle(zone)

    def anywhere(self, rng: np.random.Generator) -> Place:
        """Return a random place."""
        return self._middle(0)

    def default_base(self, kind: str) -> str | None:
        """Return where responders of a kind wait by default."""
        return None

    def spots(self, zone: int) -> list[Place]:
        """Return places that represent a zone: a place far from them is far from the zone."""
        return [self.centre(zone)]

    def origin(self) -> Place:
        """Return where responders wait by default."""
        return self._middle(0)

    def _between(self, a: Place, b: Place, share: float) -> Place:
        return self.place(a.x + share * (b.x - a.x), a.y + share * (b.y - a.y))

    def _middle(self, zone: int) -> Place:
        place = self._known.get(_ORIGIN)
        if place is None:
            place = Place(0.0, 0.0, _ORIGIN, 0)
            place.fixed = place
            self._known[_ORIGIN] = place
        return place

    def size(self, zone: int) -> float:
        """Return the weight of a zone among others where events may happen anywhere."""
        return 1.0

    # --- ways --------------------------------------------------------------------------

    def length(self, a: Place, b: Place) -> float:
        """Return the length of the way [m]; infinite if there is none."""
        return 0.0

    def along(self, a: Place, b: Place, gone: float) -> Place:
        """Return the place at a distance along the path from `a` to `b` [m]."""
        return b


_ORIGIN = m.Position(DEFAULT_FRAME.latitude, DEFAULT_FRAME.longitude)


class Plane(Terrain):
    """A rectangle on which everybody walks straight.

    Args:
        width: [m]
        height: [m]
        zones: Rectangles xmin, ymin, xmax, ymax [m] by name.
        straight: True if travel takes time.
    """

    placed = True

    def __init__(
        self,
        width: float,
        height: float,
        zones: dict[str, tuple[float, float, float, float]],
        straight: bool = True,
    ) -> None:
        super().__init__(list(zones) or ["area"], apart=PLACE_STEP_DEG)
        self._boxes = list(zones.values()) or [(0.0, 0.0, width, height)]
        self._whole = (0.0, 0.0, width, height)
        self._straight = straight
        self._centres: dict[int, Place] = {}

    @override
    def event_place(self, zone: int, u: float, v: float) -> Place:
        left, low, right, high = self._boxes[zone] if zone >= 0 else self._whole
        x = left + u * (right - left)
        y = low + v * (high - low)
        place = self.place(x, y, zone if zone >= 0 else self._zone_at(x, y))
        return self.apart(place) if left == right and low == high else place

    def _zone_at(self, x: float, y: float) -> int:
        for zone, (left, low, right, high) in enumerate(self._boxes):
            if left <= x <= right and low <= y <= high:
                return zone
        return -1

    @override
    def centre(self, zone: int) -> Place:
        if zone not in self._centres:
            left, low, right, high = self._boxes[zone]
            self._centres[zone] = self.fix(0.5 * (left + right), 0.5 * (low + high), zone)
        return self._centres[zone]

    @override
    def anywhere(self, rng: np.random.Generator) -> Place:
        u, v = rng.random(2).tolist()
        return self.fix(u * self._whole[2], v * self._whole[3])

    @override
    def origin(self) -> Place:
        # The middle of the area.
        return self.fix(0.5 * self._whole[2], 0.5 * self._whole[3])

    @override
    def size(self, zone: int) -> float:
        # Its area, unless events may happen outside all zones, too.
        left, low, right, high = self._boxes[zone]
        return (right - left) * (high - low)

    @override
    def length(self, a: Place, b: Place) -> float:
        return math.hypot(a.x - b.x, a.y - b.y) if self._straight else 0.0

    @override
    def along(self, a: Place, b: Place, gone: float) -> Place:
        whole = self.length(a, b)
        if gone >= whole:
            return b
        if gone <= 0.0:
            return a
        return self._between(a, b, gone / whole)


def terrain_of(scenario: TimedScenario) -> Terrain:
    """Return the ground that a scenario plays on.

    Raises:
        ConfigError: a site that cannot be read.
    """
    if scenario.site is not None:
        return Rooms(scenario.site.name, scenario.site.spots, scenario.way)
    if scenario.area is not None:
        straight = scenario.way == "straight"
        return Plane(scenario.area.width_m, scenario.area.height_m, scenario.zones, straight)
    return Terrain(["here"])


CLEARANCE = 0.4  # radius that must fit where an event happens [m]
MAX_PATHS = 5000  # maximum paths kept at a time
FOUND = 3600.0  # time after which people notice what no detector does [s]; assumed
WALL = 0.05  # thickness of a wall [m]
PASSAGE = 0.6  # least width to pass [m]


class _Ways:
    """Lengths of ways on a site, kept for the next run in this process."""

    def __init__(self, site: Site) -> None:
        self.planner = Planner(site, FOOTPRINT)
        self._lengths: dict[tuple[Point, Point], float] = {}
        self._paths: dict[tuple[Point, Point], Floats | None] = {}

    def length(self, a: Point, b: Point) -> float:
        """Return the way, which is as long there as back [m]."""
        pair = (a, b) if a <= b else (b, a)
        length = self._lengths.get(pair)
        if length is None:
            length = self._lengths[pair] = self.planner.distance(*pair) if a != b else 0.0
        return length

    def path(self, a: Point, b: Point) -> Floats | None:
        """Return the path, cached as positions along it are queried repeatedly."""
        if (a, b) not in self._paths:
            if len(self._paths) >= MAX_PATHS:
                self._paths.clear()
            self._paths[a, b] = self.planner.path(a, b)
        return self._paths[a, b]


@lru_cache(maxsize=8)
def _ways_of(site: Site) -> _Ways:
    return _Ways(site)


@lru_cache(maxsize=8)
def _spots_of(site: Site, count: int) -> tuple[tuple[Point, ...], ...]:
    """Return the same places in every run: they belong to the site."""
    streams = Streams(0)
    return tuple(
        tuple(site.sample_free(rng, CLEARANCE, room.name) for _ in range(count))
        for room in site.rooms
        for rng in [streams.fresh(f"spots/{room.name}")]
    )


@lru_cache(maxsize=8)
def _passages_of(site: Site) -> tuple[Point, ...]:
    """Return middles of doors, and of where two rooms are open to each other."""
    import shapely

    walls = shapely.MultiLineString(site.walls.reshape(-1, 2, 2).tolist()).buffer(WALL)
    doors = [((a + c) / 2, (b + d) / 2) for a, b, c, d in site.doors.tolist()]
    borders = [room.area.boundary for room in site.rooms]
    for number, border in enumerate(borders):
        for other in borders[:number]:
            opening = shapely.line_merge(border.intersection(other.buffer(WALL)).difference(walls))
            for part in shapely.get_parts(opening):
                middle = part.interpolate(0.5, normalized=True)
                near = any(math.dist((middle.x, middle.y), door) < PASSAGE for door in doors)
                if part.length >= PASSAGE and not near:
                    doors.append((middle.x, middle.y))
    return tuple(doors)


@lru_cache(maxsize=4096)
def _detected_after(site: Site, kind: str, point: Point) -> float:
    """Return the time to the first detection [s]; cached, as events recur at a few spots."""
    return min(FOUND, first_detection(make_hazard(kind, point, 0.0), site)[1])


class Rooms(Terrain):
    """Terrain of a site's rooms.

    Args:
        name: Name or path.
        spots: Places in each room.
        travel: Kind of distance: none, straight or along paths.

    Raises:
        ConfigError: the site cannot be read, or has no rooms.
    """

    placed = True

    def __init__(
        self, name: str, spots: int, travel: Literal["none", "straight", "path"] | Law
    ) -> None:
        self.site = load_site(name)
        if not self.site.rooms:
            raise ConfigError(f"site {name!r} has no rooms: events need them")
        super().__init__([room.name for room in self.site.rooms], self.site.frame, PLACE_STEP_DEG)
        self._ways = _ways_of(self.site)
        self._way = travel
        self._spots = [
            [self.fix(x, y, zone) for x, y in points]
            for zone, points in enumerate(_spots_of(self.site, spots))
        ]
        self._passages = _passages_of(self.site)

    # --- places ------------------------------------------------------------------------

    @override
    def event_place(self, zone: int, u: float, v: float) -> Place:
        if zone < 0:
            zone = int(u * len(self._spots))
            u = u * len(self._spots) % 1.0
        spots = self._spots[zone]
        return self.apart(spots[int(u * len(spots))])

    @override
    def named(self, name: str, number: int) -> Place:
        what, _, count = name.partition("-")
        if name in self.zones or what not in ("post", "robot_base"):
            return super().named(name, number)
        poses = self.site.guard_posts if what == "post" else self.site.robot_bases
        if not poses or int(count or 1) > len(poses):
            problem = f"no {name!r}: there are {len(poses)}"
            raise ConfigError(f"site {self.site.name!r} has {problem}")
        return self._base(poses[((int(count) if count else number) - 1) % len(poses)])

    def _base(self, pose: Pose) -> Place:
        room = self.site.room_at(pose.x, pose.y)
        return self.fix(pose.x, pose.y, self.zones.index(room) if room else -1)

    @override
    def centre(self, zone: int) -> Place:
        # The first of its places.
        return self._spots[zone][0]

    @override
    def spots(self, zone: int) -> list[Place]:
        return self._spots[zone]

    @override
    def anywhere(self, rng: np.random.Generator) -> Place:
        x, y = self.site.sample_free(rng, CLEARANCE)
        return self.fix(x, y)

    @override
    def default_base(self, kind: str) -> str | None:
        return "post" if kind == "guard" else "robot_base"

    # --- ways --------------------------------------------------------------------------

    @override
    def length(self, a: Place, b: Place) -> float:
        if self._way == "straight":
            return math.hypot(a.x - b.x, a.y - b.y)
        if self._way != "path":
            return 0.0
        if a.fixed is not None and b.fixed is not None:
            return self._ways.length(a.fixed.point, b.fixed.point)
        if b.fixed is None:
            a, b = b, a
        planner = self._ways.planner
        sees = self._ways.planner.line_of_sight
        if sees(a.point, b.point):
            return math.dist(a.point, b.point)
        end = b.fixed.point if b.fixed is not None else b.point
        if b.zone >= 0 and self.site.rooms[b.zone].contains(*a.point):
            return planner.distance(a.point, end)  # behind a shelf
        ways = [
            math.dist(a.point, passage) + self._ways.length(passage, end)
            for passage in self._passages
            if sees(a.point, passage)
        ]
        return min(ways) if ways else planner.distance(a.point, end)

    @override
    def along(self, a: Place, b: Place, gone: float) -> Place:
        if gone >= self.length(a, b):
            return b
        if gone <= 0.0:
            return a
        if self._way == "straight":
            return self._between(a, b, gone / self.length(a, b))
        points = self._ways.path(a.point, b.point)
        if points is None:
            return b
        reached = np.r_[0.0, np.cumsum(np.hypot(*np.diff(points, axis=0).T))]
        at = gone * reached[-1] / max(self.length(a, b), 1e-9)
        x = np.interp(at, reached, points[:, 0])
        y = np.interp(at, reached, points[:, 1])
        return self.place(float(x), float(y))

    # --- detectors ---------------------------------------------------------------------

    def check_detectors(self, kind: str) -> None:
        """Check that a detector can notice this kind of event.

        Raises:
            ConfigError: there is no detector for it.
        """
        detectors = KINDS[kind].detectors
        if not any(d.kind in detectors for d in self.site.detectors):
            raise ConfigError(f"site {self.site.name!r} has no {detectors[0]} detectors")

    def detected_after(self, kind: str, place: Place) -> float:
        """Return the time from the outbreak to the first detector, or person, that notices [s]."""
        return _detected_after(self.site, kind, place.point)
