"""The reference: steering on the true state, without delay. Not a person."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, TypeVar

from dva_sim.agents.camera import Observation
from dva_sim.agents.operator.person import Person
from dva_sim.agents.operator.strategies.base import Intent, PathView, PointView, Reach, View
from dva_sim.agents.operator.strategies.cursor import Sighting, Velocity
from dva_sim.agents.operator.strategies.pursuit import Pursuit
from dva_sim.agents.steering import Route

S = TypeVar("S")


@dataclass(frozen=True, slots=True)
class Truth(Generic[S]):
    """The true state now, told without delay or error: for the oracle alone."""

    state: S


class Oracle:
    """The same steering as `Pursuit`, on the true state; it is no `Strategy`, as it sees nothing.

    Args:
        person: Gain, caution and pace.
        reach: Limits of what is steered.
    """

    DELAY = 0.1  # its own period [s]

    def __init__(self, person: Person, reach: Reach) -> None:
        self._pursuit = Pursuit(person, reach)

    def drive(self, route: Route, truth: Truth[Observation], stop_before: float) -> Intent:
        """What to ask a robot for."""
        return self._pursuit.drive(route, View(0.0, truth.state, self.DELAY), stop_before)

    def point(self, truth: Truth[Sighting]) -> Velocity:
        """What velocity to give a cursor [m/s]."""
        return self._pursuit.point(PointView(0.0, truth.state, self.DELAY))

    def follow(self, path: Route, truth: Truth[Sighting]) -> Velocity:
        """What velocity to give a cursor in a tunnel [m/s]."""
        return self._pursuit.follow(PathView(0.0, truth.state, self.DELAY, path))
