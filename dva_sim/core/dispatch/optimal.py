"""All tasks at once: the assignment that is best as a whole."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray
from typing_extensions import override

from dva_sim.core.dispatch.greedy import waiting
from dva_sim.core.dispatch.situation import Advice, Assignment, Floats, Policy, Situation
from dva_sim.kernel import options

_OBJECTIVES: Final = ("eta", "distance")


class BatchOptimal(Policy):
    """Serve as many tasks as possible, with the least total ETA for that number.

    With more tasks than responders the tasks near a responder go first, so a distant one could
    starve. Therefore a second of waiting counts for a task like `ageing_per_s` seconds less of
    travel: whatever the distances, a task that waits long enough wins. If all tasks can be
    served, or all have waited equally long, ageing changes nothing.

    No more robots are sent than operators are free.

    Args:
        objective: Cost to minimise: `eta` [s] or `distance` [m].
        ageing_per_s: Value of a second of waiting, in units of the objective per second.

    References:
        D. F. Crouse, On implementing 2D rectangular assignment algorithms, IEEE Trans.
        Aerospace and Electronic Systems 52(4), 2016: what scipy's `linear_sum_assignment` does.
    """

    def __init__(self, objective: str = "eta", ageing_per_s: float = 1.0) -> None:
        self.objective = options.one_of("objective", objective, _OBJECTIVES)
        self.ageing_per_s = options.number("ageing_per_s", ageing_per_s, least=0)
        self.operator_worth = 0.0

    @override
    def advise(self, situation: Situation, rng: np.random.Generator) -> Sequence[Advice]:
        tasks = np.array(waiting(situation), dtype=np.intp)
        team = situation.responders
        idle = np.array(
            [r for r, responder in enumerate(team) if responder.engaged is None], dtype=np.intp
        )
        if not tasks.size or not idle.size:
            return []
        robots = np.array([team[r].kind == "robot" for r in idle], dtype=bool)
        cost = self._cost(situation, tasks, idle)
        cost[:, robots] += self.operator_worth
        pairs = match(cost, robots, situation.operators)
        return [Assignment(int(tasks[row]), int(idle[column])) for row, column in pairs]

    def _cost(
        self, situation: Situation, tasks: NDArray[np.intp], idle: NDArray[np.intp]
    ) -> Floats:
        """Return the cost of each pair, shape `(tasks, idle)`; infinite means never."""
        here = np.ix_(tasks, idle)
        cost = situation.eta[here]
        if self.objective == "distance":
            cost = np.where(np.isfinite(cost), situation.distance[here], np.inf)
        since = np.array([situation.tasks[task].waiting_since for task in tasks])
        cost -= self.ageing_per_s * (situation.now - since)[:, None]
        return cost


class OperatorAware(BatchOptimal):
    """`batch_optimal` by ETA, where sending a robot must be worth an operator.

    Operators are scarcer than robots, and one who drives is missing at the next event. So they
    go where a robot saves most against a person, and where it saves too little a person goes.
    A task that no person is left for gets a robot in any case.

    Args:
        operator_worth_s: Time by which a robot must be faster than a person [s]; with 0 it is the
            least total ETA with at most as many robots as there are operators.
        ageing_per_s: Value of a second of waiting, as in `BatchOptimal`.
    """

    def __init__(self, operator_worth_s: float = 30.0, ageing_per_s: float = 1.0) -> None:
        super().__init__("eta", ageing_per_s)
        self.operator_worth = options.number("operator_worth_s", operator_worth_s, least=0)


def match(cost: Floats, robots: NDArray[np.bool_], operators: int) -> list[tuple[int, int]]:
    """Return the cheapest largest matching with at most `operators` robots, as (row, column).

    An impossible pair costs more than everything else together, so the largest matchings win.

    The limit is exact by dummy rows: one for each robot beyond the operators, which must take a
    robot and nothing else. So many robots are then out, which ones is chosen together with
    the rest; and every matching within the limit leaves enough robots over for the dummies.

    Args:
        cost: Shape `(tasks, responders)`; infinite means never.
        robots: True for columns that are robots.
        operators: Number of robots that can be sent.
    """
    from scipy.optimize import linear_sum_assignment

    possible = np.isfinite(cost)
    if operators <= 0:
        possible &= ~robots
    if not possible.any():
        return []
    values = cost[possible]
    lowest = values.min()
    never = (values.max() - lowest + 1.0) * (cost.shape[1] + 1)
    matrix = np.where(possible, cost - lowest, never)
    surplus = int(robots.sum()) - operators
    if operators > 0 and surplus > 0:
        dummy = np.where(robots, -never * (cost.shape[1] + 1), never)
        matrix = np.vstack([matrix, np.tile(dummy, (surplus, 1))])
    rows, columns = linear_sum_assignment(matrix)
    real = rows < len(cost)
    pairs = zip(rows[real].tolist(), columns[real].tolist(), strict=True)
    return [(row, column) for row, column in pairs if possible[row, column]]
