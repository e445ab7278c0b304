"""What all fields have in common.

What robots and people do changes nothing but when a source stops. So a field is solved once per
process for each site, kind and space that it starts in; a run goes on from there on its own
once its hazard is dealt with.
"""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from dva_sim.worlds.hazards.base import Conditions
from dva_sim.worlds.hazards.march import March, Paces, Step

Floats = NDArray[np.float64]


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
