"""Most urgent first, with and without redirecting responders from less urgent tasks."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from typing_extensions import override

from dva_sim.core.dispatch.greedy import Free, serve, waiting
from dva_sim.core.dispatch.situation import Advice, Assignment, Floats, Policy, Situation
from dva_sim.kernel import options

_ROUNDING = 1e-9  # tolerance for severities that differ by exactly the margin, 0.3 - 0.1 and 0.2


class PriorityEta(Policy):
    """The most urgent task first; the earliest expected arrival.

    Urgency is severity plus a share of the time that a task has waited for somebody. With no
    ageing this is the non-preemptive priority queue: strictly by severity, first come first
    served within one severity.

    Args:
        ageing_per_s: Severity that a second of waiting adds [1/s]. With 0.002 a harmless event (0)
            passes the worst one (1) after 500 s.
    """

    def __init__(self, ageing_per_s: float = 0.002) -> None:
        self.ageing_per_s = options.number("ageing_per_s", ageing_per_s, least=0)

    @override
    def advise(self, situation: Situation, rng: np.random.Generator) -> Sequence[Advice]:
        order = _most_urgent_first(situation, self.ageing_per_s)
        return serve(order, situation.eta, Free(situation))


class Preemptive(Policy):
    """`priority_eta` with preemption: responders may be redirected to clearly more urgent tasks.

    It does so only if no idle responder can serve the task well: not at all, or much later. What
    is left behind waits again, and is seen as such by the next decision.

    It cannot thrash. Redirection depends on severity alone, which never falls during an event's
    life. So each redirection raises the severity of a responder's task by at least the margin,
    and nothing lowers it before the responder arrives: between two idle times a responder is
    redirected at most `1 / margin` times.

    Args:
        margin: Least difference in severity between the new task and the one left behind.
        gain_s: Time by which the redirected responder must be faster than any idle one [s].
        ageing_per_s: Ageing as in `PriorityEta`; it orders the tasks, but redirects nobody.
    """

    preempts = True

    def __init__(
        self, margin: float = 0.3, gain_s: float = 30.0, ageing_per_s: float = 0.002
    ) -> None:
        self.margin = options.number("margin", margin, above=0)
        self.gain_s = options.number("gain_s", gain_s, least=0)
        self.ageing_per_s = options.number("ageing_per_s", ageing_per_s, least=0)

    @override
    def advise(self, situation: Situation, rng: np.random.Generator) -> Sequence[Advice]:
        eta = situation.eta
        free = Free(situation)
        left_behind = _left_behind(situation)
        chosen = []
        for task in _most_urgent_first(situation, self.ageing_per_s):
            idle = free.best(eta[task])
            before = (np.inf if idle is None else eta[task, idle]) - self.gain_s
            severity = situation.tasks[task].severity
            # The best idle responder's arrival, less the gain that a redirection needs.
            busy = self._under_way(eta[task], left_behind, severity, before)
            if busy is not None:
                left_behind[busy] = np.inf
                chosen.append(Assignment(task, busy))
            elif idle is not None:
                free.take(idle)
                chosen.append(Assignment(task, idle))
        return chosen

    def _under_way(
        self, eta: Floats, left_behind: Floats, severity: float, before: float
    ) -> int | None:
        """Choose whom to redirect: the earliest of those whose task is clearly less urgent."""
        may = (severity - left_behind >= self.margin - _ROUNDING) & np.isfinite(eta)
        if not (may & (eta < before)).any():
            return None
        return int(np.argmin(np.where(may, eta, np.inf)))


def _most_urgent_first(situation: Situation, ageing_per_s: float) -> list[int]:
    """Return indices of the waiting tasks; those of one urgency in the order they came."""

    def urgency(index: int) -> float:
        task = situation.tasks[index]
        return task.severity + ageing_per_s * (situation.now - task.waiting_since)

    return sorted(waiting(situation), key=urgency, reverse=True)  # stable, reversed too


def _left_behind(situation: Situation) -> Floats:
    """Return the severity of each responder's task; infinite for an idle responder."""
    tasks = situation.tasks
    under_way = (r.engaged for r in situation.responders)
    return np.array([np.inf if task is None else tasks[task].severity for task in under_way])
