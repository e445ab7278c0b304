"""A strategy of a user, kept within what can be done whatever it answers."""

from __future__ import annotations

from collections.abc import Mapping

from dva_sim.agents.operator.strategies.base import Intent, PathView, PointView, Strategy, View
from dva_sim.agents.operator.strategies.cursor import Velocity, slowed
from dva_sim.agents.steering import Route
from dva_sim.plugins import FAILURES, Guard, said


class Guarded(Guard, Strategy):
    """A strategy of a user: what raises or answers no two finite numbers is counted, and stands.

    Attributes:
        strategy: The user's own.
    """

    def __init__(self, strategy: Strategy) -> None:
        super().__init__(strategy.person, strategy.reach)
        self.strategy = strategy

    def drive(self, route: Route, view: View, stop_before: float) -> Intent:
        """Within the limits of the robot; it stands where there is no answer."""
        speed, turn = self._answer(self.strategy.drive, route, view, stop_before) or (0.0, 0.0)
        most = self.reach.turn_rate
        return Intent(min(max(speed, 0.0), self.reach.speed), min(max(turn, -most), most))

    def point(self, view: PointView) -> Velocity:
        """No faster than the cursor can."""
        got = self._answer(self.strategy.point, view) or (0.0, 0.0)
        return slowed(*got, self.reach.speed)

    def follow(self, view: PathView) -> Velocity:
        """No faster than the cursor can."""
        got = self._answer(self.strategy.follow, view) or (0.0, 0.0)
        return slowed(*got, self.reach.speed)

    def workload(self) -> Mapping[str, float]:
        """What the user's counts, if it can tell."""
        try:
            return {str(name): float(value) for name, value in self.strategy.workload().items()}
        except FAILURES as error:
            self._count(said(error))
            return {}
