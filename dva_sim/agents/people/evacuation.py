"""Evacuation of guards and bystanders from bad air.

A person looks at the air around it twice a second: that adds to its dose, and sets its pace. Who
has to leave goes to the nearest safe place, not through what nobody endures; it looks along its
way while walking, and chooses again.

References:
    Radiant heat of 2.5 kW/m^2, which skin stands for some minutes: ISO 13571.
    Carbon monoxide of 1200 ppm, immediately dangerous to life: NIOSH.
    People turn back in smoke through which they see 3 m or less, an extinction of 1 /m by
    V = 3 / K: T. Jin, Visibility and human behavior in fire smoke, SFPE Handbook. Nobody stays
    where gas can explode, at its lower explosive limit, or goes in; how much of it that is counts
    only for the dose, by the oxygen lacking. The limits of air temperature and water are assumed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from heapq import heappop, heappush
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dva_sim.agents.device import do_nothing
from dva_sim.agents.habits import LeavingHabits
from dva_sim.agents.people.walking import Walking
from dva_sim.kernel.clock import Clock
from dva_sim.worlds.hazards import CLEAR, Conditions, Dose, pace_in_smoke, pace_in_water
from dva_sim.worlds.planning import Disc, Planner
from dva_sim.worlds.site import Site

UNTENABLE: Final = Conditions(
    temperature=60.0,
    heat_flux=2.5,
    extinction=1.0,
    co=1200.0,
    gas=math.inf,
    water=1.0,
    explosive=1.0,
)
"""Any of it is more than anybody goes into, or stays in. Source: see above; temperature and depth
of water are habits of a person."""
DEADLY: Final = Conditions(
    temperature=120.0,
    heat_flux=10.0,
    extinction=math.inf,
    co=math.inf,
    gas=math.inf,
    water=1.5,
    explosive=math.inf,
)
"""Flames and what is next to them: nobody goes through, whatever the other ways are like. Source:
ISO 13571: in 10 kW/m^2 skin burns within seconds; the rest are habits of a person."""
EVERY: Final = 1.0  # design: distance between two checks along a path [m]
TRIES: Final = 3  # design: maximum attempts to find a path around bad places
INDOORS_MARGIN_M: Final = 0.05  # design: distance from the line of an exit, still indoors [m]
ROUNDING: Final = 1e-6  # design: rounding error of a straight path of many steps [m]

USUAL: Final = LeavingHabits()
Point = tuple[float, float]
Floats = NDArray[np.float64]
StrainLimit = Callable[[Point], float]  # 1 and more is more than one bears


class Escape(NamedTuple):
    """A way out: its destination, and the places to avoid."""

    goal: Point
    avoid: tuple[Disc, ...] = ()


def strain(conditions: Conditions, most: Conditions) -> float:
    """Return the conditions as a share of a limit: 1 where the first of them reaches it."""
    return max(is_ / limit for is_, limit in zip(conditions, most, strict=True))


def is_deadly(conditions: Conditions) -> bool:
    """Return True if even people in smoke do not go there."""
    return strain(conditions, DEADLY) >= 1.0


def refuges_of(site: Site) -> list[Point]:
    """Return safe places of a site [m]: its exits; else the guard posts; else robot bases.

    An exit lies in the line of the outer wall: the place is just within.
    """
    if not site.exits:
        return [(pose.x, pose.y) for pose in site.guard_posts or site.robot_bases]
    ways = [(exit_, math.cos(exit_.heading), math.sin(exit_.heading)) for exit_ in site.exits]
    return [
        (exit_.x - INDOORS_MARGIN_M * dx, exit_.y - INDOORS_MARGIN_M * dy) for exit_, dx, dy in ways
    ]


def choose_escape(
    planner: Planner,
    here: Point,
    refuges: Sequence[Point],
    limits: Sequence[StrainLimit],
    habits: LeavingHabits = USUAL,
) -> Escape | None:
    """Return the refuge with the shortest path without bad places.

    A longer way around bad places is taken if every refuge's shortest way leads through some.
    If there is none either, less has to do: a way that keeps the limits but the first. If no
    way keeps even the last limit there is no escape for now.

    Args:
        planner: Planner of the site.
        here: Current position; a person in bad air goes through no worse to the first good place.
        refuges: Safe places, regardless of the conditions there: outdoors is beyond [m].
        limits: Functions of a place's load relative to a tolerable one; the strictest first.
        habits: Habits of the person.
    """
    for k in range(len(limits)):
        escape = _keeping(planner, here, refuges, limits[k:], habits)
        if escape is not None:
            return escape
    return None


def _keeping(
    planner: Planner,
    here: Point,
    refuges: Sequence[Point],
    limits: Sequence[StrainLimit],
    habits: LeavingHabits,
) -> Escape | None:
    """Return the nearest refuge on a path within the limits, around more and more bad places."""
    avoid: tuple[Disc, ...] = ()
    for _ in range(TRIES):
        hazardous: dict[Point, None] = {}
        for refuge, path in _nearest_first(planner, here, refuges, avoid):
            judged = [_judge(path, one, habits.close_m) for one in limits[:-1]]
            judged.append(_judge(path, limits[-1], math.inf))
            if all(will_do for will_do, _ in judged):
                return Escape(refuge, avoid)
            hazardous.update((place, None) for _, bad in judged for place in bad)
        if not hazardous:
            return None
        avoid = (*avoid, *(Disc(x, y, habits.keeps_off_m) for x, y in hazardous))
    return None


def _nearest_first(
    planner: Planner, here: Point, refuges: Sequence[Point], avoid: Sequence[Disc]
) -> Iterator[tuple[Point, Floats]]:
    """Yield reachable refuges and the paths to them, the shortest first.

    No way is shorter than the straight line: none is planned before a known one that is.
    """
    planned: list[tuple[float, int, Floats]] = []
    for straight, number in sorted((math.dist(here, at), n) for n, at in enumerate(refuges)):
        while planned and planned[0][0] < straight - ROUNDING:
            _, nearest, path = heappop(planned)
            yield refuges[nearest], path
        way_there = planner.path(here, refuges[number], avoid)
        if way_there is not None:
            heappush(planned, (_length(way_there), number, way_there))
    for _, nearest, path in sorted(planned, key=lambda one: one[:2]):
        yield refuges[nearest], path


def _judge(path: Floats, limit: StrainLimit, close: float) -> tuple[bool, list[Point]]:
    """Return whether a path keeps a limit, and the bad places to avoid.

    No way keeps it that is bad from begin to end, and longer than `close` [m]: only who stands
    in what is deadly runs however far, if it gets no worse.
    """
    steps = max(1, round(EVERY / float(np.hypot(*(path[1] - path[0])) or EVERY)))
    places = [(float(x), float(y)) for x, y in path[:-1:steps]]
    strains = [float(limit(place)) for place in places]
    leaves = (i for i, s in enumerate(strains) if s < 1.0 or s > strains[0])
    first = next(leaves, len(places))
    bad = [p for p, s in zip(places[first:], strains[first:], strict=True) if s >= 1.0]
    comes_out = first < len(places) or _length(path) <= close
    return comes_out and not bad, bad


def _length(path: Floats) -> float:
    """Return the length of a path [m]."""
    return float(np.hypot(*np.diff(path, axis=0).T).sum())


PERIOD: Final = 0.5  # design: interval of checks of the air [s]
HURT: Final = 0.3
"""Source: ISO 13571: dose beyond which a guard stops working; 1 incapacitates half of all people,
0.3 only the most susceptible."""

AirAt = Callable[[float, float, float], Conditions]


def clean_air(x: float, y: float, time: float) -> Conditions:
    """Return air without hazards."""
    return CLEAR


class Exposure:
    """One person in the air of a site.

    Args:
        clock: The run's.
        walking: Motion of the person; smoke and water slow it down.
        air: Conditions at a place [m] and time [s].

    Attributes:
        dose: Dose of heat and poison so far.
        conditions: Conditions at the latest check.
    """

    def __init__(self, clock: Clock, walking: Walking, air: AirAt = clean_air) -> None:
        self._clock = clock
        self._walking = walking
        self._air = air
        own = walking.habits.leaving
        warm = {"temperature": own.untenable_c, "water": own.untenable_water_m}
        hot = {"temperature": own.deadly_c, "water": own.deadly_water_m}
        self._untenable = UNTENABLE._replace(**warm)
        self._deadly = DEADLY._replace(**hot)
        self.dose = Dose()
        self.conditions = CLEAR
        self._over = self._is_outdoors = False

    def start(self, then: Callable[[], object] = do_nothing) -> None:
        """Look at the air from now on, and call `then` each time."""
        if self._air is not clean_air:
            self._clock.every(PERIOD, lambda: self._look(then))

    def end(self) -> None:
        """End the exposure of the person."""
        self._over = True

    def step_out(self) -> None:
        """Place the person just beyond an exit, in clean air, until it walks again."""
        self._is_outdoors = True

    def _look(self, then: Callable[[], object]) -> bool:
        """Sample; False when it is over."""
        if self._over:
            return False
        x, y = self._walking.place
        self._is_outdoors = self._is_outdoors and not self._walking.walks
        self.conditions = CLEAR if self._is_outdoors else self._air(x, y, self._clock.now)
        self.dose.add(self.conditions, PERIOD)
        in_smoke = pace_in_smoke(self.conditions.extinction)
        self._walking.pace = in_smoke * pace_in_water(self.conditions.water)
        then()
        return not self._over

    @property
    def is_too_much(self) -> bool:
        """True if the person has to leave: the air is untenable, or the dose too high."""
        return self.is_hurt or strain(self.conditions, self._untenable) >= 1.0

    @property
    def is_hurt(self) -> bool:
        """True if the dose is too high to continue working."""
        return max(self.dose.heat, self.dose.toxic) >= HURT

    def is_bad(self, place: tuple[float, float]) -> bool:
        """Return True if a place [m] is untenable now."""
        return strain(self._air(*place, self._clock.now), self._untenable) >= 1.0

    def is_deadly(self, place: tuple[float, float]) -> bool:
        """Return True if a place [m] is impassable now."""
        return strain(self._air(*place, self._clock.now), self._deadly) >= 1.0

    @property
    def limits(self) -> tuple[StrainLimit, StrainLimit]:
        """Limits to keep: untenable air, or where that is impossible, deadly air."""
        return self._strain(self._untenable), self._strain(self._deadly)

    def _strain(self, most: Conditions) -> StrainLimit:
        """Return the limit as a measure of strain at a place now."""
        return lambda place: strain(self._air(*place, self._clock.now), most)


class WayOut:
    """Leads a person to the nearest safe place, as long as a path exists.

    A person without a path stands still, and repeats the search.

    Args:
        clock: The run's.
        planner: Planner of the site.
        walking: The person's legs.
        exposure: Exposure of the person, and the conditions it avoids.
        refuges: Currently safe places [m].
    """

    def __init__(
        self,
        clock: Clock,
        planner: Planner,
        walking: Walking,
        exposure: Exposure,
        refuges: Callable[[], Sequence[Point]],
    ) -> None:
        self._clock = clock
        self._planner = planner
        self._walking = walking
        self._exposure = exposure
        self._refuges = refuges
        self._arrived: Callable[[], object] = do_nothing
        self._habits = habits = walking.habits.leaving
        self._chosen = -math.inf
        self._pause = habits.chooses_again_s
        self._choices = 0

    def leave(self, arrived: Callable[[], object]) -> None:
        """Set out; `arrived` is called at a safe place."""
        self._arrived = arrived
        self._pause = self._habits.chooses_again_s
        self._choose()

    def end(self) -> None:
        """Stand still for good."""
        self._choices += 1
        self._walking.stop()

    def look_ahead(self) -> None:
        """Choose again if the next part of the path has become bad; at once if it is deadly."""
        soonest = self._habits.chooses_again_s
        ahead = self._walking.places_ahead(1.0, self._habits.looks_ahead_m)
        since = self._clock.now - self._chosen
        if since < soonest or not ahead:
            return
        if not any(map(self._exposure.is_bad, ahead)):
            self._pause = soonest
        elif since >= self._pause or any(map(self._exposure.is_deadly, ahead)):
            self._choose()

    def _choose(self) -> None:
        """Set out for the refuge that is best now; if none can be reached, wait."""
        self._chosen = self._clock.now
        self._choices += 1
        habits = self._habits
        pause = self._pause
        self._pause = min(2.0 * pause, habits.at_latest_s)
        here = self._walking.place
        limits = self._exposure.limits
        escape = choose_escape(self._planner, here, self._refuges(), limits, habits)
        if escape is None or not self._walking.go(
            escape.goal,
            self._arrived,
            self._choose,
            lambda at: math.dist(at, escape.goal) < habits.through_m,
            escape.avoid,
        ):
            self._walking.stop()
            self._clock.call_after(pause, self._choose_again, self._choices)

    def _choose_again(self, choices: int) -> None:
        """Repeat the search, unless another goal has been chosen since."""
        if choices == self._choices:
            self._choose()


class OnFoot:
    """A person on foot.

    Args:
        walking: Walking model of the person.
        exposure: Exposure of the person.
    """

    def __init__(self, walking: Walking, exposure: Exposure) -> None:
        self.walking = walking
        self.exposure = exposure

    @property
    def x(self) -> float:
        """Present or last position of the person [m]."""
        return self.walking.place[0]

    @property
    def y(self) -> float:
        """Present or last position of the person [m]."""
        return self.walking.place[1]

    @property
    def heading(self) -> float:
        """Viewing direction [rad]."""
        return self.walking.heading

    @property
    def dose(self) -> Dose:
        """Dose of heat and poison so far."""
        return self.exposure.dose
