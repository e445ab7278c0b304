"""One task after the other: each takes the best of who is left."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray
from typing_extensions import override

from dva_sim.core.dispatch.situation import Advice, Assignment, Floats, Policy, Situation


class Free:
    """Responders available in one decision: each idle one once, robots only with a free operator.

    Attributes:
        robots: True for responders that are robots, shape `(responders,)`.
        operators: Number of robots that can still be sent.
    """

    def __init__(self, situation: Situation) -> None:
        team = situation.responders
        self.robots = np.array([r.kind == "robot" for r in team], dtype=bool)
        self.operators = situation.operators
        self._barred = np.array([0.0 if r.engaged is None else np.inf for r in team])
        self._bar_robots()

    def best(self, cost: Floats) -> int | None:
        """Return the place of the cheapest, the first of equals; None if nobody is left who can.

        Args:
            cost: Cost of each responder, shape `(responders,)`; infinite means never.
        """
        if not self._any:
            return None
        total = cost + self._barred
        best = int(total.argmin())
        return best if total[best] < np.inf else None

    def able(self, cost: Floats) -> NDArray[np.intp]:
        """Return places of all who are left and can."""
        return np.flatnonzero(cost + self._barred < np.inf)

    def take(self, responder: int) -> None:
        """Send somebody: it is not free any more, nor is an operator if it is a robot."""
        self._barred[responder] = np.inf
        if self.robots[responder]:
            self.operators -= 1
        self._bar_robots()

    def _bar_robots(self) -> None:
        if self.operators <= 0:
            self._barred[self.robots] = np.inf
        self._any = bool((self._barred < np.inf).any())


def waiting(situation: Situation) -> list[int]:
    """Places of the tasks that can be done now and that nobody is under way to, oldest first."""
    tasks = enumerate(situation.tasks)
    return [index for index, task in tasks if task.due and task.engaged is None]


def reachable(situation: Situation, cost: Floats) -> Floats:
    """Return the cost, infinite where the responder would never arrive."""
    return np.where(np.isfinite(situation.eta), cost, np.inf)


def serve(tasks: Iterable[int], cost: Floats, free: Free) -> list[Assignment]:
    """Give each task in turn the cheapest responder that is left.

    Args:
        tasks: Places of tasks, in the order in which they may choose.
        cost: Shape `(tasks, responders)`; infinite means never.
        free: Free responders; those sent are removed.
    """
    chosen = []
    for task in tasks:
        best = free.best(cost[task])
        if best is not None:
            free.take(best)
            chosen.append(Assignment(task, best))
    return chosen


class NearestIdle(Policy):
    """Oldest task first, to the responder with the shortest route."""

    @override
    def advise(self, situation: Situation, rng: np.random.Generator) -> Sequence[Advice]:
        cost = reachable(situation, situation.distance)
        return serve(waiting(situation), cost, Free(situation))


class MinEta(Policy):
    """Oldest task first; the earliest expected arrival: path length, speed and mobilisation."""

    @override
    def advise(self, situation: Situation, rng: np.random.Generator) -> Sequence[Advice]:
        return serve(waiting(situation), situation.eta, Free(situation))


class Preference(Policy):
    """Oldest task first; the first free one on the list of the event's zone.

    Responders that are not on the list do not go. Where no lists are configured all are equal, and
    the order of registration decides, as it does among equals on a list.
    """

    @override
    def advise(self, situation: Situation, rng: np.random.Generator) -> Sequence[Advice]:
        listed = situation.preference.size > 0
        rank = situation.preference if listed else np.zeros_like(situation.eta)
        return serve(waiting(situation), reachable(situation, rank), Free(situation))


class RandomChoice(Policy):
    """Any idle responder that can get there: the floor that other policies must beat."""

    @override
    def advise(self, situation: Situation, rng: np.random.Generator) -> Sequence[Advice]:
        free = Free(situation)
        chosen = []
        for task in waiting(situation):
            able = free.able(situation.eta[task])
            if able.size:
                pick = int(able[rng.integers(able.size)])
                free.take(pick)
                chosen.append(Assignment(task, pick))
        return chosen
