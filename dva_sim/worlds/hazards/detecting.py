"""Which detector notices a hazard first, and when."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import lru_cache

from dva_sim.worlds.hazards.alarms import (
    HEAT_ALARM,
    LATEST,
    SMOKE_ALARM,
    SMOKE_LAYER,
    WATER_ALARM,
    CoAlarm,
    heat_in_jet,
    smoke_in_jet,
)
from dva_sim.worlds.hazards.base import Hazard
from dva_sim.worlds.hazards.building import Building, building_of
from dva_sim.worlds.hazards.fields import Field, field_of
from dva_sim.worlds.hazards.fire import Fire
from dva_sim.worlds.hazards.fire_field import FireField
from dva_sim.worlds.hazards.flood_field import FloodField
from dva_sim.worlds.hazards.leak import GasLeak
from dva_sim.worlds.hazards.leak_field import LeakField
from dva_sim.worlds.layout import Site
from dva_sim.worlds.parts import Detector
from dva_sim.worlds.sight import Sight

# Whether an alarm sounds at an age [s], so long after it was last asked [s].
Alarm = Callable[[float, float], bool]

NO_JET = (0.0, math.inf)  # in another room there is only the layer

# Kinds of detector that notice a kind of event.
DETECTS = {"fire": ("smoke", "heat", "co"), "gas_leak": ("gas",), "flood": ("water",)}


def noticed_by(hazard: Hazard) -> tuple[str, ...]:
    """Kinds of detector that notice a hazard."""
    if isinstance(hazard, Fire):
        return DETECTS["fire"]
    if isinstance(hazard, GasLeak):
        return ("co",) if hazard.gas == "carbon_monoxide" else DETECTS["gas_leak"]
    return DETECTS["flood"]


def detection_time(hazard: Hazard, detector: Detector, site: Site) -> float:
    """When a detector notices a hazard [s]; infinite if it does not within an hour."""
    return _first(hazard, [detector] if detector.kind in noticed_by(hazard) else [], site)[1]


def first_detection(hazard: Hazard, site: Site) -> tuple[Detector | None, float]:
    """The detector that notices a hazard first, and when [s]; None and infinity if none does."""
    return _first(hazard, [d for d in site.detectors if d.kind in noticed_by(hazard)], site)


def _first(
    hazard: Hazard, detectors: Sequence[Detector], site: Site
) -> tuple[Detector | None, float]:
    """All detectors are asked at growing ages until one sounds."""
    best: tuple[Detector | None, float] = None, math.inf
    if not detectors:
        return best
    building = building_of(site)
    young = replace(hazard, start=0.0)  # type: ignore[type-var]
    jets = [_by_jet(young, d, site) if isinstance(young, Fire) else NO_JET for d in detectors]
    best = min(
        ((d, sounds) for d, (_, sounds) in zip(detectors, jets, strict=True)),
        key=lambda found: found[1],
    )
    field = field_of(young, building, Sight(site.walls))
    alarms = [
        (d, _alarm(d, field, building), jet[0]) for d, jet in zip(detectors, jets, strict=True)
    ]
    for age, dt in _ages():
        if age >= best[1]:
            break
        sounding = [d for d, sounds, reached in alarms if sounds(age, dt) and age >= reached]
        if sounding:
            best = sounding[0], age
            break
    return (best[0], hazard.start + best[1]) if best[1] < math.inf else (None, math.inf)


def _ages() -> Iterator[tuple[float, float]]:
    """Ages at which alarms are asked, and the time since the last one [s]: 2 % apart."""
    age = 0.0
    while age < LATEST:
        dt = float(max(1, round(0.02 * age)))
        age += dt
        yield age, dt


def _by_jet(fire: Fire, detector: Detector, site: Site) -> tuple[float, float]:
    """Ages at which the ceiling jet of a fire reaches a detector, and sets it off [s]."""
    room = site.compartment_at(*fire.position)
    if room is None or site.compartment_at(detector.x, detector.y) != room:
        return NO_JET
    gap = round(math.dist(fire.position, (detector.x, detector.y)), 2)
    return _jet(detector.kind, fire.growth, fire.peak, gap, site.compartments[room].ceiling)


@lru_cache(maxsize=4096)
def _jet(kind: str, growth: str, peak: float, gap: float, ceiling: float) -> tuple[float, float]:
    fire = Fire((0.0, 0.0), 0.0, growth, peak)
    reached, sounds = smoke_in_jet(fire, gap, ceiling)
    if kind == "heat":
        sounds = heat_in_jet(fire, gap, ceiling)
    return reached, math.inf if kind == "co" else sounds


def _alarm(detector: Detector, field: Field, building: Building) -> Alarm:
    """What a detector makes of a field whose hazard starts at 0."""
    x, y = detector.x, detector.y
    if isinstance(field, FloodField):
        return lambda age, dt: field.at(x, y, age).water >= WATER_ALARM
    if isinstance(field, LeakField):
        return _in_gas(detector.kind, field.seen_from(x, y), field.limits.alarm)
    return _in_layer(detector.kind, field, building.space_at(x, y))


def _in_gas(kind: str, share: Callable[[float], float], alarm: float) -> Alarm:
    """A detector that knows the share of gas around it at each age [s]."""
    if kind == "gas":
        return lambda age, dt: share(age) >= alarm
    carbon_monoxide = CoAlarm()
    return lambda age, dt: carbon_monoxide.add(1e6 * share(age), dt)


def _in_layer(kind: str, field: FireField, space: int) -> Alarm:
    """A detector under a ceiling, where smoke gathers."""
    carbon_monoxide = CoAlarm()

    def sounds(age: float, dt: float) -> bool:
        layer = field.layer(space, age) if space >= 0 else None
        if layer is None or layer.depth < SMOKE_LAYER:
            return False
        if kind == "smoke":
            return layer.extinction >= SMOKE_ALARM
        if kind == "heat":
            return layer.temperature >= HEAT_ALARM
        return carbon_monoxide.add(layer.co, dt)

    return sounds
