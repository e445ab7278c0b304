"""Fires: the heat they release, what radiates of it, the smoke they make, and who notices it.

References:
    R. L. Alpert, Fire Technology 8 (1972) 181: ceiling jets.
    G. Heskestad and R. G. Bill, Fire Safety Journal 14 (1988) 113: heat detectors, RTI.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, Annotated, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator
from typing_extensions import override

from dva_sim.worlds.hazards.building import NO_SPACE, Building, Floats, SitePoints
from dva_sim.worlds.hazards.conditions import (
    AMBIENT,
    BREATHING_HEIGHT,
    CLEAR,
    Conditions,
    make_conditions,
)
from dva_sim.worlds.hazards.detectors import (
    HEAT_ALARM,
    LATEST,
    SMOKE_ALARM,
    SMOKE_LAYER,
    DetectorAlarm,
    alarm_in,
)
from dva_sim.worlds.hazards.hazard import Hazard, March, Point, SolvedField, Step
from dva_sim.worlds.hazards.smoke import (
    CO_RATIO,
    DENSITY,
    HEAT_CAPACITY,
    HEAT_OF_COMBUSTION,
    KELVIN,
    RADIATIVE_FRACTION,
    SOOT,
    SOOT_EXTINCTION,
    SOOT_YIELD,
    SmokeLayers,
    volumes,
)
from dva_sim.worlds.line_of_sight import Sight
from dva_sim.worlds.site import Site

if TYPE_CHECKING:
    from dva_sim.worlds.camera.sprites import Sprite

FULL_GROWTH_KW = 1055.0  # heat release that defines the growth classes [kW]
GROWTH_S = {"slow": 600.0, "medium": 300.0, "fast": 150.0, "ultrafast": 75.0}
HEAT_PER_AREA = 500.0  # heat release of burning floor [kW/m^2]; assumed, offices: 150 to 650
FIRE_LOAD = 420e3  # mean fuel load of an office [kJ/m^2]
DECAY_FROM = 0.7  # share of the fuel burnt when the fire begins to die down
MAX_PEAK_KW = 100e3  # upper bound, beyond any building and the range of the model [kW]; assumed
PEAK_KW = 5000.0  # heat released by air through one door, 1500 A sqrt(H) for 1.1 m x 2.1 m [kW]

TENABLE_HEAT = 2.5  # radiant heat that skin bears for a long time [kW/m^2]
MIN_DANGER = 2.0  # minimum dangerous distance from flames [m]; assumed
FLAME_RATE = 8.0  # flicker rate of flames before a camera [1/s]


def largest_peak(growth: str) -> float:
    """Heat release at which a growing fire has burnt all fuel of the floor it is on [kW].

    Growing for a time t to a peak Q burns Q t / 3 on Q / `HEAT_PER_AREA` of floor.
    """
    return FULL_GROWTH_KW * (3.0 * FIRE_LOAD / HEAT_PER_AREA / GROWTH_S[growth]) ** 2


class Fire(Hazard):
    """A fire that grows with the square of time, burns steadily, and dies down for want of fuel.

    Attributes:
        growth: `slow`, `medium`, `fast` or `ultrafast`.
        peak: The most heat it releases [kW].

    References:
        NFPA 72, annex B: 1055 kW after 600, 300, 150 and 75 s.
        EN 1991-1-2:2002, annex E: 420 MJ/m^2 (office, mean), linear decay once 70 % of the
        fuel is burnt.
        C. Hopkin, M. Spearpoint and D. Hopkin, Fire Technology 55 (2019) 1599: 150 to
        650 kW/m^2 in offices.
        K. Kawagoe, Fire behaviour in rooms, BRI report 27, Tokyo 1958: air through an opening.
    """

    reported_as = "fire"
    title = "fire"
    detectors = ("smoke", "heat", "co")
    shows = ("smoke", "heat")
    colour = "#d1332e"
    mark = "*"
    shines = True
    contained_by = "extinguisher"

    growth: Literal["slow", "medium", "fast", "ultrafast"] = "medium"
    peak: Annotated[float, Field(gt=0, le=MAX_PEAK_KW)] = PEAK_KW

    @model_validator(mode="after")
    def _has_the_fuel(self) -> Fire:
        most = largest_peak(self.growth)
        if self.peak > most:
            problem = f"peak {self.peak:g} kW of a {self.growth} fire is too large"
            raise ValueError(f"{problem}: its fuel lasts to {most:.0f}")
        return self

    def heat_release(self, time: float) -> float:
        """Return the heat release at `time` [s], in [kW]."""
        age = time - self.start
        age = age if age > 0.0 else 0.0
        heat = FULL_GROWTH_KW * (age / GROWTH_S[self.growth]) ** 2
        return heat if heat < self.peak else self._grown(age)

    def _grown(self, age: float) -> float:
        """Return the heat release once the peak is reached [kW]."""
        growing = GROWTH_S[self.growth] * math.sqrt(self.peak / FULL_GROWTH_KW)
        fuel = FIRE_LOAD * self.peak / HEAT_PER_AREA
        steady = max(0.0, DECAY_FROM * fuel / self.peak - growing / 3.0)  # growing burns a third
        left = fuel / self.peak - growing / 3.0 - steady  # of burning at the peak [s]
        decaying = 2.0 * max(left, 1.0)  # a triangle
        return self.peak * min(1.0, max(0.0, 1.0 - (age - growing - steady) / decaying))

    def heat_flux(self, time: float, point: Point) -> float:
        """Return the radiant heat at a place [m] in free sight of the fire, in [kW/m^2].

        References:
            Point-source model: SFPE Handbook of Fire Protection Engineering, 5th ed., chapter 66.
        """
        radiated = RADIATIVE_FRACTION * self.heat_release(time)
        return _radiant(radiated, math.dist(self.position, point), self.radius(time))

    @override
    def radius(self, time: float) -> float:
        # Radius of the burning floor.
        return math.sqrt(self.heat_release(time) / HEAT_PER_AREA / math.pi)

    def danger_radius(self, time: float) -> float:
        """See `Hazard`: where radiant heat exceeds 2.5 kW/m^2, and never less than 2 m.

        References:
            ISO 13571:2012: 2.5 kW/m^2 is the limit of tenability for radiant heat.
        """
        if time < self.start:
            return 0.0
        radiated = RADIATIVE_FRACTION * self.heat_release(time)
        return max(MIN_DANGER, math.sqrt(radiated / (4.0 * math.pi * TENABLE_HEAT)))

    @override
    def severity(self, time: float) -> float:
        # Heat release, of the 1055 kW that define the growth classes.
        return min(1.0, self.heat_release(time) / FULL_GROWTH_KW)

    @override
    def field(self, site: Site) -> FireField:
        return FireField(self, site)

    def sprite(self, time: float, ceiling: float) -> Sprite | None:
        """See `Hazard`: flames as wide as what burns, as high as its heat makes them.

        References:
            G. Heskestad, Fire Safety Journal 5 (1983) 103-108: L = 0.235 Q^(2/5) - 1.02 D, with
            the heat release Q [kW] and the diameter D [m].
        """
        from dva_sim.worlds.camera.sprites import FLAME_FRAMES, flames  # late: start-up

        radius = self.radius(time)
        tall = 0.235 * self.heat_release(time) ** 0.4 - 2.04 * radius
        # Tongues leap higher than the mean; the smallest fire can still be seen.
        size = max(0.45, 2.2 * radius), min(ceiling, max(0.45, 1.25 * tall))
        frame = int(time * FLAME_RATE + 3 * self.position[0]) % FLAME_FRAMES
        return flames(frame)._replace(size=size)

    @override
    def light(self, time: float) -> float:
        return min(1.0, 0.35 + self.radius(time))


# --- ceiling jets ----------------------------------------------------------------------
ENTRY_LENGTH = 1.8  # path of the jet until smoke enters a detector [m]; assumed
RTI = 50.0  # response time index of a detector [(m s)^0.5]; assumed: a quick one
NO_JET = (0.0, math.inf)  # values for another room, where there is only the layer


def jet_warmth(heat: Floats, distance: float, ceiling: float) -> Floats:
    """Return excess temperature of a fire's ceiling jet [K].

    Args:
        heat: Heat release [kW].
        distance: Distance of the detector from the fire's axis [m].
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
    """Return the delay of the ceiling jet [s]: up the plume, then outwards at its speed."""
    near = 0.15 * ceiling
    up = ceiling / jet_speed(heat, 0.0, ceiling)
    if distance <= near:
        return np.asarray(up + distance / jet_speed(heat, 0.0, ceiling))
    outwards = 6.0 / 11.0 * (distance ** (11 / 6) - near ** (11 / 6))
    per_length = 1.0 / (0.195 * np.cbrt(heat) * ceiling**0.5)
    return np.asarray(up + near / jet_speed(heat, 0.0, ceiling) + outwards * per_length)


