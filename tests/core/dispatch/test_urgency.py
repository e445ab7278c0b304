"""The most urgent first, and taking somebody away for it."""

import numpy as np
import pytest
from helpers.dva.dispatch_situations import INF, act, look, pairs, situation

from dva_sim.core.dispatch import Preemptive, PriorityEta


def test_the_worst_goes_first():
    tasks = [look(1, severity=0.2), look(2, severity=0.9), look(3, severity=0.5)]
    assert pairs(PriorityEta(), situation("g", [[1], [1], [1]], tasks)) == [(1, 0)]


def test_without_ageing_equals_are_served_as_they_came_and_no_wait_outweighs_severity():
    tasks = [look(1, severity=0.5), look(2, severity=0.51, since=9e6), look(3, severity=0.51)]
    seen = situation("gg", [[1, 2]] * 3, tasks, now=1e7)
    assert pairs(PriorityEta(ageing_per_s=0), seen) == [(1, 0), (2, 1)]


def test_with_ageing_a_harmless_one_passes_after_it_has_waited_long_enough():
    """0.8 apart at 0.002 a second: 400 s."""
    for waited, first in ((399.0, 1), (401.0, 0)):
        tasks = [look(1, severity=0.1), look(2, severity=0.9, since=waited)]
        seen = situation("g", [[1], [1]], tasks, now=waited)
        assert pairs(PriorityEta(ageing_per_s=0.002), seen) == [(first, 0)]


def under_way(severity_now, severity_new, eta_idle, eta_busy, stage=look):
    """Guard 1 is under way to task 0; task 1 is new; guard 0 is idle."""
    tasks = [look(1, severity=severity_now, engaged=1), stage(2, severity=severity_new)]
    return situation("gg0", [[9, 9], [eta_idle, eta_busy]], tasks)


def test_who_is_under_way_is_redirected_to_what_is_clearly_worse_if_nobody_idle_can_go():
    assert pairs(Preemptive(margin=0.3), under_way(0.3, 0.6, INF, 20)) == [(1, 1)]
    assert pairs(Preemptive(margin=0.3), under_way(0.31, 0.6, INF, 20)) == []
    assert pairs(Preemptive(margin=0.3), under_way(0.3, 0.6, INF, INF)) == []
    assert pairs(Preemptive(margin=0.3), under_way(0.2, 0.9, INF, 20, act)) == [(1, 1)]


def test_somebody_idle_goes_unless_much_later():
    policy = Preemptive(gain_s=30)
    assert pairs(policy, under_way(0.1, 0.9, 50, 20)) == [(1, 0)]
    assert pairs(policy, under_way(0.1, 0.9, 51, 20)) == [(1, 1)]


def test_of_those_under_way_the_earliest_is_redirected_and_only_once():
    tasks = [look(1, severity=0.1, engaged=0), look(2, severity=0.1, engaged=1)]
    tasks += [look(3, severity=0.9), look(4, severity=0.8), look(5, severity=0.7)]
    eta = [[5, 5], [5, 5], [40, 30], [40, 30], [40, 30]]
    assert pairs(Preemptive(), situation("g0g1", eta, tasks)) == [(2, 1), (3, 0)]


def test_a_redirected_robot_keeps_its_operator():
    tasks = [look(1, severity=0.1, engaged=0), look(2, severity=0.9)]
    seen = situation("r0r", [[5, 5], [30, 90]], tasks, operators=0)
    assert pairs(Preemptive(), seen) == [(1, 0)]


def test_waiting_alone_takes_nobody_away():
    tasks = [look(1, severity=0.5, engaged=0), look(2, severity=0.6, since=0.0)]
    seen = situation("g0", [[5], [5]], tasks, now=1e6)
    assert pairs(Preemptive(margin=0.3, ageing_per_s=1.0), seen) == []


def most_redirections(seed):
    """New events all the time, ways as chance will have them, and nobody ever arrives."""
    rng, policy = np.random.default_rng(seed), Preemptive(margin=0.25, gain_s=0)
    severities, holds, redirected = [], {}, [0, 0, 0]  # holds: guard -> task
    for _ in range(100):
        severities = [min(1.0, s + 0.1 * (rng.random() < 0.02)) for s in severities]
        severities.append(float(rng.random()))
        engaged = {task: guard for guard, task in holds.items()}
        tasks = [look(i, severity=s, engaged=engaged.get(i)) for i, s in enumerate(severities)]
        team = "".join(f"g{holds.get(guard, '')}" for guard in range(3))
        seen = situation(team, rng.uniform(1, 99, (len(tasks), 3)), tasks)
        for task, guard in pairs(policy, seen):
            redirected[guard] += guard in holds
            holds[guard] = task
    return max(redirected)


@pytest.mark.system
def test_between_two_arrivals_nobody_is_redirected_more_often_than_one_over_the_margin():
    assert 2 <= max(most_redirections(seed) for seed in range(8)) <= 1 / 0.25
