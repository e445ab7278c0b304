"""Static instances turned and shuffled: a policy must choose the same all the same."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from dva_sim.core.dispatch import Assignment, Responder, Situation, Task, load_policy
from dva_sim.experiments.validation.dispatch.sample import Floats, Ints

POLICIES = (
    "nearest_idle",
    "min_eta",
    "batch_optimal",
    "priority_eta",
    "preemptive",
    "operator_aware",
    "hazard_team",
)
INSTANCES = 50
Choice = set[tuple[int, str]]
Flags = NDArray[np.bool_]


def changed_choices(seed: int) -> Iterator[tuple[str, float]]:
    """How often each policy chooses otherwise once a place is turned and its team shuffled."""
    changed = dict.fromkeys(POLICIES, 0)
    rng = np.random.Generator(np.random.PCG64(seed))
    for _ in range(INSTANCES):
        events, units = 1 + int(rng.integers(6)), 1 + int(rng.integers(6))
        goals, starts = rng.uniform(0, 300, (events, 2)), rng.uniform(0, 300, (units, 2))
        severities, robots = rng.random(events), rng.random(units) < 0.4
        order, angle = rng.permutation(units), float(rng.uniform(0, 2 * math.pi))
        same = np.arange(units)
        for policy in POLICIES:
            before = _choice(policy, goals, starts, severities, robots, same)
            after = _choice(
                policy, _turned(goals, angle), _turned(starts, angle), severities, robots, order
            )
            changed[policy] += before != after
    for policy, count in changed.items():
        yield f"of {INSTANCES} choices of {policy}: changed by turning and shuffling", float(count)


def _turned(points: Floats, angle: float) -> Floats:
    """The points rotated about somewhere far away, shape `(n, 2)`."""
    cosine, sine = math.cos(angle), math.sin(angle)
    turn = np.array([[cosine, -sine], [sine, cosine]])
    return np.asarray((points - [1000.0, -500.0]) @ turn.T)


def _choice(
    policy: str, goals: Floats, starts: Floats, severities: Floats, robots: Flags, order: Ints
) -> Choice:
    """Who is sent where, by number of the event and name."""
    tasks = tuple(
        Task(
            number + 1, "fire", "confirm", True, float(severity), 0.9, float(number), float(number)
        )
        for number, severity in enumerate(severities)
    )
    team = tuple(Responder(f"unit-{n}", "robot" if robots[n] else "guard") for n in order)
    away = goals[:, None, :] - starts[None, order, :]
    distance = np.hypot(away[..., 0], away[..., 1])
    speed = np.where(robots[order], 0.5, 1.4)
    operators = int(robots.sum() + 1) // 2
    situation = Situation(20.0, tasks, team, distance, distance / speed, operators=operators)
    advice = load_policy(policy).advise(situation, np.random.Generator(np.random.PCG64(1)))
    sent = (piece for piece in advice if isinstance(piece, Assignment))
    return {(tasks[piece.task].event, team[piece.responder].device) for piece in sent}
