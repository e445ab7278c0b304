"""Battery of a robot: consumption while driving and waiting, and charging at the base."""

from __future__ import annotations

from typing import Annotated, Final

from pydantic import Field

from dva_sim.kernel.config import Config
from dva_sim.worlds.bodies import G

JOULES: Final = 3600.0  # joules per watt-hour


class BatteryProfile(Config):
    """Capacity of a battery and its consumers; the shipped numbers are assumed.

    Attributes:
        idle_w: Power of computer, sensors and radio, driving or not.
        rolling_resistance: Force against rolling by weight.
        efficiency: Share of the energy taken that reaches the floor.
        charging_w: Charging power of the base, besides what is used meanwhile.

    References:
        J. Y. Wong: Theory of Ground Vehicles, 4th ed., Wiley 2008, chapter 1: rolling resistance
        of car tyres on concrete 0.013. Small wheels roll worse: 0.02 is assumed.
    """

    capacity_wh: Annotated[float, Field(gt=0)] = 480.0
    idle_w: Annotated[float, Field(ge=0)] = 60.0
    rolling_resistance: Annotated[float, Field(ge=0, lt=1)] = 0.02
    efficiency: Annotated[float, Field(gt=0, le=1)] = 0.7
    charging_w: Annotated[float, Field(ge=0)] = 120.0


class Battery:
    """Charge of one robot, computed from counters that only grow, so at any interval.

    Args:
        profile: Capacity and consumers.
        mass: Mass of the robot [kg].
        share: Initial share of the capacity.

    Attributes:
        energy: Stored energy [J].
    """

    def __init__(self, profile: BatteryProfile, mass: float, share: float = 1.0) -> None:
        self.profile = profile
        self._weight = mass * G
        self._full = profile.capacity_wh * JOULES
        self.energy = share * self._full
        self._time = self._distance = self._work = 0.0

    @property
    def share(self) -> float:
        """Remaining share of the capacity, 0 to 1."""
        return self.energy / self._full

    @property
    def empty(self) -> bool:
        """True if it is empty: its robot has no power until it has been charged."""
        return self.energy <= 0.0

    def advance(self, time: float, distance: float, work: float, at_base: bool) -> None:
        """Account for the energy used since the last call.

        Braking gives nothing back, and an empty battery supplies nothing.

        Args:
            time: Time [s].
            distance: Total distance driven [m].
            work: Total work of the motors besides rolling [J].
            at_base: True if the robot has stood at a base all that time, and was charged.
        """
        spent = time - self._time
        rolled = distance - self._distance
        worked = work - self._work
        self._time = time
        self._distance = distance
        self._work = work
        profile = self.profile
        driving = (profile.rolling_resistance * self._weight * rolled + worked) / profile.efficiency
        gained = profile.charging_w * spent if at_base else -profile.idle_w * spent
        self.energy = min(max(self.energy + gained - driving, 0.0), self._full)
