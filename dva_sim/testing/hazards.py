"""Checks of hazards, in the rooms of a site from the start to two hours later."""

from __future__ import annotations

import math
import re
import time
from collections.abc import Callable, Iterator, Mapping
from typing import Any, Final

import numpy as np

from dva_sim.testing.promises import Case, Outcome, broken_in, is_slow, kept, part_by_part
from dva_sim.worlds.hazards import (
    CLEAR,
    PLUGINS,
    QUANTITIES,
    Conditions,
    Dose,
    Hazard,
    HazardField,
    SitePoints,
    building_of,
    detection_time,
)
from dva_sim.worlds.hazards.detectors import DETECTORS
from dva_sim.worlds.site import Site, load_site
from dva_sim.worlds.site_parts import Detector

Point = tuple[float, float]
Make = Callable[[Point, float], Hazard]

SITE: Final = "caparica"
SOURCE: Final = (19.0, 22.5)  # place in its chemistry lab, whose door opens on a corridor [m]
NEARBY_PLACES: Final = (
    (19.5, 22.5),
    (21.0, 22.5),
    (16.0, 19.0),
    (13.1, 22.0),
    (20.0, 12.0),
    (19.0, 15.6),
)
DISTANT_PLACE: Final = (10_000.0, 10_000.0)  # place far from any hazard [m]
START: Final = 50.0  # start of the hazard [s]
AGES: Final = (0.5, 2.0, 7.0, 20.0, 60.0, 200.0, 601.0, 1800.0, 7200.0)  # ages of the hazard [s]
TINY: Final = 1e-9  # age at which nothing has happened yet [s]
NOTHING: Final = 1e-3  # radius [m] or severity that counts as none
LATER: Final = 640.0  # delay of a start that must not change anything but time [s]
STOPPED: Final = 200.0  # age at which its source is stopped [s]
CLOSE: Final = 1e-6  # relative difference by rounding
SLOW: Final = 1e-3  # time of an answer above which an episode is slow [s]
SLOW_PICTURE: Final = 0.5  # the same for a picture [s]
CELL: Final = 1.0  # side of a cell of a picture [m]

# What a part is measured in is larger than this nowhere on earth.
EXTREME: Final = Conditions(
    temperature=3000.0, heat_flux=1e4, extinction=1e4, co=1e6, gas=1.0, water=100.0, explosive=1e3
)


def check_hazard(
    hazard: str | Callable[..., Hazard],
    options: Mapping[str, Any] | None = None,
    *,
    slow: float = SLOW,
) -> Outcome:
    """See that a hazard keeps what every hazard promises, by itself and on a site.

    Args:
        hazard: Name, as in a scenario, or its class.
        options: Keyword arguments of its constructor, besides place and start.
        slow: An answer that takes longer on the average earns a warning [s].

    Raises:
        BrokenPromises: it does not; a line for each promise.
        ConfigError: there is none of that name, or it cannot be made with these options.
    """
    make = PLUGINS.load(hazard, options)
    make(SOURCE, START)
    trial = _Trial(make, load_site(SITE), np.random.default_rng(1))
    broken = broken_in(part_by_part(trial.parts))
    return kept(broken, [] if broken else list(trial.doubts(slow)), trial.asked, trial.mean)


