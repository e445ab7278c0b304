"""Predictive steering: the latest picture, plus the commands that it does not show yet.

The oracle steers so from the true state, by a perfect prediction: a reference, not a person.

References:
    O. J. M. Smith: A controller to overcome dead time. ISA Journal 6 (1959).
    T. B. Sheridan: Space teleoperation through time delay: review and prognosis. IEEE Trans.
    Robotics and Automation 9 (1993): predictor displays.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Generic, TypeVar, final

from typing_extensions import override

from dva_sim.agents.observation import Observation
from dva_sim.agents.operator.strategies.base import PathView, PointView, Strategy
from dva_sim.agents.operator.strategies.cursor import Sighting, Velocity
from dva_sim.agents.operator.strategies.pursuit import Pursuit
from dva_sim.agents.population import Person
from dva_sim.agents.route_following import Intent, Reach, Route, View
from dva_sim.kernel import options


class Predictor(Strategy):
    """Extrapolates the picture by its own commands of the last delay, and steers by that.

    Its model is kinematics alone: commands take effect immediately. The delay is what the person
    takes it to be. Of each command the model makes the share `quality`; the share that is left of
    the delay is what the inner strategy has still to be careful about.

    Args:
        person: Person who steers.
        reach: Limits of what is steered.
        inner: Strategy that steers by the predicted picture; left out: `Pursuit`.
        quality: Quality from 0, no prediction, to 1, a perfect model of one's own commands.

    Raises:
        ConfigError: the quality is none.
    """

    uses = "inner"

    def __init__(
        self, person: Person, reach: Reach, inner: Strategy | None = None, quality: float = 1.0
    ) -> None:
        super().__init__(person, reach)
        self._inner = inner or Pursuit(person, reach)
        self._quality = options.number("quality", quality, least=0, most=1)
        self._asked: deque[tuple[float, float, float]] = deque()
        self._remembers = person.habits.delay.remembers_s

    @override
    def drive(self, route: Route, view: View, stop_before: float) -> Intent:
        seen = self._moved_on(view.seen, view.now, view.delay)
        predicted = View(view.now, seen, self._left(view.delay))
        intent = self._inner.drive(route, predicted, stop_before)
        self._asked.append((view.now, *intent))
        return intent

    @override
    def point(self, view: PointView) -> Velocity:
        seen = self._cursor(view.seen, view.now, view.delay)
        velocity = self._inner.point(PointView(view.now, seen, self._left(view.delay)))
        self._asked.append((view.now, *velocity))
        return velocity

    @override
    def follow(self, view: PathView) -> Velocity:
        seen = self._cursor(view.seen, view.now, view.delay)
        predicted = PathView(view.now, seen, self._left(view.delay), view.path)
        velocity = self._inner.follow(predicted)
        self._asked.append((view.now, *velocity))
        return velocity

    def workload(self) -> Mapping[str, float]:
        """Return the workload of the inner strategy."""
        return self._inner.workload()

    def _left(self, delay: float) -> float:
        """Return the delay that the prediction leaves [s]."""
        return (1.0 - self._quality) * delay

    def _moved_on(self, seen: Observation, now: float, delay: float) -> Observation:
        """Return the robot as it will be once what was asked for has happened."""
        x = seen.x
        y = seen.y
        heading = seen.heading
        speed = seen.speed
        turn_rate = seen.turn_rate
        for lasts, one, other in self._unseen(now, delay):
            speed = self._quality * one
            turn_rate = self._quality * other
            middle = heading + 0.5 * turn_rate * lasts
            x += speed * lasts * math.cos(middle)
            y += speed * lasts * math.sin(middle)
            heading += turn_rate * lasts
        return seen._replace(x=x, y=y, heading=heading, speed=speed, turn_rate=turn_rate)

    def _cursor(self, seen: Sighting, now: float, delay: float) -> Sighting:
        """Predict a cursor; its target is assumed to keep moving as it is seen to."""
        x = seen.x
        y = seen.y
        vx = seen.vx
        vy = seen.vy
        for lasts, one, other in self._unseen(now, delay):
            vx = self._quality * one
            vy = self._quality * other
            x = x + vx * lasts
            y = y + vy * lasts
        ahead = self._quality * delay
        return seen._replace(
            x=x,
            y=y,
            vx=vx,
            vy=vy,
            target_x=seen.target_x + seen.target_vx * ahead,
            target_y=seen.target_y + seen.target_vy * ahead,
        )

    def _unseen(self, now: float, delay: float) -> list[tuple[float, float, float]]:
        """Return the requests since `now - delay`: for how long [s], and what."""
        commands = self._asked
        since = now - delay
        end = now
        while len(commands) > 1 and commands[1][0] < now - self._remembers:
            commands.popleft()
        pieces = []
        for at, one, other in reversed(commands):
            if end <= since:
                break
            pieces.append((end - max(at, since), one, other))
            end = at
        return pieces[::-1]


S = TypeVar("S")
T = TypeVar("T", Observation, Sighting)


@dataclass(frozen=True, slots=True)
class Truth(Generic[S]):
    """The true state now, told without delay or error: for the oracle alone.

    Attributes:
        state: State as a frame would show it.
        delay: Time until a command given now takes effect [s].
    """

    state: S
    delay: float = 0.0


@final
class Oracle:
    """`pursuit` with the true state and without delay: a reference, not a person.

    It is not a `Strategy`, as it sees nothing. It alone gets the true state; do not derive from it.

    Args:
        person: Gain, caution and pace.
        reach: Limits of what is steered.
    """

    DELAY = 0.1  # design: its own period [s]

    def __init__(self, person: Person, reach: Reach) -> None:
        self._inner = Predictor(person, reach)

    def __init_subclass__(cls) -> None:
        raise TypeError(
            f"{cls.__name__} cannot derive from Oracle, which alone has access to the true state"
        )

    def drive(self, route: Route, truth: Truth[Observation], stop_before: float) -> Intent:
        """Return the command for a robot."""
        return self._inner.drive(route, View(*_known(truth)), stop_before)

    def point(self, truth: Truth[Sighting]) -> Velocity:
        """Return the velocity for a cursor [m/s]."""
        return self._inner.point(PointView(*_known(truth)))

    def follow(self, path: Route, truth: Truth[Sighting]) -> Velocity:
        """Return the velocity for a cursor in a tunnel [m/s]."""
        return self._inner.follow(PathView(*_known(truth), path))


def _known(truth: Truth[T]) -> tuple[float, T, float]:
    """Return when that is, by the clock of the machine [s], the state, and the delay [s]."""
    return 1e-3 * truth.state.tick, truth.state, truth.delay
