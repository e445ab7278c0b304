"""Hazards: a growing danger, the field that it makes on a site, and how both are shown.

Derive from `Hazard` and `HazardField` to make a kind of your own (docs/explanation/hazards.md).

Robots and people only change the time at which a source stops. So the fields shipped are solved
once per process for each site, kind and space that they start in, step by step and only as far as
somebody asks; a run goes on from there on its own once its hazard is dealt with.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from pydantic import ValidationError

from dva_sim.kernel.config import Config, first_mistake
from dva_sim.kernel.errors import ConfigError
from dva_sim.protocol.event_kinds import EVENT_KINDS
from dva_sim.worlds.hazards.building import Floats, SitePoints, building_of
from dva_sim.worlds.hazards.conditions import QUANTITIES, Conditions
from dva_sim.worlds.hazards.detectors import LATEST, DetectorAlarm, alarm_in
from dva_sim.worlds.site import Site
from dva_sim.worlds.site_parts import Detector

if TYPE_CHECKING:
    from dva_sim.worlds.camera.sprites import Sprite


Point = tuple[float, float]
Step = Callable[[Floats, float, float], Floats]
Paces = Sequence[tuple[float, float]]

# Until which age, in which steps [s]: what has just begun changes fast.
PACES = ((120.0, 1.0), (600.0, 2.0), (1800.0, 5.0), (math.inf, 20.0))

LARGEST = 2.5  # maximum visible radius of a leak or flood [m]; assumed


class Hazard(Config, defer_build=False):  # its signature, which tells the settings, is built too
    """A growing danger, as it would be in the open: what walls make of it, its field knows.

    A scenario may set the fields of the class, with their units, limits and
    defaults. The same settings are the same hazard: it draws no random numbers.

    Args:
        position: Its middle [m].
        start: Start time [s].
        settings: Parameters of its kind.

    Attributes:
        reported_as: Kind used in messages, and so by everybody who gets them: `fire`, `gas_leak` or
            `flood`. It is handled as one of these.
        title: Name for people.
        detectors: Kinds of detector that notice it.
        shows: Quantities that pictures show over the floor, some of `QUANTITIES`.
        colour: Colour of its mark, as `#rrggbb`.
        mark: Mark of its source, as matplotlib names markers.
        shines: True if it is visible through smoke, as flames are.
        contained_by: Tool of a guard to contain it: `valve`, or `extinguisher`.

    Raises:
        ConfigError: an unknown setting, or a value that it cannot have.
    """

    reported_as: ClassVar[str] = ""
    title: ClassVar[str] = ""
    detectors: ClassVar[tuple[str, ...]] = ()
    shows: ClassVar[tuple[str, ...]] = ()
    colour: ClassVar[str] = "#a33ea1"
    mark: ClassVar[str] = "X"
    shines: ClassVar[bool] = False
    contained_by: ClassVar[str] = "valve"

    position: Point
    start: float

    def __init__(self, position: Point, start: float, **settings: Any) -> None:
        data = {"position": position, "start": start, **settings}
        try:
            super().__init__(**data)
        except ValidationError as problems:
            mistakes = problems.errors(include_url=False)
            problem, _ = first_mistake(type(self), data, mistakes)
            raise ConfigError(problem) from None

    @classmethod
    def __pydantic_init_subclass__(cls, **_: Any) -> None:
        """Refuse a class that no message could report.

        Raises:
            TypeError: `reported_as` or `shows` has a word that nobody knows.
        """
        if cls.reported_as not in EVENT_KINDS:
            kinds = ", ".join(EVENT_KINDS)
            raise TypeError(f"reported_as of {cls.__name__} should be one of {kinds}")
        if not set(cls.shows) <= set(QUANTITIES):
            raise TypeError(f"shows of {cls.__name__} should be some of {', '.join(QUANTITIES)}")

    def radius(self, time: float) -> float:
        """Return radius that can be seen at `time` [s], in [m]."""
        raise NotImplementedError

    def danger_radius(self, time: float) -> float:
        """Return radius within which people should not be at `time` [s], in [m]."""
        raise NotImplementedError

    def severity(self, time: float) -> float:
        """Return 0 (nothing yet) to 1 at `time` [s]."""
        raise NotImplementedError

    def field(self, site: Site) -> HazardField:
        """Return the field that it makes on a site."""
        raise NotImplementedError

    def noticed_by(self) -> tuple[str, ...]:
        """Return kinds of detector that notice it with these settings."""
        return self.detectors

    def explodes_at(self) -> float:
        """Return the share of its gas in the air that can explode; infinite if it has none."""
        return math.inf

    def sprite(self, time: float, ceiling: float) -> Sprite | None:
        """Return its sprite for a robot's camera at `time` [s], below a ceiling [m]."""
        return None

    def light(self, time: float) -> float:
        """Return how much it lights its room for a camera at `time` [s], 0 to 1."""
        return 0.0