def jet_smoke(warmth: Floats) -> Floats:
    """Return the extinction in a ceiling jet [1/m]: soot is thinned on its way just as heat is."""
    soot_per_heat = SOOT_YIELD / HEAT_OF_COMBUSTION / (1.0 - RADIATIVE_FRACTION)  # [kg/kJ]
    return np.asarray(SOOT_EXTINCTION * soot_per_heat * DENSITY * HEAT_CAPACITY * warmth)


@lru_cache(maxsize=16)
def _burning(fire: Fire) -> tuple[Floats, Floats]:
    """Return ages [s] and the heat released then [kW]."""
    ages = np.arange(1.0, LATEST)
    return ages, np.array([max(1e-6, fire.heat_release(fire.start + age)) for age in ages.tolist()])


def smoke_in_jet(fire: Fire, distance: float, ceiling: float) -> tuple[float, float]:
    """Return the age of a fire when its ceiling jet reaches a smoke detector in its room [s].

    Returns:
        The age when any smoke is in it, and the one when the jet by itself sets it off.
    """
    ages, heat = _burning(fire)
    enough = jet_smoke(jet_warmth(heat, distance, ceiling)) >= SMOKE_ALARM
    entry = ENTRY_LENGTH / jet_speed(heat, distance, ceiling)
    sounds = ages + jet_lag(heat, distance, ceiling) + entry
    return float(sounds.min()), float(sounds[enough].min(initial=math.inf))


