"""Floods: how much water comes, and how deep it would stand in a room."""

from __future__ import annotations

import math
from dataclasses import dataclass

from dva_sim.worlds.hazards.base import LARGEST, Point

INFLOW = 2e-3  # a burst pipe [m^3/s]; assumed
FILM = 5e-3  # depth of water that spreads on a level floor [m]; about twice the capillary length
BASIN = 50.0  # floor of a usual room [m^2]; assumed
DOOR, SILL = 1.2, 0.01  # width of its door and height of the threshold [m]; assumed
WEIR = 1.705  # of a broad-crested weir, (2/3)^1.5 sqrt(g) [m^0.5/s]
DEEP = 0.1  # water that can take a person's footing, and hides steps [m]; assumed
LEAST_DANGER = 1.0  # from the source: it is slippery, and sockets are near [m]; assumed
FULL_VOLUME = 1.0  # counts as severity 1 [m^3]; assumed


@dataclass(frozen=True)
class Flood:
    """Water that comes at a steady rate until it is stopped.

    Attributes:
        position: [m]
        start: [s]
        inflow: [m^3/s]
    """

    position: Point
    start: float
    inflow: float = INFLOW

    def volume(self, time: float) -> float:
        """Water that has come until `time` [s], in [m^3]."""
        return self.inflow * max(0.0, time - self.start)

    def radius(self, time: float) -> float:
        """See `Hazard`: of a film on an open floor."""
        return min(LARGEST, math.sqrt(self.volume(time) / (math.pi * FILM)))

    def danger_radius(self, time: float) -> float:
        """See `Hazard`: where water stands more than 0.1 m deep in a usual room, or 1 m.

        The room fills until its door lets as much out as comes.

        References:
            V. T. Chow, Open-Channel Hydraulics, New York 1959: broad-crested weirs.
        """
        if time < self.start:
            return 0.0
        balance = SILL + (self.inflow / (WEIR * DOOR)) ** (2.0 / 3.0)
        deep = min(self.volume(time) / BASIN, balance) > DEEP
        return math.sqrt(BASIN / math.pi) if deep else LEAST_DANGER

    def severity(self, time: float) -> float:
        """See `Hazard`: the water that has come."""
        return min(1.0, self.volume(time) / FULL_VOLUME)
