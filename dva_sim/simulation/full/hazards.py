"""The hazards of a run: kinds, places and times, drawn by the run's seed."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from dva_sim.agents.robot.field_of_view import HazardSpot, make_spot
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.streams import Streams
from dva_sim.simulation.full.stage import Stage
from dva_sim.simulation.scenario import EventConfig
from dva_sim.worlds.hazards import Hazard, Surroundings, find_hazard, first_detection, make_hazard
from dva_sim.worlds.site import Site
from dva_sim.worlds.site_parts import Detector

REACHABLE = 0.4  # radius that fits through the doors on the way to a hazard [m]
CLEARANCE = 0.7  # free radius around the middle of a hazard, so that a robot can get near [m]
MIN_BASE_DISTANCE_M = 6.0  # minimum distance from every base [m]
TRIES = 200
HEARSAY_WITHIN = 3.0  # maximum error of the place that further callers report [m]
HEARSAY_LATE = (2.0, 20.0)  # shortest and longest delay of further reports after the first [s]
SAME_PLACE = 4.0  # a hazard within this distance counts as being at a place [m]

Danger = tuple[tuple[float, float], float]  # the middle and the radius of a place to keep off [m]


@dataclass(frozen=True)
class Hearsay:
    """Report of an incident by another person: when [s], and at which position [m]."""

    time: float
    position: tuple[float, float]


@dataclass(frozen=True)
class RunHazard:
    """A hazard of this run.

    Attributes:
        kind: Kind as reported: `fire`, `gas_leak` or `flood`.
        room: Name of the room; empty outside all rooms.
        start: Start time [s].
        detected: Time at which a detector or a person notices it [s]; infinite if nobody does.
        detector: The detector that does, if one does.
        hazard: Model of its growth.
        false_alarm: Nothing is there; the hazard is what those who report it believe in.
        hearsay: Later reports by other people.
    """

    kind: str
    room: str
    start: float
    detected: float
    detector: Detector | None
    hazard: Hazard
    false_alarm: bool = False
    hearsay: tuple[Hearsay, ...] = ()

    def is_there(self, now: float) -> bool:
        """Return True if it has begun and is real; its field knows whether it is over [s]."""
        return now >= self.start and not self.false_alarm

    def spot(self, now: float) -> HazardSpot:
        """Return its visible part at `now` [s], after its beginning."""
        hazard = self.hazard
        x, y = hazard.position
        return make_spot(self.kind, x, y, hazard.radius(now), hazard.shines)


def draw_incidents(
    events: tuple[EventConfig, ...], site: Site, streams: Streams
) -> list[RunHazard]:
    """Place the events of a scenario, each by a stream of its own.

    Raises:
        ConfigError: a room that the site does not have, or no free place for an event.
    """
    return [_draw(event, site, streams, number) for number, event in enumerate(events, 1)]


def _draw(event: EventConfig, site: Site, streams: Streams, number: int) -> RunHazard:
    start, (x, y) = draw_beginning(event, site, streams, number)
    hazard = make_hazard(event.kind, (x, y), start, **event.hazard)
    room = site.room_at(x, y) or ""
    detector = None
    detected = start
    if not event.reported:
        detector, detected = first_detection(hazard, site)
    rng = streams[f"event-{number}/hearsay"]
    hearsay = tuple(_hearsay(detected, (x, y), site, rng) for _ in range(event.reports - 1))
    return RunHazard(
        kind=hazard.reported_as,
        room=room,
        start=start,
        detected=detected,
        detector=detector,
        hazard=hazard,
        false_alarm=event.false_alarm,
        hearsay=hearsay,
    )


def draw_beginning(
    event: EventConfig, site: Site, streams: Streams, number: int
) -> tuple[float, tuple[float, float]]:
    """Return when [s] and where [m] an event begins.

    Raises:
        ConfigError: a room that the site does not have, or no free place.
    """
    rng = streams[f"event-{number}"]
    start = event.at_s
    if event.latest_s is not None:
        start = float(rng.uniform(event.at_s, event.latest_s))
    return start, _place(event, site, rng)


def _hearsay(
    first: float, place: tuple[float, float], site: Site, rng: np.random.Generator
) -> Hearsay:
    """Return a free place near the true place, in the same room."""
    time = first + float(rng.uniform(*HEARSAY_LATE))
    for _ in range(TRIES):
        far = HEARSAY_WITHIN * rng.uniform()
        angle = rng.uniform(0.0, 2.0 * math.pi)
        x = place[0] + far * math.cos(angle)
        y = place[1] + far * math.sin(angle)
        if site.is_free(x, y, REACHABLE) and site.room_at(x, y) == site.room_at(*place):
            return Hearsay(time, (float(x), float(y)))
    return Hearsay(time, place)


def _place(event: EventConfig, site: Site, rng: np.random.Generator) -> tuple[float, float]:
    """Return its position; else a free place in its room, or in one watched for its kind.

    Where bases are everywhere it is the place that was found to be farthest from them.
    """
    if event.position is not None:
        return event.position
    kind = find_hazard(event.kind)
    rooms: list[str | None] = [event.room] if event.room else _watched_rooms(kind, site)
    bases = [*site.robot_bases, *site.guard_posts]
    farthest = -math.inf
    place = None
    for _ in range(TRIES):
        x, y = site.sample_free(rng, REACHABLE, rooms[int(rng.integers(len(rooms)))])
        if not site.is_free(x, y, CLEARANCE):
            continue
        gap = min((math.dist((x, y), (b.x, b.y)) for b in bases), default=math.inf)
        if event.room is not None or gap >= MIN_BASE_DISTANCE_M:
            return x, y
        if gap > farthest:
            farthest = gap
            place = (x, y)
    if place is None:
        where = f" in room {event.room!r}" if event.room else ""
        raise ConfigError(f"site {site.name!r} has no free place for a {kind.title}{where}")
    return place


def _watched_rooms(kind: type[Hazard], site: Site) -> list[str | None]:
    """Rooms with a detector for a kind of event; `None`, which is anywhere, if there are none."""
    watched = {site.room_at(d.x, d.y) for d in site.detectors if d.kind in kind.detectors}
    return [room.name for room in site.rooms if room.name in watched] or [None]


class RunHazards:
    """Hazards at the site: active, visible and contained ones.

    Attributes:
        incidents: Incidents of the scenario, in its order.
        surroundings: Effect of the hazards on air and floor.
        contained: Time at which an incident was contained [s], by its index in `incidents`.

    Raises:
        ConfigError: the site cannot hold the events.
    """

    def __init__(self, stage: Stage) -> None:
        self.stage = stage
        self._clock = stage.clock
        self.incidents = draw_incidents(stage.scenario.events, stage.site, stage.streams)
        self._real = {n: i for n, i in enumerate(self.incidents) if not i.false_alarm}
        self.surroundings = Surroundings(stage.site, [i.hazard for i in self._real.values()])
        self.contained: dict[int, float] = {}

    def dangers(self, now: float) -> list[Danger]:
        """Return the places that people should avoid."""
        return [(i.hazard.position, i.hazard.danger_radius(now)) for i in self._going_on(now)]

    def spots(self, now: float) -> list[HazardSpot]:
        """Return the visible parts of the hazards."""
        return [incident.spot(now) for incident in self._going_on(now)]

    def contain(self, kind: str, x: float, y: float) -> None:
        """Contain the hazard at a place [m]: from now on it harms nobody."""
        now = self.stage.clock.now
        for number, incident in enumerate(self.incidents):
            near = math.dist(incident.hazard.position, (x, y)) < SAME_PLACE
            is_active = incident.is_there(now) and number not in self.contained
            if incident.kind == kind and near and is_active:
                self.contained[number] = now
                self.surroundings.contain([*self._real].index(number), now)

    def is_there(self, kind: str, x: float, y: float) -> bool:
        """Return True if a hazard of this kind really is near a place [m]."""
        spots = self.spots(self.stage.clock.now)
        return any(s.kind == kind and math.dist((s.x, s.y), (x, y)) < SAME_PLACE for s in spots)

    def smoke(self, a: tuple[float, float], b: tuple[float, float]) -> float:
        """Return the optical depth between two places [m] now."""
        return self.surroundings.optical_depth(a, b, self.stage.clock.now)

    def is_hazy(self) -> bool:
        """Return True if smoke is in anybody's sight now."""
        return self.surroundings.is_hazy(self._clock.now)

    def _going_on(self, now: float) -> list[RunHazard]:
        """Return the hazards that have begun, are real, and are not dealt with yet."""
        going_on = []
        for number, incident in self._real.items():
            if incident.start <= now < self.contained.get(number, math.inf):
                going_on.append(incident)
        return going_on
