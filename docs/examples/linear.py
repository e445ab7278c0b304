"""An example of a learnt policy: each pair of task and responder has a score, linear in features.

`cross_entropy.py` found the weights by playing shifts. Name it as
`docs/examples/linear.py:Linear`; other weights are an option.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from dva_sim.core.dispatch import Advice, Assignment, Policy, Situation
from dva_sim.kernel.errors import ConfigError

Floats = NDArray[np.float64]

FEATURES = (
    "one",  # to send at all, rather than to wait
    "eta",  # expected time to arrival [100 s]
    "lead",  # by how much the responder is there before any other free one [100 s]
    "detour",  # by how much it is farther than that responder's nearest task [100 s]
    "robot",
    "robot_danger",  # a robot, and a fire or gas leak to look at
    "contain",
    "severity",
    "age",  # since the event was reported [100 s]
)
# Learnt by `python docs/examples/cross_entropy.py --rounds 15`, which begins with `FIRST`.
WEIGHTS = (6.207, -3.025, 4.601, -0.116, -0.82, -0.126, -4.229, 1.551, -0.599)
FIRST = (5.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 2.0)  # decides much as `min_eta` does
MOST = 3.0  # [100 s]; what is longer counts like this


def features(eta: Floats, about: Floats, robot: Floats) -> Floats:
    """Features of each pair of a task and a responder.

    Args:
        eta: Expected time to arrival [s], shape `(tasks, responders)`; infinite for never.
        about: Each task: is it dangerous, is it to contain, its severity, its age [s];
            shape `(tasks, 4)`.
        robot: 1 for robots, shape `(responders,)`.

    Returns:
        Shape `(tasks, responders, len(FEATURES))`.
    """
    scaled = np.minimum(eta / 100.0, MOST)
    danger, contain, severity, age = about.T[:, :, None] * np.ones_like(scaled)
    each = np.ones_like(scaled) * robot
    return np.stack(
        [
            np.ones_like(scaled),
            scaled,
            _least_of_others(scaled, 1) - scaled,
            scaled - np.minimum(scaled, _least_of_others(scaled, 0)),
            each,
            each * danger * (1.0 - contain),
            contain,
            severity,
            np.minimum(age / 100.0, MOST),
        ],
        axis=-1,
    )


def _least_of_others(values: Floats, axis: int) -> Floats:
    """Least value of all others along an axis; `MOST` if there are none."""
    if values.shape[axis] < 2:
        return np.full_like(values, MOST)
    two = np.partition(values, 1, axis=axis)
    first, second = np.take(two, [0], axis), np.take(two, [1], axis)
    return np.where(values == first, second, first)


class Linear(Policy):
    """The best score first, until none is above zero.

    Args:
        weights: One for each of `FEATURES`.
    """

    def __init__(self, weights: Sequence[float] = WEIGHTS) -> None:
        if len(weights) != len(FEATURES):
            raise ConfigError(f"option 'weights' has {len(weights)} numbers, not {len(FEATURES)}")
        self.weights = np.array(weights, dtype=np.float64)

    def advise(self, situation: Situation, rng: np.random.Generator) -> Sequence[Advice]:
        """Assign responders to due tasks by the weighted features."""
        tasks, team = situation.tasks, situation.responders
        due = [t.due and t.engaged is None for t in tasks]
        if not any(due):
            return []
        robot = np.array([r.kind == "robot" for r in team], dtype=np.float64)
        about = np.array(
            [
                (t.kind != "flood", t.stage == "contain", t.severity, situation.now - t.detected)
                for t in tasks
            ],
            dtype=np.float64,
        )
        score = features(situation.eta, about, robot) @ self.weights
        score[~np.isfinite(situation.eta)] = -np.inf
        score[~np.array(due)] = -np.inf
        return self._best(score, robot, situation.operators)

    @staticmethod
    def _best(score: Floats, robot: Floats, operators: int) -> list[Assignment]:
        chosen = []
        if operators <= 0:
            score[:, robot > 0] = -np.inf
        while score.size and score.max() > 0.0:
            task, responder = (int(n) for n in np.unravel_index(score.argmax(), score.shape))
            chosen.append(Assignment(task, responder))
            score[task], score[:, responder] = -np.inf, -np.inf
            operators -= int(robot[responder])
            if operators <= 0:
                score[:, robot > 0] = -np.inf
        return chosen