class HazardField:
    """Effect of one hazard on the air and the floor of a site; derive from this.

    Only `at` has to be defined: everything else follows from it, if slowly. Nothing may depend
    on what was asked before.

    Attributes:
        until: Time at which its source was stopped [s].
    """

    def __init__(self, hazard: Hazard, site: Site) -> None:
        self.hazard = hazard
        self.site = site
        self.until = math.inf

    def at(self, x: float, y: float, time: float) -> Conditions:
        """Return the conditions that it adds to clear air at a place [m]; none up to its start."""
        raise NotImplementedError

    def picture(self, what: str, places: SitePoints, time: float) -> Floats | None:
        """Return a raster of a quantity that it adds, such as `water`; None if it adds none.

        Args:
            what: One of `QUANTITIES`; or `layer`, smoke as it is where it is thickest between
                floor and ceiling, where `smoke` is the mean of it.
            places: For which points.
            time: [s]
        """
        what = "smoke" if what == "layer" else what
        return (
            self._part(QUANTITIES[what].part, places, time) if what in self.hazard.shows else None
        )

    def is_hazy(self, time: float) -> bool:
        """Return True if anybody's sight is impaired at `time` [s]; fast, for cameras."""
        return "smoke" in self.hazard.shows and time > self.hazard.start

    def haze(self, places: SitePoints, time: float) -> Floats:
        """Return the extinction of light at places, at the height of a person's eyes [1/m]."""
        return self._part("extinction", places, time)

    def alarm(self, detector: str, x: float, y: float) -> DetectorAlarm:
        """Return a detector's response at a place [m], if the hazard begins at 0 and goes on."""
        return alarm_in(detector, lambda age: self.at(x, y, age))

    def _part(self, part: str, places: SitePoints, time: float) -> Floats:
        """Return one part of the conditions, point by point."""
        points = places.points.reshape(-1, 2).tolist()
        values = [getattr(self.at(x, y, time), part) for x, y in points]
        return np.array(values, float).reshape(places.spaces.shape)


class March:
    """The states of a field at growing ages, and the way from one to the next.

    Args:
        state: At age 0.
        step: Function from a state at an age [s] to the state `dt` [s] later; it has no side
            effects.
        paces: Until which age, in which steps [s].

    Attributes:
        hazy: True for states that impair sight, by number, as far as queried.
    """

    def __init__(self, state: Floats, step: Step, paces: Paces = PACES) -> None:
        self._step = step
        self.paces = paces
        self.ages = [0.0]
        self.states = [state]
        self.hazy: dict[int, bool] = {}

    def around(self, age: float) -> tuple[Floats, Floats, float]:
        """Return the states before and after an age [s], and the weight of the later one."""
        ages = self.ages
        after = self.after(age)
        weight = (age - ages[after - 1]) / (ages[after] - ages[after - 1])
        return self.states[after - 1], self.states[after], max(0.0, weight)

    def after(self, age: float) -> int:
        """Return the first state that is later than an age [s], from 1 on."""
        while self.ages[-1] <= age:
            self._advance()
        return bisect_right(self.ages, age, 1)

    def at(self, age: float) -> Floats:
        """Return the state at an age [s], between two steps on the straight line."""
        before, after, weight = self.around(age)
        between: Floats = before + weight * (after - before)
        return between

    def _advance(self) -> None:
        age = self.ages[-1]
        dt = next(step for until, step in self.paces if age < until)
        self.states.append(self._step(self.states[-1], age, dt))
        self.ages.append(age + dt)


