"""Gas leaks: which gas, how much, and how far it is dangerous in the open."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dva_sim.worlds.hazards.field import LARGEST, Point

HOUR = 3600.0
EDDY_DIFFUSIVITY = 0.05  # of air that ventilation stirs [m^2/s]; assumed
AIR_CHANGES = 2.0  # of fresh air per hour; assumed
MIXED_HEIGHT = 3.0  # the jet of a leak mixes the air up to the ceiling [m]; assumed
LEAST_DANGER = 1.0  # from where it leaks [m]; assumed
FULL_CLOUD = 50.0  # a small room's air at the danger level counts as severity 1 [m^3]; assumed


class Gas(NamedTuple):
    """A gas that leaks; shares of the volume, 0 to 1.

    Attributes:
        lower: Lower explosive limit.
        upper: Upper explosive limit.
        danger: People should not be where there is more.
        alarm: Detectors for fuel gas notice it from there on.
        leak: A serious leak in a building [m^3/s]; assumed.

    References:
        ISO/IEC 80079-20-1:2017: explosive limits.
        NIOSH, Immediately Dangerous to Life or Health values: carbon monoxide 1200 ppm.
    """

    lower: float
    upper: float
    danger: float
    alarm: float
    leak: float


# Fuel gases alarm at 10 % and are dangerous from 20 % of the lower explosive limit on, the two
# levels that fixed gas detectors are usually set to.
GASES = {
    "methane": Gas(0.044, 0.17, 0.0088, 0.0044, 0.010),
    "propane": Gas(0.017, 0.109, 0.0034, 0.0017, 0.004),
    "carbon_monoxide": Gas(0.109, 0.74, 1200e-6, math.inf, 1e-4),
}


@dataclass(frozen=True)
class GasLeak:
    """A leak that goes on at a steady rate until it is stopped.

    Attributes:
        position: [m]
        start: [s]
        gas: One of `GASES`.
        rate: Gas set free [m^3/s]; 0 stands for a serious leak of that gas.
        diffusivity: Of the stirred air [m^2/s].
        air_changes: Fresh air per hour, in volumes of the room.
        draught: Air blown in at one place indoors and sucked off at another [m^3/s].
        supply_x: Where it is blown in [m]; the same for y.
        exhaust_x: Where it is sucked off [m]; the same for y.
        wind: Outdoors [m/s].
        wind_heading: Where it blows to, counter-clockwise from east [rad].
        stability: Of the air outdoors, A to F.

    References:
        K.-C. Cheng et al., Environ. Sci. Technol. 45 (2011) 4016: 0.001 to 0.013 m^2/s in calm
        rooms, more with more fresh air.
    """

    position: Point
    start: float
    gas: str = "methane"
    rate: float = 0.0
    diffusivity: float = EDDY_DIFFUSIVITY
    air_changes: float = AIR_CHANGES
    draught: float = 0.0
    supply_x: float = 0.0
    supply_y: float = 0.0
    exhaust_x: float = 0.0
    exhaust_y: float = 0.0
    wind: float = 2.0
    wind_heading: float = 0.0
    stability: str = "D"

    @property
    def kind_of_gas(self) -> Gas:
        """Its limits."""
        return GASES[self.gas]

    @property
    def release(self) -> float:
        """Gas set free [m^3/s]."""
        return self.rate or self.kind_of_gas.leak

    def radius(self, time: float) -> float:
        """See `Hazard`: the front of a spreading puff.

        References:
            J. Crank, The Mathematics of Diffusion, 2nd ed., Oxford 1975, chapter 3.
        """
        return min(LARGEST, math.sqrt(4.0 * self.diffusivity * max(0.0, time - self.start)))

    def danger_radius(self, time: float) -> float:
        """See `Hazard`: where the gas would exceed its danger level, at least 1 m and at most 20 m.

        Under a ceiling without walls. Outdoors it is the same: farther than the plume needs at the
        height of a mouth, but near the leak there is the jet, which is left out.
        """
        if time < self.start:
            return 0.0
        loss = self.air_changes / HOUR
        ages, radii = _reach(self.release, self.kind_of_gas.danger, self.diffusivity, loss)
        return max(LEAST_DANGER, float(np.interp(time - self.start, ages, radii)))

    def severity(self, time: float) -> float:
        """See `Hazard`: how much air the gas can bring to its danger level."""
        cloud = self.release * max(0.0, time - self.start) / self.kind_of_gas.danger
        return min(1.0, cloud / FULL_CLOUD)


@lru_cache(maxsize=64)
def _reach(
    release: float, level: float, diffusivity: float, loss: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """How far from a steady source the gas exceeds a level: ages [s] and radii [m].

    A line source from floor to ceiling in the open, diffusing and thinned by fresh air: the
    solution that hydrologists call the leaky aquifer.

    References:
        M. S. Hantush and C. E. Jacob, Trans. Am. Geophys. Union 36 (1955) 95.
    """
    ages = np.geomspace(0.1, 1e5, 150)
    radii = np.linspace(0.05, 20.0, 400)
    rate = np.exp(-(radii[:, None] ** 2) / (4.0 * diffusivity * ages) - loss * ages)
    steps = np.diff(np.log(ages))
    total = np.cumsum(0.5 * (rate[:, 1:] + rate[:, :-1]) * steps, axis=1)
    share = release / (4.0 * math.pi * diffusivity * MIXED_HEIGHT) * total
    reached = (share >= level).sum(axis=0)  # it falls with the distance
    return np.r_[0.0, ages[1:]], np.r_[0.0, np.r_[0.0, radii][reached]]
