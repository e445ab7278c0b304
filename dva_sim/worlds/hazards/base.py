"""What every hazard is and what the air is like around it."""

from __future__ import annotations

from typing import NamedTuple, Protocol

Point = tuple[float, float]

AMBIENT = 20.0  # temperature of the air where nothing burns [deg C]
BREATHING_HEIGHT = 1.5  # of a person's mouth and eyes [m]
LARGEST = 2.5  # what can be seen of a leak or flood never grows beyond this [m]; assumed


class Conditions(NamedTuple):
    """The air at a place, at the height of a person's mouth and eyes; water on its floor.

    Attributes:
        temperature: Of the air [deg C].
        heat_flux: Radiant heat [kW/m^2].
        extinction: Of light by smoke [1/m].
        co: Carbon monoxide [ppm].
        gas: Fuel gas, share of the volume, 0 to 1.
        water: Depth [m].
        explosive: The same gas, as a share of its lower explosive limit: at 1 it can explode.
    """

    temperature: float = AMBIENT
    heat_flux: float = 0.0
    extinction: float = 0.0
    co: float = 0.0
    gas: float = 0.0
    water: float = 0.0
    explosive: float = 0.0


CLEAR = Conditions()


class Hazard(Protocol):
    """A growing danger, as it would be in the open: what walls make of it, the fields know."""

    @property
    def position(self) -> Point:
        """Its middle [m]."""

    @property
    def start(self) -> float:
        """When it begins [s]."""

    def radius(self, time: float) -> float:
        """Radius that can be seen at `time` [s], in [m]."""

    def danger_radius(self, time: float) -> float:
        """Radius within which people should not be at `time` [s], in [m]."""

    def severity(self, time: float) -> float:
        """0 (nothing yet) to 1 at `time` [s]."""
