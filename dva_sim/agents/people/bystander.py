"""Bystanders: people who work at a site, and leave it when the alarm sounds or danger shows.

Values of `activity`:

- **working** at a place, or **walking** to another one, if it is one of those who move around.
- **alarmed**: it has heard the alarm, or noticed smoke, heat, water or flames itself, and gets
  ready to leave for its pre-movement time, whichever came first. Air that nobody endures, or a
  fire that can be felt, ends that time at once.
- **evacuating** to the nearest refuge by the way there, not through what nobody endures; if the
  way ahead becomes so, it chooses again, and so it does when it is blocked for good. Where no
  way is left it stands still, and looks for one again.
- **safe**: out.
- **incapacitated**: it stays where it is, for everybody else to walk around.

Bystanders have no device: only the recorder knows of them. They work at places drawn in
the rooms of a site (`draw_places`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Final

import numpy as np

from dva_sim.agents.device import do_nothing
from dva_sim.agents.people.evacuation import AirAt, Exposure, OnFoot, WayOut, clean_air
from dva_sim.agents.people.profiles import Occupant
from dva_sim.agents.people.walking import Walking
from dva_sim.kernel.clock import Clock
from dva_sim.kernel.errors import ConfigError
from dva_sim.worlds.hazards import Conditions
from dva_sim.worlds.planning import Planner
from dva_sim.worlds.site import Site
from dva_sim.worlds.site_parts import Room

WORKING = "working"
WALKING = "walking"
ALARMED = "alarmed"
EVACUATING = "evacuating"
SAFE = "safe"
INCAPACITATED = "incapacitated"

NOTICED: Final = Conditions(
    temperature=40.0,
    heat_flux=0.5,
    extinction=0.1,
    co=math.inf,
    gas=math.inf,
    water=0.02,
    explosive=0.2,
)
"""From any of it on people notice that something is wrong: habits of a person, but for gas. Source:
gas is given a smell that is noticed at a fifth of its lower explosive limit. Carbon monoxide has
none."""

Point = tuple[float, float]


def nothing_seen(x: float, y: float, time: float) -> bool:
    """Return a view without any hazards."""
    return False


class BystanderAgent(OnFoot):
    """One bystander.

    Args:
        name: Name as in `bystander-1`.
        clock: The run's.
        occupant: Properties of the person.
        walking: Walking model of the person.
        planner: Planner of the site.
        places: Working places; it begins at the first [m].
        refuges: Safe places [m].
        rng: Random generator of its walks in normal times.
        air: Conditions at a place [m] and time [s].
        sees: Predicate: True if flames are visible from a place [m] at a time [s].
        leaves: Called when the person has left the site: the body is removed.
        tell: Callback with descriptions of events for the story.

    Attributes:
        activity: Current activity.
        leaves_at: Time of setting out to leave [s]; infinite until it is alarmed.
        out_at: Time of reaching the outside [s]; infinite until then.
    """

    def __init__(
        self,
        name: str,
        clock: Clock,
        occupant: Occupant,
        walking: Walking,
        *,
        planner: Planner,
        places: Sequence[Point],
        refuges: Sequence[Point],
        rng: np.random.Generator,
        air: AirAt = clean_air,
        sees: Callable[[float, float, float], bool] = nothing_seen,
        leaves: Callable[[], object] = do_nothing,
        tell: Callable[[str], object] = do_nothing,
    ) -> None:
        super().__init__(walking, Exposure(clock, walking, air))
        own = self._habits = occupant.habits.noticing
        self._noticed = NOTICED._replace(
            temperature=own.warm_c,
            heat_flux=own.heat_kw_m2,
            extinction=own.smoke_per_m,
            water=own.water_m,
        )
        self.name = name
        self._clock = clock
        self._occupant = occupant
        self._way_out = WayOut(clock, planner, walking, self.exposure, lambda: refuges)
        self._places = places
        self._rng = rng
        self._sees = sees
        self._leaves = leaves
        self._tell = tell
        self.activity = WORKING
        self.leaves_at = self.out_at = math.inf

    def start(self) -> None:
        """Begin to work, and to watch for danger."""
        self.exposure.start(self._felt)
        if self._occupant.moves:
            self._stay()

    # --- while nothing is wrong --------------------------------------------------------

    def _stay(self) -> None:
        if self.activity in (WORKING, WALKING):
            self.activity = WORKING
            self._clock.call_after(self._occupant.stay.draw(self._rng), self._change_place)

    def _change_place(self) -> None:
        if self.activity != WORKING:
            return
        place = self._places[int(self._rng.integers(len(self._places)))]
        self.activity = WALKING
        if not self.walking.go(place, self._stay, self._stay):
            self._stay()

    # --- alarm -------------------------------------------------------------------------

    def alarm(self, now: float) -> None:
        """Sound the alarm; it has no effect on people who have left or are preparing to."""
        self._leave_at(now + self._occupant.premovement)

    def _leave_at(self, time: float) -> None:
        """Set out to leave at `time` [s], if not sooner."""
        if self.activity in (EVACUATING, SAFE, INCAPACITATED) or time >= self.leaves_at:
            return
        if self.activity != ALARMED:
            self.walking.stop()
            self.activity = ALARMED
        self.leaves_at = time
        self._clock.call_at(time, self._evacuate)

    def _felt(self) -> None:
        """Breathe this air for half a second more."""
        now = self._clock.now
        if self.dose.incapacitated:
            self._collapse()
        elif self.activity == EVACUATING:
            self._way_out.look_ahead()
        elif self.exposure.is_too_much or self._feels_fire():
            self._leave_at(now)
        elif self.activity != ALARMED and self._notices(now):
            self._tell("notices danger")
            self._leave_at(now + self._occupant.premovement)

    def _feels_fire(self) -> bool:
        """Return True if it feels a fire so near that it leaves at once."""
        return self.exposure.conditions.heat_flux >= self._habits.too_near_kw_m2

    def _notices(self, now: float) -> bool:
        felt = zip(self.exposure.conditions, self._noticed, strict=True)
        return any(is_ >= least for is_, least in felt) or self._sees(*self.walking.place, now)

    def _collapse(self) -> None:
        self.exposure.end()
        self._way_out.end()
        self.activity = INCAPACITATED
        self._tell("is incapacitated")

    # --- the way out -------------------------------------------------------------------

    def _evacuate(self) -> None:
        if self.activity == ALARMED:
            self.activity = EVACUATING
            self._tell("leaves")
            self._way_out.leave(self._is_out)

    def _is_out(self) -> None:
        self.activity = SAFE
        self.out_at = self._clock.now
        self.exposure.end()
        self._tell("is out")
        self._leaves()


ELBOW_ROOM: Final = 0.3  # design: free radius around a place of work [m]
START_GAP_M: Final = 0.8  # design: minimum distance between people at the start [m]
PASSAGE: Final = 3.5  # design: ratio of length to width from which a room is a corridor
TRIES: Final = 100  # design: maximum attempts to draw a place


def draw_places(
    site: Site, rng: np.random.Generator, count: int, taken: Sequence[Point] = ()
) -> list[Point]:
    """Draw places of one person [m]: rooms by their area, uniformly in each.

    Args:
        site: Site of the places; on a bare map, which has no rooms, anywhere.
        rng: Random generator.
        count: Number of places.
        taken: Places from which the first one keeps its distance [m].

    Raises:
        ConfigError: there is no such place.
    """
    rooms, areas = _workrooms(site)
    for _ in range(TRIES):
        first = _draw(site, rng, rooms, areas)
        if all(math.dist(first, other) >= START_GAP_M for other in taken):
            break
    else:
        raise ConfigError(f"site {site.name!r} has no room for another bystander")
    return [first, *(_draw(site, rng, rooms, areas) for _ in range(count - 1))]


def _draw(site: Site, rng: np.random.Generator, rooms: list[str], areas: list[float]) -> Point:
    room = str(rng.choice(rooms, p=areas)) if rooms else None
    return site.sample_free(rng, ELBOW_ROOM, room)


@lru_cache(maxsize=16)
def _workrooms(site: Site) -> tuple[list[str], list[float]]:
    """Return rooms where people work, and the share of each in their area."""
    rooms = [room for room in site.rooms if not room.outdoor and not _is_passage(room)]
    rooms = [room for room in rooms if _has_place(site, room.name)]
    areas = np.array([_sides(room)[0] * _sides(room)[1] for room in rooms])
    return [room.name for room in rooms], (areas / areas.sum()).tolist() if rooms else []


def _is_passage(room: Room) -> bool:
    short, long = _sides(room)
    return long >= PASSAGE * short


def _sides(room: Room) -> tuple[float, float]:
    """Return the shorter and the longer side of the smallest rectangle around a room [m]."""
    import shapely

    corners = shapely.get_coordinates(shapely.oriented_envelope(room.area))
    one, other = np.hypot(*np.diff(corners[:3], axis=0).T).tolist()
    return min(one, other), max(one, other)


def _has_place(site: Site, room: str) -> bool:
    try:
        site.sample_free(np.random.default_rng(0), ELBOW_ROOM, room)
    except ConfigError:
        return False
    return True
