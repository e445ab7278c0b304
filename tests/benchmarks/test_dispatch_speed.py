"""What a decision over 1000 tasks and 500 responders costs, against the bare arithmetic of it."""

import timeit

import numpy as np
import pytest
from benchmarks.goals import goal
from scipy.optimize import linear_sum_assignment

from dva_sim.core.dispatch import Responder, Situation, Task, known_policies, load_policy

TASKS, GUARDS, ROBOTS = 1000, 250, 250


def situation(operators):
    rng = np.random.default_rng(1)
    team = GUARDS + ROBOTS
    goals, starts = rng.uniform(0, 400, (TASKS, 1, 2)), rng.uniform(0, 400, (1, team, 2))
    distance = np.abs(goals - starts).sum(axis=2)
    distance[rng.random(distance.shape) < 0.05] = np.inf
    tasks = tuple(
        Task(
            event=e,
            kind="fire",
            stage="confirm",
            due=True,
            severity=float(rng.random()),
            confidence=0.9,
            detected=0.3 * e,
            waiting_since=0.3 * e,
        )
        for e in range(1, TASKS + 1)
    )
    responders = tuple(
        Responder(f"device-{i}", "guard" if i < GUARDS else "robot") for i in range(team)
    )
    return Situation(
        now=300.0,
        tasks=tasks,
        responders=responders,
        distance=distance,
        eta=distance / 1.3,
        operators=operators,
    )


PLENTY, FEW = situation(ROBOTS), situation(10)


def bare_greedy():
    """Oldest first, the least ETA of who is left: nothing else."""
    eta, chosen = PLENTY.eta.copy(), []
    for task in range(TASKS):
        best = int(np.argmin(eta[task]))
        if eta[task, best] < np.inf:
            chosen.append((task, best))
            eta[:, best] = np.inf
    return chosen


def bare_assignment():
    waited = PLENTY.now - np.array([task.waiting_since for task in PLENTY.tasks])
    cost = np.minimum(PLENTY.eta, 1e6) - waited[:, None]
    return linear_sum_assignment(cost)


def best(function):
    """Fastest of several rounds [s per call]."""
    return min(timeit.repeat(function, number=1, repeat=7))


def decision(name, seen=PLENTY):
    policy = load_policy(name)
    return lambda: policy.advise(seen, np.random.default_rng(1))


def test_min_eta_against_a_bare_loop(benchmark):
    assert [(a.task, a.responder) for a in decision("min_eta")()] == bare_greedy()
    ours, bare = best(decision("min_eta")), best(bare_greedy)
    ratio = round(ours / bare, 2)
    benchmark.extra_info.update(ms=round(ours * 1e3, 2), over_bare_loop=ratio)
    print(f"\nmin_eta: {ours * 1e3:.1f} ms, {ratio} times a bare loop")
    goal("min_eta over a bare loop", ratio, most=1.5)
    benchmark(decision("min_eta"))


def test_batch_optimal_against_the_bare_assignment(benchmark):
    ours, bare = best(decision("batch_optimal")), best(bare_assignment)
    ratio = round(ours / bare, 2)
    few = round(best(decision("batch_optimal", FEW)) / bare, 2)
    benchmark.extra_info.update(ms=round(ours * 1e3, 2), over_bare=ratio, few_operators=few)
    print(f"\nbatch_optimal: {ours * 1e3:.0f} ms, {ratio} times the bare assignment")
    print(f"with 10 operators for {ROBOTS} robots: {few} times")
    goal("batch_optimal over the bare assignment", ratio, most=2)
    goal("with few operators", few, most=3)
    benchmark(decision("batch_optimal"))


@pytest.mark.parametrize("name", known_policies())
def test_every_policy(benchmark, name):
    print(f"\n{name}: {best(decision(name)) * 1e3:.1f} ms")
    benchmark(decision(name))
