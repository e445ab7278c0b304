"""Causes stated for conditions that miss their bands."""

import numpy as np

from dva_sim.network.pattern_runs import Condition
from dva_sim.validation.network.comparison import NetworkComparison
from dva_sim.validation.network.evidence import lines_of
from dva_sim.validation.network.pooling import pool
from dva_sim.validation.network.reference import SocketRun, load_plan, load_runs
from dva_sim.validation.network.verdicts import BY_NAME, ComparedCell, ConditionGroup, judge


def compared(*rates):
    """A condition without loss for each rate [1/s], predicted to be 10."""
    verdicts = []
    for rate in rates:
        condition = Condition("pub", rate)
        values = {"emu_late_p99_ms": 0.2, "n_applied": 100}
        run = SocketRun(condition, "reference", "A", 1, True, True, values)
        group = ConditionGroup(condition, "lossless", (run,))
        measure = BY_NAME["applied_hz"]
        verdicts.append(judge(ComparedCell(group, measure, np.array([rate]), np.array([10.0]))))
    pooled = pool([], np.random.default_rng(1))
    return NetworkComparison([v.cell.group for v in verdicts], [], verdicts, pooled, [])


def test_each_miss_has_its_cause_or_is_said_to_have_none():
    found = compared(10.0, 20.0, 30.0)
    known = {Condition("pub", 20.0).label: "a full queue"}
    assert [(line.verdict, line.note) for line in lines_of(found, known)] == [
        ("holds", ""),
        ("misses", "a full queue"),
        ("misses", "cause not known"),
    ]


def test_known_causes_are_those_of_conditions_that_were_measured():
    plan = load_plan()
    measured = {run.condition.label for run in load_runs(plan.sources)}
    assert plan.causes
    assert set(plan.causes) <= measured
