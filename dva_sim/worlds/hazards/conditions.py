"""The air and the floor at a place: what every hazard acts on, and all that people, sensors and
detectors ever meet of it."""

from __future__ import annotations

from typing import Final, NamedTuple

from dva_sim.kernel.makers import maker

AMBIENT: Final = 20.0  # air temperature without a fire [deg C]
BREATHING_HEIGHT: Final = 1.5  # height of a person's mouth and eyes [m]


class Conditions(NamedTuple):
    """The air at a place, at the height of a person's mouth and eyes; water on its floor.

    Attributes:
        temperature: Temperature of the air [deg C].
        heat_flux: Radiant heat [kW/m^2].
        extinction: Extinction of light by smoke [1/m].
        co: Carbon monoxide [ppm].
        gas: Fuel gas, share of the volume, 0 to 1.
        water: Depth [m].
        explosive: Gas concentration as a share of its lower explosive limit: at 1 it can explode.
    """

    temperature: float = AMBIENT
    heat_flux: float = 0.0
    extinction: float = 0.0
    co: float = 0.0
    gas: float = 0.0
    water: float = 0.0
    explosive: float = 0.0


make_conditions = maker(Conditions)
CLEAR = Conditions()


class Quantity(NamedTuple):
    """Something that pictures show over the floor: which part of the conditions, and its unit."""

    part: str
    unit: str


QUANTITIES: Final = {
    "smoke": Quantity("extinction", "1/m"),
    "heat": Quantity("heat_flux", "kW/m2"),
    "gas": Quantity("gas", "1"),
    "water": Quantity("water", "m"),
}
"""Fields over the floor that pictures and recordings can show."""


def together(a: Conditions, b: Conditions) -> Conditions:
    """Return the air with both hazards; gases explode together by their shares of their limits.

    References:
        H. Le Chatelier, Annales des Mines 19 (1891) 388: limits of mixed gases.
    """
    return make_conditions(
        temperature=max(a.temperature, b.temperature, AMBIENT),
        heat_flux=a.heat_flux + b.heat_flux,
        extinction=a.extinction + b.extinction,
        co=a.co + b.co,
        gas=min(1.0, a.gas + b.gas),
        water=a.water + b.water,
        explosive=a.explosive + b.explosive,
    )
