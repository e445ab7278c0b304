"""How a field develops: solved step by step, only as far as somebody asks, and never twice.

What robots and people do changes nothing but when a source stops. So a field is solved once per
process for each site, kind and space that it starts in; a run goes on from there on its own
once its hazard is dealt with.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

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


class FieldCourse:
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
