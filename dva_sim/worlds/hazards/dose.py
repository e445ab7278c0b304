"""Effects of heat, smoke, gas and water on a person.

References:
    ISO 13571:2012, Life-threatening components of fire: heat.
    D. A. Purser and J. L. McAllister, in: SFPE Handbook of Fire Protection Engineering, 5th ed.,
    chapter 63: carbon monoxide, lack of oxygen.
    H. Frantzich and D. Nilsson, Lund University, report 3126, 2003: walking in smoke.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from dva_sim.worlds.hazards.conditions import Conditions
from dva_sim.worlds.hazards.fire import TENABLE_HEAT

MINUTE = 60.0
BREATHING = 25.0  # air breathed in light work [L/min]
CO_LIMIT = 30.0  # carboxyhaemoglobin at which people in light work collapse [%]
OXYGEN = 0.209  # share of oxygen in air
MIN_OXYGEN_LACK = 0.01  # smaller lack of oxygen has no effect; assumed
LUKEWARM = 60.0  # temperature below which air does no harm [deg C]; assumed

SMOKE_SLOWS = 0.057 / 0.706  # share of walking speed lost per 1/m of extinction, in 0.706 m/s
CRAWLING = 0.1  # minimum share of walking speed in smoke
KNEE = 0.5  # depth of water in which people walk at half speed [m]; assumed
WADING = 0.3  # minimum share of walking speed in water while standing; assumed


@dataclass
class Dose:
    """Dose that a person has taken in: at 1 a person can no longer escape.

    Attributes:
        heat: Fractional effective dose of radiant heat and hot air.
        toxic: Fractional effective dose of carbon monoxide and lack of oxygen.
        explosive: Time in air with gas enough to explode, there or thinned a little [s].
    """

    heat: float = 0.0
    toxic: float = 0.0
    explosive: float = 0.0

    def add(self, conditions: Conditions, dt: float) -> None:
        """Spend `dt` [s] in some conditions."""
        minutes = dt / MINUTE
        self.heat += minutes * heat_rate(conditions)
        self.toxic += minutes * toxic_rate(conditions)
        if conditions.explosive >= 1.0:
            self.explosive += dt

    @property
    def incapacitated(self) -> bool:
        """True if one of the doses has reached its limit."""
        return self.heat >= 1.0 or self.toxic >= 1.0


def heat_rate(conditions: Conditions) -> float:
    """Dose of heat per minute: radiant above 2.5 kW/m^2, and air on lightly clothed skin."""
    rate = 0.0
    if conditions.heat_flux > TENABLE_HEAT:
        rate += conditions.heat_flux**1.9 / 4.2
    if conditions.temperature > LUKEWARM:
        rate += conditions.temperature**3.4 / 5e7
    return float(rate)


def toxic_rate(conditions: Conditions) -> float:
    """Dose of carbon monoxide and of lack of oxygen, which a leaking gas drives out, per minute."""
    rate = 3.317e-5 * conditions.co**1.036 * BREATHING / CO_LIMIT
    lack = 100.0 * OXYGEN * conditions.gas  # [%] of the air
    if lack > 100.0 * MIN_OXYGEN_LACK:
        rate += 1.0 / math.exp(8.13 - 0.54 * lack)
    return float(rate)


def pace_in_smoke(extinction: float) -> float:
    """Return the share of the walking speed in clean air that smoke [1/m] leaves.

    Measured where lamps still shone, at 2 to 8 per metre: 0.706 m/s, less 0.057 m/s for each.
    """
    return max(CRAWLING, 1.0 - SMOKE_SLOWS * extinction)


def pace_in_water(depth: float) -> float:
    """Return the share of the walking speed on a dry floor that water [m] leaves; assumed."""
    return max(WADING, 1.0 - 0.5 * depth / KNEE)
