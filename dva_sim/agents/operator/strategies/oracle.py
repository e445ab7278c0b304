"""The reference: steering on the true state, by a perfect prediction. Not a person."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, TypeVar, final

from dva_sim.agents.camera import Observation
from dva_sim.agents.operator.person import Person
from dva_sim.agents.operator.strategies.base import Intent, PathView, PointView, Reach, View
from dva_sim.agents.operator.strategies.cursor import Sighting, Velocity
from dva_sim.agents.operator.strategies.predictor import Predictor
from dva_sim.agents.steering import Route

S = TypeVar("S")
T = TypeVar("T", Observation, Sighting)


@dataclass(frozen=True, slots=True)
class Truth(Generic[S]):
    """The true state now, told without delay or error: for the oracle alone.

    Attributes:
        state: As a frame would show it.
        delay: Until what is asked for now takes effect [s].
    """

    state: S
    delay: float = 0.0


@final
class Oracle:
    """The same steering as `Pursuit`, from where what is asked for now takes effect.

    It is no `Strategy`, as it sees nothing. Nothing derives from it: it alone is told the truth.

    Args:
        person: Gain, caution and pace.
        reach: Limits of what is steered.
    """

    DELAY = 0.1  # its own period [s]

    def __init__(self, person: Person, reach: Reach) -> None:
        self._inner = Predictor(person, reach, "pursuit")

    def __init_subclass__(cls) -> None:
        raise TypeError(f"{cls.__name__} cannot derive from Oracle, which alone is told the truth")

    def drive(self, route: Route, truth: Truth[Observation], stop_before: float) -> Intent:
        """What to ask a robot for."""
        return self._inner.drive(route, View(*_known(truth)), stop_before)

    def point(self, truth: Truth[Sighting]) -> Velocity:
        """What velocity to give a cursor [m/s]."""
        return self._inner.point(PointView(*_known(truth)))

    def follow(self, path: Route, truth: Truth[Sighting]) -> Velocity:
        """What velocity to give a cursor in a tunnel [m/s]."""
        return self._inner.follow(PathView(*_known(truth), path))


def _known(truth: Truth[T]) -> tuple[float, T, float]:
    """When that is, by the clock of what is steered [s], the state, and the delay [s]."""
    return 1e-3 * truth.state.tick, truth.state, truth.delay