def heat_in_jet(fire: Fire, distance: float, ceiling: float) -> float:
    """Return the age of a fire when its ceiling jet sets off a heat detector in its room [s]."""
    ages, heat = _burning(fire)
    warmth = jet_warmth(heat, distance, ceiling)
    share = -np.expm1(-np.sqrt(jet_speed(heat, distance, ceiling)) / RTI)  # of a second's gap
    link = 0.0
    for age, air, taken in zip(ages.tolist(), warmth.tolist(), share.tolist(), strict=True):
        link += taken * (air - link)
        if link >= HEAT_ALARM - AMBIENT:
            return float(age)
    return math.inf


@lru_cache(maxsize=4096)
def _jet(kind: str, growth: str, peak: float, gap: float, ceiling: float) -> tuple[float, float]:
    fire = _find_fire(growth, peak)
    reached, sounds = smoke_in_jet(fire, gap, ceiling)
    if kind == "heat":
        sounds = heat_in_jet(fire, gap, ceiling)
    return reached, math.inf if kind == "co" else sounds


# --- on a site -------------------------------------------------------------------------
BLUR = 0.3  # thickness of the lower face of a smoke layer [m]; assumed
RADIATION = 5.67e-11  # Stefan-Boltzmann constant [kW/m^2/K^4]
SMOKE_PACES = ((math.inf, 1.0),)  # longest step, as layers would oscillate in longer ones


class Layer(NamedTuple):
    """Smoke layer under a ceiling: lower face and thickness [m], [deg C], [1/m], CO [ppm]."""

    bottom: float
    depth: float
    temperature: float
    extinction: float
    co: float


@lru_cache(maxsize=32)
def _smoke(building: Building, growth: str, peak: float, room: int) -> tuple[March, Step]:
    smoke = SmokeLayers(building.spaces, _find_fire(growth, peak).heat_release, room)
    return March(smoke.empty(), smoke.step, SMOKE_PACES), smoke.step_without_fire


