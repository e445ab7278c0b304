"""Steers in a closed loop, or moves and waits: whichever the person expects to be done sooner.

References:
    W. R. Ferrell: Remote manipulation with transmission delay. IEEE Trans. Human Factors in
    Electronics HFE-6 (1965): with long delays people come to move and wait by themselves.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from dva_sim.agents.operator.strategies.base import PathView, PointView, Strategy
from dva_sim.agents.operator.strategies.cursor import Velocity, fastest
from dva_sim.agents.operator.strategies.move_and_wait import MoveAndWait
from dva_sim.agents.operator.strategies.pursuit import Pursuit
from dva_sim.agents.population import Person
from dva_sim.agents.route_following import SHORTEST, Intent, Reach, Route, View, gain_at

GAP = 1.0  # design: a longer time between two frames is not counted as driving [s]


class Adaptive(Strategy):
    """Compares two expected times to finish, and changes to what is clearly better.

    Expected are, from the delay as estimated and the way left: in a closed loop, the pace that the
    delay allows, or the time that the person's gain takes to close an error; moving and waiting,
    full pace and a wait after each move. Moving and waiting begins with a wait, unless nothing was
    asked for yet that one could wait for, and is left only between two moves.

    Args:
        person: Who steers.
        reach: Limits of what is steered.
        closed: Strategy of the closed loop; left out: `Pursuit`.

    Attributes:
        using: What is used now: `closed` or `move_and_wait`.
        switches: How often that has changed.
    """

    uses = "closed"

    def __init__(self, person: Person, reach: Reach, closed: Strategy | None = None) -> None:
        super().__init__(person, reach)
        self._habits, self._farthest = person.habits.waiting, person.habits.steering.farthest_look_m
        self._closed = closed or Pursuit(person, reach)
        self._moves = MoveAndWait(person, reach)
        self.using = "closed"
        self.switches = 0
        self._times = {"closed": 0.0, "move_and_wait": 0.0}
        self._last: float | None = None
        self._has_asked = False

    def drive(self, route: Route, view: View, stop_before: float) -> Intent:
        """See `Strategy`."""
        seen, person = view.seen, self.person
        left = route.remaining(seen.x, seen.y) - stop_before
        left = left if left > 0.0 else 0.0
        delay = view.delay if view.delay > SHORTEST else SHORTEST
        pace, most = person.caution * self._farthest / delay, self._most
        pace = pace if pace < most else most
        turn = 1.0 / gain_at(person.crossover, person.margin, delay)
        count = left / self._moves.trusted
        waiting = self._waiting(left, count if count > 1.0 else 1.0, delay)
        self._choose(view.now, left / pace + turn, waiting)
        wanted = self._now.drive(route, view, stop_before)
        self._has_asked = self._has_asked or any(wanted)
        return wanted

    def point(self, view: PointView) -> Velocity:
        """See `Strategy`."""
        seen, person = view.seen, self.person
        away = math.hypot(seen.target_x - seen.x, seen.target_y - seen.y)
        folds = math.log(max(away / max(seen.tolerance, SHORTEST), 1.0))
        gain = gain_at(person.pointing, person.margin, view.delay)
        count = max(folds / -math.log(max(person.motor_noise, SHORTEST)), 1.0)
        waiting = self._waiting(away, count, view.delay)
        self._choose(view.now, folds / gain + away / self._most, waiting)
        wanted = self._now.point(view)
        self._has_asked = self._has_asked or any(wanted)
        return wanted

    def follow(self, view: PathView) -> Velocity:
        """See `Strategy`."""
        seen, person = view.seen, self.person
        left = view.path.remaining(seen.x, seen.y)
        pace = fastest(seen.tolerance, view.delay, person, self._most)
        count = max(left / self._moves.trusted_in(seen.tolerance), 1.0)
        self._choose(view.now, left / pace, self._waiting(left, count, view.delay))
        wanted = self._now.follow(view)
        self._has_asked = self._has_asked or any(wanted)
        return wanted

    def workload(self) -> Mapping[str, float]:
        """How often the person waited, and how much of the time it moved and waited."""
        total = sum(self._times.values())
        share = self._times["move_and_wait"] / total if total else 0.0
        return {**self._moves.workload(), "move_and_wait_share": share}

    @property
    def _now(self) -> Strategy:
        return self._closed if self.using == "closed" else self._moves

    def _waiting(self, way: float, moves: float, delay: float) -> float:
        """Expected time to finish by so many moves, each with its wait [s]."""
        a_move = self._habits.shortest_s + self._moves.moves.usual_wait(delay)
        return (way if way > 0.0 else 0.0) / self._most + moves * a_move

    def _choose(self, now: float, closed: float, waiting: float) -> None:
        """Change the way of steering if the other one takes clearly less time [s]."""
        if self._last is not None:
            gap = now - self._last
            self._times[self.using] += gap if gap < GAP else GAP
        self._last = now
        better = self._habits.better
        if self.using == "closed" and waiting < better * closed:
            self.using = "move_and_wait"
            if self._has_asked:
                self._moves.halt(now)
            self.switches += 1
        elif self.using != "closed" and closed < better * waiting and self._moves.moves.rests:
            self.using = "closed"
            self.switches += 1
