"""Interface of strategies, and how one moves a cursor by default.

A strategy is how a kind of person turns what it sees into what it wants. It sees frames that are
late by perception and judged with an error, and what the person takes the delay to be; there is no
way from any of these to the true state. A strategy of a user is kept within what can be done,
whatever it answers (`GuardedStrategy`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from itertools import repeat
from typing import ClassVar, NamedTuple

from dva_sim.agents.operator.strategies.cursor import Sighting, Velocity, slowed, through, towards
from dva_sim.agents.population import Person
from dva_sim.agents.route_following import Intent, Reach, Route, View
from dva_sim.kernel.plugins import FAILURES, Guard, error_text


class PointView(NamedTuple):
    """Knowledge of a person who moves a cursor to a target; as in `View`.

    Attributes:
        noise: Standard normal numbers, by which its movements miss and it makes up its mind.
    """

    now: float
    seen: Sighting
    delay: float
    noise: Iterator[float] = repeat(0.0)


class PathView(NamedTuple):
    """Knowledge of a person who moves a cursor through a tunnel; as in `View`.

    Attributes:
        path: The middle line of the tunnel [m]; its end is the target.
    """

    now: float
    seen: Sighting
    delay: float
    path: Route


class Strategy:
    """Base class of steering strategies; derive your own from it.

    One is made for each drive or trial: it may remember what it saw in that, and nothing else.
    It has no noise: errors and noise are the person's, outside.

    Args:
        person: Person with gains, caution and pace.
        reach: Limits of what is steered.

    Attributes:
        uses: Its argument that is another strategy, if it has one: a configuration names it there.
        failures: Number of missing or invalid answers; only users' strategies have any.
        first_failure: First failure, in one line.
    """

    uses: ClassVar[str] = ""
    failures = 0
    first_failure = ""

    def __init__(self, person: Person, reach: Reach) -> None:
        self.person = person
        self.reach = reach

    def drive(self, route: Route, view: View, stop_before: float) -> Intent:
        """Return the command for a robot that follows a route.

        Args:
            route: The way to go.
            view: Current observation and its time.
            stop_before: Distance from the end of the route at which to stop [m].
        """
        raise NotImplementedError

    def point(self, view: PointView) -> Velocity:
        """Return the velocity for a cursor, to bring it to its target and keep it there [m/s].

        If a strategy says nothing else: the crossover law, as `cursor.towards` has it.
        """
        return towards(view.seen, view.delay, self.person, self._most)

    def follow(self, view: PathView) -> Velocity:
        """Return the velocity for a cursor, to pass through a tunnel without leaving it [m/s].

        If a strategy says nothing else: as fast as the delay allows, as `cursor.through` has it.
        """
        return through(view.path, view.seen, view.delay, self.person, self._most)

    def presses(self, view: PointView, hurried: bool) -> bool:
        """Press the button: the cursor is seen on its target, and will stay there.

        Args:
            view: View of cursor and target.
            hurried: A press beside the target costs nothing.
        """
        seen = view.seen
        off = math.hypot(seen.x - seen.target_x, seen.y - seen.target_y)
        drift = math.hypot(seen.vx - seen.target_vx, seen.vy - seen.target_vy)
        return off + drift * view.delay <= seen.tolerance

    def workload(self) -> Mapping[str, float]:
        """Return the effort of this way of steering so far, by name with its unit."""
        return {}

    @property
    def _most(self) -> float:
        """Greatest speed that the person is willing to use [m/s]."""
        return self.person.pace * self.reach.speed


class GuardedStrategy(Guard, Strategy):
    """A strategy of a user: what raises or answers no two finite numbers is counted, and stands.

    Attributes:
        strategy: The user's own.
    """

    def __init__(self, strategy: Strategy) -> None:
        super().__init__(strategy.person, strategy.reach)
        self.strategy = strategy

    def drive(self, route: Route, view: View, stop_before: float) -> Intent:
        """Limit the command to the robot's range; an invalid answer stops it."""
        speed, turn = self._answer(self.strategy.drive, route, view, stop_before) or (0.0, 0.0)
        most = self.reach.turn_rate
        speed = self._clamp("wants [m/s]", speed, 0.0, self.reach.speed)
        return Intent(speed, self._clamp("wants [rad/s]", turn, -most, most))

    def point(self, view: PointView) -> Velocity:
        """Return the velocity to a point, no faster than the cursor can."""
        got = self._answer(self.strategy.point, view) or (0.0, 0.0)
        return slowed(*got, self.reach.speed)

    def follow(self, view: PathView) -> Velocity:
        """Return the velocity that follows a target, no faster than the cursor can."""
        got = self._answer(self.strategy.follow, view) or (0.0, 0.0)
        return slowed(*got, self.reach.speed)

    def workload(self) -> Mapping[str, float]:
        """Return the workload that the user's strategy reports, if it does."""
        try:
            return {str(name): float(value) for name, value in self.strategy.workload().items()}
        except FAILURES as error:
            self._count(error_text(error))
            return {}
