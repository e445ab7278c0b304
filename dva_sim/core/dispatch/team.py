"""Robots and people together: the robot looks, the person stands by."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final

import numpy as np
from typing_extensions import override

from dva_sim.core.dispatch.greedy import Free, serve, waiting
from dva_sim.core.dispatch.situation import Advice, Assignment, Floats, Policy, Situation
from dva_sim.kernel import options
from dva_sim.protocol.event_kinds import EVENT_KINDS

_REMEMBERED: Final = 1000  # events


class HazardTeam(Policy):
    """Send a robot to look where it is dangerous, with a person on stand-by to act.

    A dangerous event is confirmed by the robot that is there first, unless a person would be
    there much earlier, or there is no robot or operator: then a person goes. While a robot is
    there, and nothing else waits for a person, one is given the `contain` task already, and
    waits outside. Harmless kinds, and what is to be contained, go to the earliest.

    It remembers which events it gave to a robot. If that advice was not taken, the event is
    open again, and what is remembered is what is advised then.

    Args:
        dangerous: Kinds of events that people should not look at first.
        extra_s: Time by which a robot may be slower than a person [s].
    """

    def __init__(
        self, dangerous: Iterable[str] = ("fire", "gas_leak"), extra_s: float = 60.0
    ) -> None:
        self.dangerous = options.some_of("dangerous", dangerous, EVENT_KINDS)
        self.extra_s = options.number("extra_s", extra_s, least=0)
        self._by_robot: dict[int, bool] = {}  # event: whether a robot looks at it

    @override
    def advise(self, situation: Situation, rng: np.random.Generator) -> Sequence[Advice]:
        free = Free(situation)
        chosen: list[Assignment] = []
        for task in waiting(situation):
            best = self._best(situation, task, free)
            if best is not None:
                free.take(best)
                chosen.append(Assignment(task, best))
        self._remember(situation, chosen)
        return [*chosen, *serve(self._to_stand_by(situation), situation.eta, free)]

    def _best(self, situation: Situation, task: int, free: Free) -> int | None:
        """Choose who goes: for a dangerous look a robot, unless it is much later than a person."""
        eta = situation.eta[task]
        what = situation.tasks[task]
        if what.stage != "confirm" or what.kind not in self.dangerous:
            return free.best(eta)
        robot = free.best(_only(eta, free.robots))
        person = free.best(_only(eta, ~free.robots))
        if robot is None or person is None:
            return person if robot is None else robot
        return robot if eta[robot] <= eta[person] + self.extra_s else person

    def _remember(self, situation: Situation, chosen: Sequence[Assignment]) -> None:
        for task in waiting(situation):
            self._by_robot.pop(situation.tasks[task].event, None)
        for choice in chosen:
            robot = situation.responders[choice.responder].kind == "robot"
            self._by_robot[situation.tasks[choice.task].event] = robot
        for event in list(self._by_robot)[:-_REMEMBERED]:
            del self._by_robot[event]

    def _to_stand_by(self, situation: Situation) -> list[int]:
        """Tasks that a person can wait for: those of dangerous events that a robot looks at."""
        return [
            index
            for index, task in enumerate(situation.tasks)
            if task.stage == "contain" and not task.due and task.engaged is None
            if task.kind in self.dangerous and self._by_robot.get(task.event, False)
        ]


def _only(cost: Floats, mask: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> Floats:
    """Return the cost, infinite for all others."""
    return np.where(mask, cost, np.inf)
