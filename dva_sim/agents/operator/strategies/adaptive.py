"""A person with reasons: one way of acting under delay, from none to as long as anybody waits.

It acts in samples, by what it has learnt of the delay and of how often commands get through, and
the longer the delay, the more of it is spent watching before acting again.

- A cursor is moved by `Submovements`: aimed, predicted, corrected. Where there is nothing to come
  to but an error to be kept small all the time, it is the crossover law (`cursor.towards`).
- A robot is steered by corrections of the turn rate. One begins once the evidence for an error has
  added up, grows for a fixed time, and only then another one can begin. Speed and look-ahead are
  those of `Pursuit`, for the delay with half of a correction and half of the period added.
- It moves and waits where it likes that better: by the times that it expects, and by an unease at
  a late picture that is the person's own. Hardly anybody does under a short delay and nearly
  everybody under a long one, and persons differ, so their mean has no step.
- A command that is given for less time than the period at which commands get through may be lost,
  so no move is shorter than the period that the person has seen; `PeriodEstimate`.

References:
    W. R. Ferrell: Remote manipulation with transmission delay. IEEE Trans. Human Factors in
    Electronics HFE-6 (1965): with long delays people come to move and wait by themselves.
    G. Markkula et al.: Sustained sensorimotor control as intermittent decisions about prediction
    errors. Biological Cybernetics 112 (2018): evidence that adds up, corrections of a fixed form.
    C. M. Goodridge et al.: J. Exp. Psychology: Human Perception and Performance 48(1) (2022): how
    long that takes for small errors of the heading, and how long a correction grows.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from typing_extensions import override

from dva_sim.agents.operator.delay_estimation import PeriodEstimate
from dva_sim.agents.operator.strategies.base import PathView, PointView, Strategy
from dva_sim.agents.operator.strategies.cursor import Velocity, fastest, towards
from dva_sim.agents.operator.strategies.move_and_wait import MoveAndWait
from dva_sim.agents.operator.strategies.pursuit import Pursuit
from dva_sim.agents.operator.strategies.submovements import Submovements
from dva_sim.agents.population import Person
from dva_sim.agents.route_following import SHORTEST, Intent, Reach, Route, View, gain_at

GAP = 1.0  # design: a longer time between two frames is not counted as driving [s]
LEAVE_WAITING_SHARE = (
    0.8  # design: of the liking at which one began to wait, below which one stops that
)


class Corrections:
    """Turn rates as a person gives them: in corrections that grow, one after the other.

    Args:
        person: Tempo and habits.
    """

    def __init__(self, person: Person) -> None:
        self._habits = person.habits.correcting
        self._tempo = person.tempo
        self._from = self._to = 0.0
        self._begun = -math.inf
        self._last = math.inf
        self._evidence = self._errors = self._gathered = 0.0

    @property
    def late(self) -> float:
        """Time from the beginning to the middle of a correction [s]."""
        return 0.5 * self._habits.grows_s * self._tempo

    def steer(self, now: float, rate: float) -> float:
        """Return the turn rate to ask for, if so much is wanted now [rad/s]."""
        grows = self._habits.grows_s * self._tempo
        share = (now - self._begun) / grows
        if share >= 1.0:
            self._from = self._to
            passed = max(now - self._last, 0.0)
            error = rate - self._to
            hardly = self._habits.unnoticed * abs(self._to)
            self._evidence += math.copysign(max(abs(error) - hardly, 0.0), error) * passed
            self._errors += error * passed
            self._gathered += passed
            if abs(self._evidence) >= self._habits.evidence_rad:
                self._to += self._errors / self._gathered
                self._evidence = self._errors = self._gathered = share = 0.0
                self._begun = now
        self._last = now
        share = min(share, 1.0)
        return self._from + (self._to - self._from) * share * share * (3.0 - 2.0 * share)


class Adaptive(Strategy):
    """Acts in samples under short delays, and moves and waits under long ones.

    Args:
        person: Person who steers.
        reach: Limits of what is steered.
        closed: Strategy that takes the place of its own under short delays.

    Attributes:
        using: Current strategy: `closed` or `move_and_wait`.
        switches: Number of changes of strategy.
        period: Estimate of how often commands get through.
    """

    uses = "closed"

    def __init__(self, person: Person, reach: Reach, closed: Strategy | None = None) -> None:
        super().__init__(person, reach)
        self._closed = closed
        self._habits = person.habits.waiting
        self._pursuit = closed or Pursuit(person, reach)
        self._moves = MoveAndWait(person, reach)
        self._aims = Submovements(person, self._most)
        self._corrections = Corrections(person)
        self.period = PeriodEstimate(person.habits.delay)
        self.using = "closed"
        self.switches = 0
        self._times = {"closed": 0.0, "move_and_wait": 0.0}
        self._last: float | None = None
        self._has_asked = False

    @override
    def drive(self, route: Route, view: View, stop_before: float) -> Intent:
        seen = view.seen
        reach = self.reach
        motion = seen.speed / reach.speed, seen.turn_rate / max(reach.turn_rate, 1e-3)
        self._moves.period = self.period.see(view.now, *motion, view.delay)
        left = max(route.remaining(seen.x, seen.y) - stop_before, 0.0)
        self._choose(view.now, self._prefers_to_wait(left, view.delay))
        if self.using != "closed":
            intent = self._moves.drive(route, view, stop_before)
        elif self._closed is not None:
            intent = self._closed.drive(route, view, stop_before)
        else:
            late = 0.5 * self.period.likely + self._corrections.late
            intent = self._pursuit.drive(route, view._replace(delay=view.delay + late), stop_before)
            turn = self._corrections.steer(view.now, intent.turn_rate)
            intent = Intent(intent.speed, turn)
        self._has_asked = self._has_asked or any(intent)
        self.period.intend(
            view.now, intent.speed / reach.speed, intent.turn_rate / max(reach.turn_rate, 1e-3)
        )
        return intent

    @override
    def point(self, view: PointView) -> Velocity:
        if self._closed is not None:
            return self._closed.point(view)
        if view.seen.tolerance <= 0.0:  # no place to come to: it follows all the time
            return towards(view.seen, view.delay, self.person, self._most, self.person.tracks)
        return self._aims.point(view.now, view.seen, view.delay, view.noise)

    @override
    def presses(self, view: PointView, hurried: bool) -> bool:
        if self._closed is not None:
            return self._closed.presses(view, hurried)
        return self._aims.presses(view.now, view.seen, view.delay, hurried)

    @override
    def follow(self, view: PathView) -> Velocity:
        seen = view.seen
        person = self.person
        left = view.path.remaining(seen.x, seen.y)
        pace = fastest(seen.tolerance, view.delay, person, self._most)
        count = max(left / self._moves.trusted_in(seen.tolerance), 1.0)
        ratio = (left / pace) / self._waiting(left, count, view.delay)
        self._choose(view.now, ratio * self._unease(view.delay))
        velocity = self._now.follow(view)
        self._has_asked = self._has_asked or any(velocity)
        return velocity

    def workload(self) -> Mapping[str, float]:
        """Return how often the person waited, and the share of time it moved and waited."""
        if self._aims.total:
            return {"waits": 0.0, "move_and_wait_share": self._aims.waited / self._aims.total}
        total = sum(self._times.values())
        share = self._times["move_and_wait"] / total if total else 0.0
        return {**self._moves.workload(), "move_and_wait_share": share}

    @property
    def _now(self) -> Strategy:
        return self._pursuit if self.using == "closed" else self._moves

    def _prefers_to_wait(self, left: float, delay: float) -> float:
        """Return the preference for waiting, with so much path left [m]; 1: indifferent.

        It is the ratio of the two times that it expects, times its unease at the delay. In a closed
        loop that is the pace that the delay allows, and the time to close an error.
        """
        person = self.person
        delay = max(delay, SHORTEST)
        farthest = person.habits.steering.farthest_look_m
        pace = min(person.caution * farthest / delay, self._most)
        closed = left / pace + 1.0 / gain_at(person.crossover, person.margin, delay)
        waiting = self._waiting(left, max(left / self._moves.trusted, 1.0), delay)
        return closed / waiting * self._unease(delay)

    def _unease(self, delay: float) -> float:
        """Return the factor by which acting on such a late picture seems worse than it is."""
        return delay / (self._habits.driven * self.person.waits_from)

    def _waiting(self, distance: float, moves: float, delay: float) -> float:
        """Return the expected time to finish in a number of moves, each with its wait [s]."""
        a_move = max(self._habits.shortest_s, self.period.value)
        return distance / self._most + moves * (a_move + self._moves.moves.usual_wait(delay))

    def _choose(self, now: float, liking: float) -> None:
        """Move and wait if the person likes that better; change back only between two moves."""
        if self._last is not None:
            gap = now - self._last
            self._times[self.using] += gap if gap < GAP else GAP
        self._last = now
        if self.using == "closed" and liking > 1.0:
            self.using = "move_and_wait"
            if self._has_asked:
                self._moves.halt(now)
            self.switches += 1
        elif self.using != "closed" and liking < LEAVE_WAITING_SHARE and self._moves.moves.rests:
            self.using = "closed"
            self.switches += 1
