"""Steering by a prediction: what was asked for but not yet seen is added to what is seen.

References:
    O. J. M. Smith: A controller to overcome dead time. ISA Journal 6 (1959).
    T. B. Sheridan: Space teleoperation through time delay: review and prognosis. IEEE Trans.
    Robotics and Automation 9 (1993): predictor displays.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping

from dva_sim.agents.camera import Observation
from dva_sim.agents.operator.delay import LONGEST
from dva_sim.agents.operator.person import Person
from dva_sim.agents.operator.strategies.base import (
    Intent,
    PathView,
    PointView,
    Reach,
    Strategy,
    View,
)
from dva_sim.agents.operator.strategies.cursor import Sighting, Velocity
from dva_sim.agents.steering import Route
from dva_sim.errors import ConfigError


class Predictor(Strategy):
    """Moves the picture on by the commands of the last delay, and steers by that.

    Its model is kinematics alone: what is asked for happens, at once. The delay is what the person
    takes it to be. Of each command the model makes the share `quality`; the share that is left of
    the delay is what the inner strategy has still to be careful about.

    Args:
        person: Who steers.
        reach: Limits of what is steered.
        inner: Strategy that steers by the predicted picture.
        quality: From 0, no prediction, to 1, a perfect model of one's own commands.

    Raises:
        ConfigError: the inner strategy is none, or the quality is none.
    """

    def __init__(
        self, person: Person, reach: Reach, inner: str = "pursuit", quality: float = 1.0
    ) -> None:
        from dva_sim.agents.operator.strategies.loading import load_inner

        super().__init__(person, reach)
        if not isinstance(quality, int | float) or not 0.0 <= quality <= 1.0:
            raise ConfigError(f"option 'quality' is {quality!r}; should be from 0 to 1")
        self._inner, self._quality = load_inner("inner", inner, person, reach), quality
        self._asked: deque[tuple[float, float, float]] = deque()

    def drive(self, route: Route, view: View, stop_before: float) -> Intent:
        """See `Strategy`."""
        seen = self._moved_on(view.seen, view.now, view.delay)
        predicted = View(view.now, seen, self._left(view.delay))
        intent = self._inner.drive(route, predicted, stop_before)
        self._asked.append((view.now, *intent))
        return intent

    def point(self, view: PointView) -> Velocity:
        """See `Strategy`."""
        seen = self._cursor(view.seen, view.now, view.delay)
        wanted = self._inner.point(PointView(view.now, seen, self._left(view.delay)))
        self._asked.append((view.now, *wanted))
        return wanted

    def follow(self, view: PathView) -> Velocity:
        """See `Strategy`."""
        seen = self._cursor(view.seen, view.now, view.delay)
        predicted = PathView(view.now, seen, self._left(view.delay), view.path)
        wanted = self._inner.follow(predicted)
        self._asked.append((view.now, *wanted))
        return wanted

    def workload(self) -> Mapping[str, float]:
        """That of the inner strategy."""
        return self._inner.workload()

    def _left(self, delay: float) -> float:
        """What the prediction leaves of a delay [s]."""
        return (1.0 - self._quality) * delay

    def _moved_on(self, seen: Observation, now: float, delay: float) -> Observation:
        """The robot as it will be once what was asked for has happened."""
        x, y, heading = seen.x, seen.y, seen.heading
        speed, turn_rate = seen.speed, seen.turn_rate
        for lasts, one, other in self._unseen(now, delay):
            speed, turn_rate = self._quality * one, self._quality * other
            middle = heading + 0.5 * turn_rate * lasts
            x += speed * lasts * math.cos(middle)
            y += speed * lasts * math.sin(middle)
            heading += turn_rate * lasts
        return seen._replace(x=x, y=y, heading=heading, speed=speed, turn_rate=turn_rate)

    def _cursor(self, seen: Sighting, now: float, delay: float) -> Sighting:
        """The same of a cursor; its target goes on as it is seen to go."""
        x, y, vx, vy = seen.x, seen.y, seen.vx, seen.vy
        for lasts, one, other in self._unseen(now, delay):
            vx, vy = self._quality * one, self._quality * other
            x, y = x + vx * lasts, y + vy * lasts
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
        """What was asked for since `now - delay`: for how long [s], and what."""
        asked, since, end = self._asked, now - delay, now
        while len(asked) > 1 and asked[1][0] < now - LONGEST:
            asked.popleft()
        pieces = []
        for at, one, other in reversed(asked):
            if end <= since:
                break
            pieces.append((end - max(at, since), one, other))
            end = at
        return pieces[::-1]