def _find_fire(growth: str, peak: float) -> Fire:
    """Return the fire of a growth and peak, shared by all fires that grow alike."""
    return Fire.model_construct(position=(0.0, 0.0), start=0.0, growth=growth, peak=peak)


class FireField(SolvedField):
    """Radiant heat of a fire, and its smoke.

    Args:
        site: Site, whose walls hide the flames.
    """

    def __init__(self, fire: Fire, site: Site) -> None:
        super().__init__(fire, site)
        self._sight = Sight(site.walls)
        self._fire = fire
        self._seen: tuple[SitePoints, NDArray[np.bool_]] | None = None
        self._flames = lru_cache(1)(
            lambda time: (RADIATIVE_FRACTION * fire.heat_release(time), fire.radius(time))
        )
        self._layers: dict[int, Layer | None] = {}  # at the moment that was asked for last
        self._layers_at = math.nan, math.nan

    @override
    def at(self, x: float, y: float, time: float) -> Conditions:
        if time < self._fire.start:
            return CLEAR
        heat = 0.0
        if time < self.until and self._sight.between((x, y), self._fire.position):
            radiated, radius = self._flames(time)
            heat = _radiant(radiated, math.dist(self._fire.position, (x, y)), radius)
        space = self.building.space_at(x, y)
        layer = self.layer(space, time) if space >= 0 else None
        if layer is None:
            return Conditions(AMBIENT, heat)
        heat += _glow(layer.temperature, layer.extinction * layer.depth)
        # How far breathing height lies within the layer, 0 to 1.
        share = min(1.0, max(0.0, (BREATHING_HEIGHT - layer.bottom) / BLUR + 0.5))
        return make_conditions(
            temperature=AMBIENT + share * (layer.temperature - AMBIENT),
            heat_flux=heat,
            extinction=share * layer.extinction,
            co=share * layer.co,
            gas=0.0,
            water=0.0,
            explosive=0.0,
        )

    def layer(self, space: int, time: float) -> Layer | None:
        """Return the smoke in a space; None if there is none. Who is there meets the same."""
        if (time, self.until) != self._layers_at:
            self._layers_at = (time, self.until)
            self._layers = {}
        if space not in self._layers:
            self._layers[space] = self._layer(space, time)
        return self._layers[space]

    def _layer(self, space: int, time: float) -> Layer | None:
        if self.room == NO_SPACE or time <= self._fire.start:
            return None
        before, after, weight = self.states(time)
        mass, heat, soot, co = (before[space] + weight * (after[space] - before[space])).tolist()
        if mass <= 1e-6:
            return None
        spaces = self.building.spaces
        volume = (mass + heat / (HEAT_CAPACITY * KELVIN)) / DENSITY
        ceiling = float(spaces.ceiling[space])
        depth = min(ceiling, volume / float(spaces.area[space]))
        warmer = heat / (HEAT_CAPACITY * mass)
        return Layer(
            bottom=ceiling - depth,
            depth=depth,
            temperature=AMBIENT + warmer,
            extinction=SOOT_EXTINCTION * soot / volume,
            co=CO_RATIO * co / mass,
        )

    def extinctions(self, time: float, where: str = "breathing") -> Floats:
        """Return the extinction in each space [1/m], and 0 last, for -1: nowhere.

        Args:
            time: [s]
            where: At `breathing` height, the `mean` from floor to ceiling, or in the `layer`.
        """
        if self.room == NO_SPACE or time <= self._fire.start:
            return np.zeros(self.building.spaces.count + 1)
        state = self.state(time)[:-1]
        volume, share = self._filled(state)
        value = SOOT_EXTINCTION * state[:, SOOT] / volume
        if where == "breathing":
            bottom = self.building.spaces.ceiling * (1.0 - share)
            share = np.clip((BREATHING_HEIGHT - bottom) / BLUR + 0.5, 0.0, 1.0)
        elif where == "layer":
            share = np.ones_like(share)
        return np.append(value * share, 0.0)

    def _filled(self, state: Floats) -> tuple[Floats, Floats]:
        """Return each space's volume of smoke [m^3], and the share of the space that it fills."""
        spaces = self.building.spaces
        volume = np.maximum(volumes(state), 1e-9)
        return volume, np.minimum(1.0, volume / (spaces.area * spaces.ceiling))

    def is_hazy(self, time: float) -> bool:
        """See `HazardField`: whether there is smoke at breathing height anywhere.

        Volumes change on straight lines from one state of the field to the next, so that it is
        enough to look at both, each once for all runs that share it.
        """
        if self.room == NO_SPACE or time <= self._start:
            return False
        march, age = self.march(time)
        after = march.after(age)
        return self._is_hazy(march, after - 1) or self._is_hazy(march, after)

    def _is_hazy(self, march: March, number: int) -> bool:
        hazy = march.hazy.get(number)
        if hazy is None:
            share = self._filled(march.states[number][:-1])[1]
            bottoms = self.building.spaces.ceiling * (1.0 - share)
            hazy = not bottoms.min() > BREATHING_HEIGHT + BLUR / 2 + 1e-6
            march.hazy[number] = hazy
        return hazy

    @override
    def haze(self, places: SitePoints, time: float) -> Floats:
        return np.asarray(self.extinctions(time)[places.spaces])

    @override
    def alarm(self, detector: str, x: float, y: float) -> DetectorAlarm:
        # Under a ceiling, where the jet arrives and smoke gathers.
        space = self.building.space_at(x, y)

        def air(age: float) -> Conditions:
            layer = self.layer(space, age) if space >= 0 else None
            if layer is None or layer.depth < SMOKE_LAYER:
                return CLEAR
            return Conditions(layer.temperature, 0.0, layer.extinction, layer.co)

        reached, at_latest = self._jet_at(detector, x, y)
        return alarm_in(detector, air)._replace(reached=reached, at_latest=at_latest)

    def _jet_at(self, detector: str, x: float, y: float) -> tuple[float, float]:
        """Return ages at which the ceiling jet reaches a detector, and sets it off [s]."""
        fire = self._fire
        site = self.site
        room = site.compartment_at(*fire.position)
        if room is None or site.compartment_at(x, y) != room:
            return NO_JET
        gap = round(math.dist(fire.position, (x, y)), 2)
        return _jet(detector, fire.growth, fire.peak, gap, site.compartments[room].ceiling)

    @override
    def picture(self, what: str, places: SitePoints, time: float) -> Floats | None:
        if what in ("smoke", "layer"):
            where = "mean" if what == "smoke" else "layer"
            return np.asarray(self.extinctions(time, where)[places.spaces])
        if what != "heat":
            return None
        if not self._fire.start <= time < self.until:
            return np.zeros(places.spaces.shape)
        if self._seen is None or self._seen[0] is not places:
            is_visible = self._sight.from_point(self._fire.position, places.points)
            self._seen = places, is_visible
        x, y = self._fire.position
        squared = (places.points[..., 0] - x) ** 2 + (places.points[..., 1] - y) ** 2
        nearest = max(0.1, self._fire.radius(time)) ** 2
        strength = self._fire.heat_flux(time, (x + 100.0, y)) * 1e4
        return np.asarray(strength / np.maximum(squared, nearest) * self._seen[1])

    @override
    def solve(self) -> tuple[March, Step]:
        return _smoke(self.building, self._fire.growth, self._fire.peak, self.room)


def _radiant(radiated: float, distance: float, radius: float) -> float:
    """Radiant heat at a distance [m] from the middle of flames with a radius [m], in [kW/m^2]."""
    distance = max(distance, radius, 0.1)
    return float(radiated / (4.0 * math.pi * distance * distance))


def _glow(temperature: float, optical_depth: float) -> float:
    """Return the radiant heat of hot smoke on a person below or in it [kW/m^2]."""
    if temperature < AMBIENT + 1.0:
        return 0.0
    kelvin = temperature + KELVIN - AMBIENT
    return RADIATION * (kelvin**4 - KELVIN**4) * -math.expm1(-optical_depth)
