"""Places and the ways between them: nowhere in particular, or on a plane."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from dva_sim.errors import ConfigError
from dva_sim.guesses import unknown
from dva_sim.protocol import messages as m
from dva_sim.timed.scenario import Point, TimedScenario
from dva_sim.worlds.geo import GeoFrame
from dva_sim.worlds.site import DEFAULT_FRAME

if TYPE_CHECKING:
    from dva_sim.timed.incident import Incident

APART = 1e-10  # between events at one place, so that each position is one event's [deg]
FAR_APART = 1e-5  # where place does not matter, so that nobody takes two events for one [deg]
NUMBERED = 4096  # positions at one place before they repeat


class Place:
    """A place: x, y [m], as it is told in messages, and its zone (-1: none).

    Attributes:
        fixed: The place that is there in every run, if there is one: ways to it are kept.
        about: The incident that happens here, if one does.
    """

    __slots__ = ("about", "fixed", "position", "x", "y", "zone")

    def __init__(
        self, x: float, y: float, position: m.Position, zone: int = -1, fixed: Place | None = None
    ) -> None:
        self.x, self.y, self.position, self.zone = x, y, position, zone
        self.fixed = fixed
        self.about: Incident | None = None

    @property
    def point(self) -> Point:
        """x, y [m]."""
        return self.x, self.y


class Terrain:
    """Where place does not matter: everything is here.

    Attributes:
        zones: Names of the zones.
        frame: Where on earth it lies.
        placed: Whether events have a place by luck.
    """

    placed = False

    def __init__(
        self, zones: Sequence[str], frame: GeoFrame = DEFAULT_FRAME, apart: float = FAR_APART
    ) -> None:
        self.zones, self.frame = list(zones), frame
        self._apart = apart
        self._known: dict[m.Position, Place] = {}
        self._numbered = 0

    # --- places ------------------------------------------------------------------------

    def place(self, x: float, y: float, zone: int = -1) -> Place:
        """A place at a point [m]."""
        return Place(x, y, m.Position(*self.frame.to_latlon(x, y)), zone)

    def fix(self, x: float, y: float, zone: int = -1) -> Place:
        """A place that stays, such as a base."""
        place = self.place(x, y, zone)
        place.fixed = place
        self._known[place.position] = place
        return place

    def remember(self, place: Place) -> Place:
        """Know a place by its position, until it is forgotten; a fixed one is known already."""
        return self._known.setdefault(place.position, place)

    def forget(self, place: Place) -> None:
        """The place plays no part any more."""
        if self._known.get(place.position) is place and place.fixed is not place:
            del self._known[place.position]

    def known_at(self, position: m.Position) -> Place:
        """The place that a message speaks of."""
        known = self._known.get(position)
        if known is None:
            x, y = self.frame.to_xy(position.latitude, position.longitude)
            known = Place(x, y, position)
        return known

    def event_place(self, zone: int, u: float, v: float) -> Place:
        """Where an event happens: by two shares of luck, at a position that is its alone."""
        return self.apart(self._middle(zone))

    def apart(self, place: Place) -> Place:
        """The same place under a position of its own."""
        self._numbered = self._numbered % NUMBERED + 1
        at = place.position
        position = m.Position(at.latitude + self._apart * self._numbered, at.longitude)
        return Place(place.x, place.y, position, place.zone, place.fixed)

    def named(self, name: str, number: int) -> Place:
        """A base or station by name; the `number`-th that asks gets the `number`-th post.

        Raises:
            ConfigError: there is no such place.
        """
        if name in self.zones:
            return self.centre(self.zones.index(name))
        raise ConfigError(unknown("place", name, self.zones, "zones"))

    def centre(self, zone: int) -> Place:
        """A place that stands for a zone."""
        return self._middle(zone)

    def anywhere(self, rng: np.random.Generator) -> Place:
        """A place by chance."""
        return self._middle(0)

    def default_base(self, kind: str) -> str | None:
        """Where responders of a kind wait if nobody says where."""
        return None

    def spots(self, zone: int) -> list[Place]:
        """Places that a zone is known by: what is far from them is far from the zone."""
        return [self.centre(zone)]

    def origin(self) -> Place:
        """Where responders wait by default."""
        return self._middle(0)

    def _middle(self, zone: int) -> Place:
        place = self._known.get(_ORIGIN)
        if place is None:
            place = Place(0.0, 0.0, _ORIGIN, 0)
            place.fixed = place
            self._known[_ORIGIN] = place
        return place

    def size(self, zone: int) -> float:
        """Weight of a zone among others where events may happen anywhere."""
        return 1.0

    # --- ways --------------------------------------------------------------------------

    def length(self, a: Place, b: Place) -> float:
        """Length of the way [m]; infinite if there is none."""
        return 0.0

    def along(self, a: Place, b: Place, gone: float) -> Place:
        """Where somebody is who has gone so far [m] from `a` to `b`."""
        return b


_ORIGIN = m.Position(DEFAULT_FRAME.latitude, DEFAULT_FRAME.longitude)


class Plane(Terrain):
    """A rectangle on which everybody walks straight.

    Args:
        width: [m]
        height: [m]
        zones: Rectangles xmin, ymin, xmax, ymax [m] by name.
        straight: Whether ways take any time.
    """

    placed = True

    def __init__(
        self,
        width: float,
        height: float,
        zones: dict[str, tuple[float, float, float, float]],
        straight: bool = True,
    ) -> None:
        super().__init__(list(zones) or ["area"], apart=APART)
        self._boxes = list(zones.values()) or [(0.0, 0.0, width, height)]
        self._named, self._whole = bool(zones), (0.0, 0.0, width, height)
        self._straight = straight
        self._centres: dict[int, Place] = {}

    def event_place(self, zone: int, u: float, v: float) -> Place:
        """See `Terrain`."""
        left, low, right, high = self._boxes[zone] if zone >= 0 else self._whole
        x, y = left + u * (right - left), low + v * (high - low)
        place = self.place(x, y, zone if zone >= 0 else self._zone_at(x, y))
        return self.apart(place) if left == right and low == high else place

    def _zone_at(self, x: float, y: float) -> int:
        for zone, (left, low, right, high) in enumerate(self._boxes):
            if left <= x <= right and low <= y <= high:
                return zone
        return -1

    def centre(self, zone: int) -> Place:
        """See `Terrain`."""
        if zone not in self._centres:
            left, low, right, high = self._boxes[zone]
            self._centres[zone] = self.fix(0.5 * (left + right), 0.5 * (low + high), zone)
        return self._centres[zone]

    def anywhere(self, rng: np.random.Generator) -> Place:
        """See `Terrain`."""
        u, v = rng.random(2).tolist()
        return self.fix(u * self._whole[2], v * self._whole[3])

    def origin(self) -> Place:
        """See `Terrain`: the middle of the area."""
        return self.fix(0.5 * self._whole[2], 0.5 * self._whole[3])

    def size(self, zone: int) -> float:
        """See `Terrain`: its area, unless events may happen outside all zones, too."""
        left, low, right, high = self._boxes[zone]
        return (right - left) * (high - low)

    def length(self, a: Place, b: Place) -> float:
        """See `Terrain`."""
        return math.hypot(a.x - b.x, a.y - b.y) if self._straight else 0.0

    def along(self, a: Place, b: Place, gone: float) -> Place:
        """See `Terrain`."""
        whole = self.length(a, b)
        if gone >= whole:
            return b
        if gone <= 0.0:
            return a
        share = gone / whole
        return self.place(a.x + share * (b.x - a.x), a.y + share * (b.y - a.y))


def terrain_of(scenario: TimedScenario) -> Terrain:
    """The ground that a scenario plays on.

    Raises:
        ConfigError: a site that cannot be read.
    """
    if scenario.site is not None:
        from dva_sim.timed.rooms import Rooms

        return Rooms(scenario.site.name, scenario.site.spots, scenario.way)
    if scenario.area is not None:
        straight = scenario.way == "straight"
        return Plane(scenario.area.width_m, scenario.area.height_m, scenario.zones, straight)
    return Terrain(["here"])