class SolvedField(HazardField):
    """A field that is solved step by step: shared until the source stops, then this run's own.

    Attributes:
        room: Index of the space that it starts in, or `NOWHERE`.
    """

    def __init__(self, hazard: Hazard, site: Site) -> None:
        super().__init__(hazard, site)
        self.building = building_of(site)
        self.room = self.building.space_at(*hazard.position)
        self._start = hazard.start
        self._own: tuple[float, March] | None = None
        self._moment = math.nan, math.nan  # of the states that were asked for last
        self._states: tuple[Floats, Floats, float]

    def solve(self) -> tuple[March, Step]:
        """Return the states with the source, shared from age 0 on, and the step without it."""
        raise NotImplementedError

    @cached_property
    def _solved(self) -> tuple[March, Step]:
        return self.solve()

    def march(self, time: float) -> tuple[March, float]:
        """Return the march that holds the state at `time` [s], and the age in it [s]."""
        shared, step = self._solved
        start = self._start
        age = time - start
        stopped = self.until - start
        stopped = stopped if stopped > 0.0 else 0.0
        if age <= stopped:
            return shared, age
        if self._own is None or self._own[0] != stopped:
            self._own = stopped, March(shared.at(stopped), step, shared.paces)
        return self._own[1], age - stopped

    def states(self, time: float) -> tuple[Floats, Floats, float]:
        """Return the states before and after `time` [s], and the weight of the later one.

        Everybody asks at the same moments.
        """
        if (time, self.until) != self._moment:
            march, age = self.march(time)
            self._moment = (time, self.until)
            self._states = march.around(age)
        return self._states

    def state(self, time: float) -> Floats:
        """Return the state at `time` [s], between two steps on the straight line."""
        before, after, weight = self.states(time)
        between: Floats = before + weight * (after - before)
        return between


def detection_time(hazard: Hazard, detector: Detector, site: Site) -> float:
    """Return when a detector notices a hazard [s]; infinite if it does not within an hour."""
    return _first(hazard, [detector] if detector.kind in hazard.noticed_by() else [], site)[1]


def first_detection(hazard: Hazard, site: Site) -> tuple[Detector | None, float]:
    """Return the detector that notices a hazard first, and when [s]; None and infinity else."""
    return _first(hazard, [d for d in site.detectors if d.kind in hazard.noticed_by()], site)


def _first(
    hazard: Hazard, detectors: Sequence[Detector], site: Site
) -> tuple[Detector | None, float]:
    """Return the first detector that sounds, and when [s]; all are asked at growing ages."""
    best: tuple[Detector | None, float] = None, math.inf
    if not detectors:
        return best
    field = hazard.model_copy(update={"start": 0.0}).field(site)
    alarms = [(d, field.alarm(d.kind, d.x, d.y)) for d in detectors]
    best = min(((d, alarm.at_latest) for d, alarm in alarms), key=lambda entry: entry[1])
    for age, dt in _ages():
        if age >= best[1]:
            break
        sounding = [d for d, alarm in alarms if alarm.sounds(age, dt) and age >= alarm.reached]
        if sounding:
            best = sounding[0], age
            break
    return (best[0], hazard.start + best[1]) if best[1] < math.inf else (None, math.inf)


def _ages() -> Iterator[tuple[float, float]]:
    """Yield ages at which alarms are asked, and the time since the last one [s]: 2 % apart."""
    age = 0.0
    while age < LATEST:
        dt = float(max(1, round(0.02 * age)))
        age += dt
        yield age, dt