class _Trial:
    """All that is tried with one hazard.

    Attributes:
        asked: Number of queries to the field.
        mean: Mean time of an answer [s].
    """

    def __init__(self, make: Make, site: Site, rng: np.random.Generator) -> None:
        self._make = make
        self._site = site
        self._rng = rng
        self.asked = 0
        self.mean = 0.0
        self._picture = 0.0
        self.parts = (self._texts, self._sizes, self._air, self._repeats, self._stops, self._sight,
                      self._pictures, self._detectors, self._doses)  # fmt: skip

    def _hazard(self, later: float = 0.0) -> Hazard:
        return self._make(SOURCE, START + later)

    def _field(self) -> HazardField:
        return self._hazard().field(self._site)

    # --- by itself ---------------------------------------------------------------------

    def _texts(self) -> Iterator[Case]:
        """Check the texts that people and files get."""
        hazard = self._hazard()
        if not hazard.title:
            yield "has no title", "title is empty"
        if not re.fullmatch("#[0-9a-f]{6}", hazard.colour):
            yield "has no colour", f"{hazard.colour!r} should be like #d1332e"
        if hazard.contained_by not in ("valve", "extinguisher"):
            yield "is dealt with by what nobody has", repr(hazard.contained_by)
        if hazard.position != SOURCE or hazard.start != START:
            yield "is not where or when it was put", f"{hazard.position}, {hazard.start:g} s"
        settings = hazard.model_dump(mode="json")
        settings.pop("position", None)
        again = type(hazard)(SOURCE, settings.pop("start"), **settings)
        if again != hazard:
            yield "is not the same from its own settings", repr(again)

    def _sizes(self) -> Iterator[Case]:
        """Yield the radii and severity: numbers that grow from nothing, whenever it begins."""
        hazard = self._hazard()
        later = self._hazard(LATER)
        fresh = self._hazard()
        for name, most in (("radius", 1e3), ("danger_radius", 1e3), ("severity", 1.0)):
            sizes = [getattr(hazard, name)(START + age) for age in AGES]
            for age, size in zip(AGES, sizes, strict=True):
                if not 0.0 <= size <= most:
                    yield f"has a {name} that is none", f"{size:g} after {age:g} s"
            if any(getattr(hazard, name)(when) != 0.0 for when in (0.0, START - TINY)):
                yield f"has a {name} before it begins", f"start {START:g} s"
            if name != "danger_radius" and getattr(hazard, name)(START + TINY) > NOTHING:
                yield f"does not grow its {name} from nothing", f"after {TINY:g} s"
            if not _alike([getattr(later, name)(START + LATER + age) for age in AGES], sizes):
                yield "goes otherwise when it begins later", name
            if [getattr(fresh, name)(START + age) for age in AGES[::-1]][::-1] != sizes:
                yield "answers differently in another order, or at random", name

    # --- on a site ---------------------------------------------------------------------

    def _answers(self, field: HazardField, order: list[int] | None = None) -> list[Conditions]:
        """Return the air at all places and ages, queried in any order, returned in a fixed one."""
        queries = [(*place, START + age) for age in AGES for place in NEARBY_PLACES]
        order = order or list(range(len(queries)))
        began = time.perf_counter()
        answers = {number: field.at(*queries[number]) for number in order}
        self.mean = (time.perf_counter() - began) / len(queries)
        self.asked += len(queries)
        return [answers[number] for number in range(len(queries))]

    def _air(self) -> Iterator[Case]:
        """Yield numbers that air can have, where it is and nowhere else."""
        field = self._field()
        for before in (0.0, START):
            if any(field.at(*place, before) != CLEAR for place in NEARBY_PLACES):
                yield "changes the air before it begins", f"at {before:g} s, start {START:g} s"
        for age in AGES:
            for place in NEARBY_PLACES:
                yield from _odd(field.at(*place, START + age), f"{age:g} s, {place}")
            if field.at(*DISTANT_PLACE, START + age) != CLEAR:
                yield "changes the air ten kilometres away", f"after {age:g} s"

    def _repeats(self) -> Iterator[Case]:
        """Check that another field, another order or a later start gives the same answers."""
        answers = self._answers(self._field())
        if self._answers(self._field()) != answers:
            yield "draws random numbers, or shares memory", "a new field answers differently"
        shuffled = self._rng.permutation(len(answers)).tolist()
        if self._answers(self._field(), shuffled) != answers:
            yield "answers differently in another order", "asked in a random order"
        later = self._hazard(LATER).field(self._site)
        moved = [later.at(*place, START + LATER + age) for age in AGES for place in NEARBY_PLACES]
        if not all(_alike(a, b) for a, b in zip(moved, answers, strict=True)):
            yield "goes otherwise when it begins later", "the air"

    def _stops(self) -> Iterator[Case]:
        """Yield cases in which a stopped source changes nothing before, and worsens nothing."""
        whole = self._field()
        stopped = self._field()
        stopped.until = START + STOPPED
        for age in AGES:
            for place in NEARBY_PLACES:
                free, frozen = (f.at(*place, START + age) for f in (whole, stopped))
                if age < STOPPED and not _alike(free, frozen):
                    yield "is changed before its source is stopped", f"{age:g} s, {place}"
                yield from _odd(frozen, f"stopped, {age:g} s, {place}")
        end = START + AGES[-1]
        if any(
            stopped.at(*p, end).heat_flux > whole.at(*p, end).heat_flux + 1.0 for p in NEARBY_PLACES
        ):
            yield "radiates more once its source is stopped", f"after {AGES[-1]:g} s"

    def _sight(self) -> Iterator[Case]:
        """Check that sight is limited by the extinction at eye height."""
        field = self._field()
        building = building_of(self._site)
        places = SitePoints(building, np.array(NEARBY_PLACES))
        for age in AGES:
            air = [field.at(*place, START + age).extinction for place in NEARBY_PLACES]
            if not field.is_hazy(START + age):
                if max(air) > 0.0:
                    yield "is not hazy where light is lost", f"{max(air):g} /m after {age:g} s"
            elif not _alike(field.haze(places, START + age).tolist(), air):
                yield "hides otherwise than its air says", f"after {age:g} s"

    def _pictures(self) -> Iterator[Case]:
        """Yield mistakes of rasters: one for each shown quantity, empty up to the beginning."""
        field = self._field()
        west, south, east, north = self._site.extent
        x = np.arange(west, east, CELL)
        y = np.arange(south, north, CELL)
        places = SitePoints(building_of(self._site), np.stack(np.meshgrid(x, y), axis=2))
        for what in (*QUANTITIES, "layer"):
            is_shown = ("smoke" if what == "layer" else what) in self._hazard().shows
            for when in (START, START + 20.0, START + 601.0):
                began = time.perf_counter()
                values = field.picture(what, places, when)
                self._picture = max(self._picture, time.perf_counter() - began)
                if values is None:
                    if is_shown:
                        yield "has no picture of what it shows", what
                    continue
                if values.shape != places.spaces.shape:
                    yield "has a picture of another shape", f"{what}: {values.shape}"
                elif not (np.isfinite(values).all() and values.min() >= 0.0):
                    yield "has a picture with values that are none", f"{what}, {when:g} s"
                elif when <= START and values.max() > 0.0:
                    yield "shows something before it begins", what

    def _detectors(self) -> Iterator[Case]:
        """Yield detectors of kinds that there are, which notice it whenever it begins."""
        hazard = self._hazard()
        later = self._hazard(LATER)
        for kind in dict.fromkeys((*hazard.detectors, *hazard.noticed_by())):
            if kind not in DETECTORS:
                yield "is noticed by what does not exist", f"{kind!r}: {', '.join(DETECTORS)}"
                continue
            detector = Detector("trial", kind, 20.0, 22.5)
            when = detection_time(hazard, detector, self._site)
            if when < START:
                yield "is noticed before it begins", f"{kind}, {when:g} s"
            if not _alike([detection_time(later, detector, self._site)], [when + LATER]):
                yield "goes otherwise when it begins later", f"its {kind} alarm"

    def _doses(self) -> Iterator[Case]:
        """Check that the dose of a person who stays is finite and never falls."""
        field = self._field()
        for place in NEARBY_PLACES:
            dose = Dose()
            last = 0.0
            for age in AGES:
                dose.add(field.at(*place, START + age), 1.0)
                if not math.isfinite(dose.heat + dose.toxic) or dose.heat + dose.toxic < last:
                    yield "gives a dose that is none", f"{dose} at {place} after {age:g} s"
                    break
                last = dose.heat + dose.toxic

    def doubts(self, slow: float) -> Iterator[str]:
        """Yield warnings about allowed but unlikely behaviour."""
        yield from is_slow(self.mean, slow, "an answer")
        if self._picture > SLOW_PICTURE * slow / SLOW:
            yield f"draws slowly: {self._picture:.2g} s a picture; picture() may be defined"
        if not self._hazard().noticed_by():
            yield "is noticed by no detector: somebody has to report it"


def _odd(air: Conditions, where: str) -> Iterator[Case]:
    """Yield physically impossible conditions."""
    for name, value, most in zip(air._fields, air, EXTREME, strict=True):
        least = CLEAR.temperature if name == "temperature" else 0.0
        if not least <= value <= most:
            yield f"makes air with a {name} that is none", f"{value:g} at {where}"


def _alike(one: object, other: object) -> bool:
    """Return True if numbers are equal up to rounding."""
    return bool(np.allclose(np.array(one), np.array(other), rtol=CLOSE, atol=1e-9, equal_nan=True))
