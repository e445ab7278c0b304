"""Fires, gas leaks and floods in closed form: how they grow, when they are noticed.

A first model: each hazard is a disc that grows by a stated law. Rooms, doors and ventilation
enter only through the delay of a detector in another room.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

Point = tuple[float, float]

FULL_GROWTH_KW = 1055.0  # heat release that defines the growth classes [kW]
GROWTH_S = {"slow": 600.0, "medium": 300.0, "fast": 150.0, "ultrafast": 75.0}
HEAT_PER_AREA = 500.0  # heat release of burning floor area [kW/m^2]
SMOKE_ALARM_KW = 20.0  # heat release that a ceiling detector near by notices [kW]
SMOKE_SPEED = 0.2  # spread of smoke under a ceiling [m/s]
EDDY_DIFFUSIVITY = 0.05  # indoor mixing of gas [m^2/s]
DOOR_DELAY = 30.0  # until a detector in another room notices [s]
RADIATIVE_FRACTION = 0.3  # of a fire's heat release
LARGEST = 2.5  # a hazard's visible disc never grows beyond this [m]


class Hazard(Protocol):
    """A growing danger."""

    @property
    def position(self) -> Point:
        """Its middle [m]."""

    def radius(self, time: float) -> float:
        """Radius that can be seen at `time` [s], in [m]."""

    def danger_radius(self, time: float) -> float:
        """Radius within which people should not be at `time` [s], in [m]."""

    def severity(self, time: float) -> float:
        """0 (nothing yet) to 1 at `time` [s]."""

    def detection_time(self, detector: Point, same_room: bool) -> float:
        """When a detector at a place [m] notices it [s]."""


@dataclass(frozen=True)
class Fire:
    """A fire whose heat release grows with the square of time.

    Attributes:
        position: [m]
        start: [s]
        growth: `slow`, `medium`, `fast` or `ultrafast`.

    References:
        NFPA 72, annex B: 1055 kW after 600, 300, 150 and 75 s.
        500 kW/m^2: a usual value for ordinary combustibles, EN 1991-1-2, annex E.
    """

    position: Point
    start: float
    growth: str = "medium"

    def heat_release(self, time: float) -> float:
        """Heat release at `time` [s], in [kW]."""
        age = max(0.0, time - self.start)
        return float(FULL_GROWTH_KW * (age / GROWTH_S[self.growth]) ** 2)

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
        return min(LARGEST, math.sqrt(self.heat_release(time) / HEAT_PER_AREA / math.pi))

    def danger_radius(self, time: float) -> float:
        """See `Hazard`: twice the burning radius, and two metres for the heat."""
        return 0.0 if time < self.start else 2.0 * self.radius(time) + 2.0

    def severity(self, time: float) -> float:
        """See `Hazard`."""
        return min(1.0, self.heat_release(time) / FULL_GROWTH_KW)

    def detection_time(self, detector: Point, same_room: bool) -> float:
        """See `Hazard`: until it burns well enough, and its smoke has come."""
        strong = GROWTH_S[self.growth] * math.sqrt(SMOKE_ALARM_KW / FULL_GROWTH_KW)
        under_way = math.dist(self.position, detector) / SMOKE_SPEED
        return self.start + strong + under_way + (0.0 if same_room else DOOR_DELAY)


@dataclass(frozen=True)
class Spread:
    """A leak or flood whose front spreads with the square root of time.

    Attributes:
        position: [m]
        start: [s]
        diffusivity: [m^2/s]

    References:
        A diffusing puff's front after time t lies at about sqrt(4 D t): J. Crank, The
        Mathematics of Diffusion, 2nd ed., Oxford 1975, chapter 3.
    """

    position: Point
    start: float
    diffusivity: float = EDDY_DIFFUSIVITY

    def _front(self, time: float) -> float:
        return math.sqrt(4.0 * self.diffusivity * max(0.0, time - self.start))

    def radius(self, time: float) -> float:
        """See `Hazard`."""
        return min(LARGEST, self._front(time))

    def danger_radius(self, time: float) -> float:
        """See `Hazard`: the front and a metre."""
        return 0.0 if time < self.start else self.radius(time) + 1.0

    def severity(self, time: float) -> float:
        """See `Hazard`."""
        return min(1.0, self._front(time) / LARGEST)

    def detection_time(self, detector: Point, same_room: bool) -> float:
        """See `Hazard`: when the front reaches the detector."""
        reached = math.dist(self.position, detector) ** 2 / (4.0 * self.diffusivity)
        return self.start + reached + (0.0 if same_room else DOOR_DELAY)


KINDS: dict[str, type[Fire] | type[Spread]] = {
    "fire": Fire,
    "gas_leak": Spread,
    "flood": Spread,
}


def make_hazard(kind: str, position: Point, start: float) -> Hazard:
    """A hazard at a place [m], from `start` [s] on.

    Args:
        kind: `fire`, `gas_leak` or `flood`.
        position: Its middle [m].
        start: [s]
    """
    return KINDS[kind](position, start)
