"""Fires: how much heat they release, how much of it radiates, what smoke they make."""

from __future__ import annotations

import math
from dataclasses import dataclass

from dva_sim.worlds.hazards.field import Point

FULL_GROWTH_KW = 1055.0  # heat release that defines the growth classes [kW]
GROWTH_S = {"slow": 600.0, "medium": 300.0, "fast": 150.0, "ultrafast": 75.0}
HEAT_PER_AREA = 500.0  # heat release of burning floor [kW/m^2]; assumed, offices: 150 to 650
FIRE_LOAD = 420e3  # fuel of an office, the mean [kJ/m^2]
DECAY_FROM = 0.7  # share of the fuel burnt when the fire begins to die down
PEAK_KW = 5000.0  # what the air through one door can burn, 1500 A sqrt(H) for 1.1 m x 2.1 m [kW]

RADIATIVE_FRACTION = 0.3  # of a fire's heat release; assumed, 0.3 to 0.4 is usual
TENABLE_HEAT = 2.5  # radiant heat that skin bears for long [kW/m^2]
LEAST_DANGER = 2.0  # from flames, however small [m]; assumed

HEAT_OF_COMBUSTION = 20e3  # of wood and plastics mixed [kJ/kg]; assumed
SOOT_YIELD = 0.05  # [kg/kg]; assumed: wood 0.015, polyurethane foam 0.13 to 0.23
CO_YIELD = 0.02  # [kg/kg]; assumed: wood 0.004, polyurethane foam 0.01 to 0.04


def largest_peak(growth: str) -> float:
    """Heat release at which a growing fire has burnt all fuel of the floor it is on [kW].

    Growing for a time t to a peak Q burns Q t / 3 on Q / `HEAT_PER_AREA` of floor.
    """
    return FULL_GROWTH_KW * (3.0 * FIRE_LOAD / HEAT_PER_AREA / GROWTH_S[growth]) ** 2


@dataclass(frozen=True)
class Fire:
    """A fire that grows with the square of time, burns steadily, and dies down for want of fuel.

    Attributes:
        position: [m]
        start: [s]
        growth: `slow`, `medium`, `fast` or `ultrafast`.
        peak: The most heat it releases [kW].

    References:
        NFPA 72, annex B: 1055 kW after 600, 300, 150 and 75 s.
        EN 1991-1-2:2002, annex E: 420 MJ/m^2 (office, mean), linear decay once 70 % of the
        fuel is burnt.
        C. Hopkin, M. Spearpoint and D. Hopkin, Fire Technology 55 (2019) 1599: 150 to
        650 kW/m^2 in offices.
        K. Kawagoe, Fire behaviour in rooms, BRI report 27, Tokyo 1958: air through an opening.
        A. Tewarson, in: SFPE Handbook of Fire Protection Engineering: yields of soot and CO.
    """

    position: Point
    start: float
    growth: str = "medium"
    peak: float = PEAK_KW

    def heat_release(self, time: float) -> float:
        """Heat release at `time` [s], in [kW]."""
        age = max(0.0, time - self.start)
        heat = FULL_GROWTH_KW * (age / GROWTH_S[self.growth]) ** 2
        return heat if heat < self.peak else self._grown(age)

    def _grown(self, age: float) -> float:
        """Heat release once the peak is reached [kW]."""
        growing = GROWTH_S[self.growth] * math.sqrt(self.peak / FULL_GROWTH_KW)
        fuel = FIRE_LOAD * self.peak / HEAT_PER_AREA
        steady = max(0.0, DECAY_FROM * fuel / self.peak - growing / 3.0)  # growing burns a third
        left = fuel / self.peak - growing / 3.0 - steady  # of burning at the peak [s]
        decaying = 2.0 * max(left, 1.0)  # a triangle
        return self.peak * min(1.0, max(0.0, 1.0 - (age - growing - steady) / decaying))

    def heat_flux(self, time: float, point: Point) -> float:
        """Radiant heat at a place [m] in free sight of the fire, in [kW/m^2].

        References:
            Point-source model: SFPE Handbook of Fire Protection Engineering, 5th ed., chapter 66.
        """
        distance = max(math.dist(self.position, point), self.radius(time), 0.1)
        radiated = RADIATIVE_FRACTION * self.heat_release(time)
        return float(radiated / (4.0 * math.pi * distance * distance))

    def radius(self, time: float) -> float:
        """See `Hazard`: radius of the burning floor."""
        return math.sqrt(self.heat_release(time) / HEAT_PER_AREA / math.pi)

    def danger_radius(self, time: float) -> float:
        """See `Hazard`: where radiant heat exceeds 2.5 kW/m^2, and never less than 2 m.

        References:
            ISO 13571:2012: 2.5 kW/m^2 is the limit of tenability for radiant heat.
        """
        if time < self.start:
            return 0.0
        radiated = RADIATIVE_FRACTION * self.heat_release(time)
        return max(LEAST_DANGER, math.sqrt(radiated / (4.0 * math.pi * TENABLE_HEAT)))

    def severity(self, time: float) -> float:
        """See `Hazard`: heat release, of the 1055 kW that define the growth classes."""
        return min(1.0, self.heat_release(time) / FULL_GROWTH_KW)
