"""What every hazard is and what the air is like around it.

Fields solved step by step: only as far as somebody asks, and never twice.

What all fields have in common.

What robots and people do changes nothing but when a source stops. So a field is solved once per
process for each site, kind and space that it starts in; a run goes on from there on its own
once its hazard is dealt with.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Sequence
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

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


Floats = NDArray[np.float64]
Step = Callable[[Floats, float, float], Floats]
Paces = Sequence[tuple[float, float]]

# Until which age, in which steps [s]: what has just begun changes fast.
PACES = ((120.0, 1.0), (600.0, 2.0), (1800.0, 5.0), (math.inf, 20.0))


class March:
    """The states of a field at growing ages, and the way from one to the next.

    Args:
        state: At age 0.
        step: From a state at an age [s] to the one `dt` [s] later; it changes nothing.
        paces: Until which age, in which steps [s].
    """

    def __init__(self, state: Floats, step: Step, paces: Paces = PACES) -> None:
        self._step, self._paces = step, paces
        self.ages, self.states = [0.0], [state]

    def around(self, age: float) -> tuple[Floats, Floats, float]:
        """The states before and after an age [s], and the weight of the later one."""
        ages = self.ages
        while ages[-1] <= age:
            self._advance()
        after = max(1, bisect_right(ages, age))
        weight = (age - ages[after - 1]) / (ages[after] - ages[after - 1])
        return self.states[after - 1], self.states[after], max(0.0, weight)

    def at(self, age: float) -> Floats:
        """The state at an age [s], between two steps on the straight line."""
        before, after, weight = self.around(age)
        between: Floats = before + weight * (after - before)
        return between

    def _advance(self) -> None:
        age = self.ages[-1]
        dt = next(step for until, step in self._paces if age < until)
        self.states.append(self._step(self.states[-1], age, dt))
        self.ages.append(age + dt)


class Places(NamedTuple):
    """Points of a picture, and what lies there.

    Attributes:
        points: Shape `(rows, columns, 2)` [m].
        spaces: Index of the space, or -1.
        nodes: Index of the node of the gas mesh, or -1; not filled where nobody asks for gas.
    """

    points: Floats
    spaces: NDArray[np.int64]
    nodes: NDArray[np.int64]


class HazardField(Protocol):
    """What one hazard does."""

    until: float

    def at(self, x: float, y: float, time: float) -> Conditions:
        """What it adds to clear air at a place [m]."""

    def picture(self, what: str, places: Places, time: float) -> Floats | None:
        """A raster of what it adds; None if it adds nothing of the kind."""


class Course:
    """A field as it develops: shared until the source stops, then this run's own.

    Args:
        shared: With the source, from age 0 on.
        step: Without the source.
        paces: Of this run's own.
    """

    def __init__(self, shared: March, step: Step, paces: Paces) -> None:
        self._shared, self._step, self._paces = shared, step, paces
        self._own: tuple[float, March] | None = None

    def around(self, age: float, stopped: float) -> tuple[Floats, Floats, float]:
        """The states before and after an age [s], and the weight of the later one."""
        if age <= stopped:
            return self._shared.around(age)
        if self._own is None or self._own[0] != stopped:
            self._own = stopped, March(self._shared.at(stopped), self._step, self._paces)
        return self._own[1].around(age - stopped)

    def at(self, age: float, stopped: float) -> Floats:
        """The state at an age [s]."""
        before, after, weight = self.around(age, stopped)
        between: Floats = before + weight * (after - before)
        return between
