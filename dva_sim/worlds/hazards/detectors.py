"""When detectors sound: what smoke, heat, gas, carbon monoxide or water they need.

References:
    R. L. Alpert, Fire Technology 8 (1972) 181: ceiling jets.
    G. Heskestad and R. G. Bill, Fire Safety Journal 14 (1988) 113: heat detectors, RTI.
    EN 50291-1:2018: alarm times of carbon monoxide alarms.

Which detector notices a hazard first, and when.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from dva_sim.worlds.hazards.building import Building, building_of
from dva_sim.worlds.hazards.field import AMBIENT, Hazard
from dva_sim.worlds.hazards.fire import HEAT_OF_COMBUSTION, RADIATIVE_FRACTION, SOOT_YIELD, Fire
from dva_sim.worlds.hazards.fire_field import DENSITY, HEAT_CAPACITY, SOOT_EXTINCTION, FireField
from dva_sim.worlds.hazards.flood import FloodField
from dva_sim.worlds.hazards.gas_leak import GasLeak
from dva_sim.worlds.hazards.gas_leak_field import LeakField
from dva_sim.worlds.hazards.registry import Field, field_of
from dva_sim.worlds.layout import Site
from dva_sim.worlds.line_of_sight import Sight
from dva_sim.worlds.site_parts import Detector

Floats = NDArray[np.float64]

LATEST = 3600.0  # what is not noticed within an hour is not noticed by detectors [s]

# Smoke: an optical density of 0.14 per metre, the usual value for modelling; measured alarms
# scatter widely around it (J. A. Geiman and D. T. Gottuk, Fire Safety Science 7 (2003) 197).
SMOKE_ALARM = 0.14 * math.log(10.0)  # [1/m]
SMOKE_LAYER = 0.1  # so thick must a layer be to reach into a detector [m]; assumed
ENTRY_LENGTH = 1.8  # smoke enters a detector after the jet has gone so far [m]; assumed

HEAT_ALARM = 58.0  # rating of a heat detector [deg C]
RTI = 50.0  # its response time index [(m s)^0.5]; assumed: a quick one

WATER_ALARM = 5e-3  # [m]


# --- ceiling jets ----------------------------------------------------------------------
def jet_warmth(heat: Floats, distance: float, ceiling: float) -> Floats:
    """Excess temperature of a fire's ceiling jet [K].

    Args:
        heat: Heat release [kW].
        distance: Of the detector from the fire's axis [m].
        ceiling: Height [m].
    """
    if distance <= 0.18 * ceiling:
        return np.asarray(16.9 * heat ** (2 / 3) / ceiling ** (5 / 3))
    return np.asarray(5.38 * (heat / distance) ** (2 / 3) / ceiling)


def jet_speed(heat: Floats, distance: float, ceiling: float) -> Floats:
    """Speed of the same jet [m/s]."""
    if distance <= 0.15 * ceiling:
        return np.asarray(0.96 * np.cbrt(heat / ceiling))
    return np.asarray(0.195 * np.cbrt(heat) * ceiling**0.5 / distance ** (5 / 6))


def jet_lag(heat: Floats, distance: float, ceiling: float) -> Floats:
    """How long the jet needs to the detector [s]: up the plume, then outwards at its speed."""
    near = 0.15 * ceiling
    up = ceiling / jet_speed(heat, 0.0, ceiling)
    if distance <= near:
        return np.asarray(up + distance / jet_speed(heat, 0.0, ceiling))
    outwards = 6.0 / 11.0 * (distance ** (11 / 6) - near ** (11 / 6))
    per_length = 1.0 / (0.195 * np.cbrt(heat) * ceiling**0.5)
    return np.asarray(up + near / jet_speed(heat, 0.0, ceiling) + outwards * per_length)


def jet_smoke(warmth: Floats) -> Floats:
    """Extinction in a ceiling jet [1/m]: soot is thinned on its way just as heat is."""
    soot_per_heat = SOOT_YIELD / HEAT_OF_COMBUSTION / (1.0 - RADIATIVE_FRACTION)  # [kg/kJ]
    return np.asarray(SOOT_EXTINCTION * soot_per_heat * DENSITY * HEAT_CAPACITY * warmth)


@lru_cache(maxsize=16)
def _burning(fire: Fire) -> tuple[Floats, Floats]:
    """Ages [s] and the heat released then [kW]."""
    ages = np.arange(1.0, LATEST)
    return ages, np.array([max(1e-6, fire.heat_release(fire.start + age)) for age in ages.tolist()])


def smoke_in_jet(fire: Fire, distance: float, ceiling: float) -> tuple[float, float]:
    """Age of a fire when its ceiling jet reaches a smoke detector in its room [s].

    Returns:
        The age when any smoke is in it, and the one when the jet by itself sets it off.
    """
    ages, heat = _burning(fire)
    enough = jet_smoke(jet_warmth(heat, distance, ceiling)) >= SMOKE_ALARM
    entry = ENTRY_LENGTH / jet_speed(heat, distance, ceiling)
    sounds = ages + jet_lag(heat, distance, ceiling) + entry
    return float(sounds.min()), float(sounds[enough].min(initial=math.inf))


def heat_in_jet(fire: Fire, distance: float, ceiling: float) -> float:
    """Age of a fire when its ceiling jet sets off a heat detector in its room [s]."""
    ages, heat = _burning(fire)
    warmth = jet_warmth(heat, distance, ceiling)
    share = -np.expm1(-np.sqrt(jet_speed(heat, distance, ceiling)) / RTI)  # of a second's gap
    link = 0.0
    for age, air, taken in zip(ages.tolist(), warmth.tolist(), share.tolist(), strict=True):
        link += taken * (air - link)
        if link >= HEAT_ALARM - AMBIENT:
            return float(age)
    return math.inf


# --- carbon monoxide -------------------------------------------------------------------

# The standard gives four conditions: no alarm within 120 min at 30 ppm, alarms after 60 to 90
# min at 50 ppm, 10 to 40 min at 100 ppm, and within 3 min at 300 ppm. A dose rule
# (c - HARMLESS)^POWER dt with an alarm at DOSE has three parameters:
HARMLESS = 30.0  # the dose does not grow there, as at 30 ppm [ppm]
_AT_50 = math.sqrt(60.0 * 90.0)  # the middle of the band at 50 ppm, by ratio [min]
# 100 ppm sound within 40 min and 300 ppm within 3 min above the first power, and 100 ppm not
# before 10 min below the second; the middle of the two is taken.
POWER = 0.5 * (
    max(
        math.log(_AT_50 / 40.0) / math.log(70.0 / 20.0),
        math.log(_AT_50 / 3.0) / math.log(270.0 / 20.0),
    )
    + math.log(_AT_50 / 10.0) / math.log(70.0 / 20.0)
)
DOSE = 60.0 * _AT_50 * (50.0 - HARMLESS) ** POWER  # [ppm^POWER s]


class CoAlarm:
    """A domestic carbon monoxide alarm: it sums up what is above 30 ppm, and forgets below.

    Its three parameters follow from the alarm times that EN 50291 prescribes: it keeps them by
    construction. How fast it forgets is assumed: as fast as it learns.
    """

    def __init__(self) -> None:
        self._dose = 0.0

    def add(self, ppm: float, dt: float) -> bool:
        """Take in the air of the last `dt` [s]; whether it sounds."""
        excess = ppm - HARMLESS
        rate = math.copysign(abs(excess) ** POWER, excess)
        self._dose = max(0.0, self._dose + rate * dt)
        return bool(self._dose >= DOSE)


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
