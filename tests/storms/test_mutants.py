"""Planted bugs: each has a function to replace, acts, is found, and is gone afterwards."""

import importlib
from dataclasses import replace

import pytest
from helpers.wording import unnamed
from storms.test_storms import small

from dva_sim.agents.robot.controller import RobotController
from dva_sim.kernel.errors import ConfigError
from dva_sim.storms import hunting, mutants
from dva_sim.storms.hunting import hunt
from dva_sim.storms.mutants import MUTANTS, Mutant, named, planted
from dva_sim.storms.plan import Fault, StormPlan
from dva_sim.storms.shrinking import Shrinker
from dva_sim.storms.storm import play

RULES = {f"S{number}" for number in range(1, 12)}


def function_of(mutant: Mutant):
    module, _, path = mutant.place.partition(":")
    found = importlib.import_module(module)
    for step in path.split("."):
        found = getattr(found, step)
    return found


@pytest.mark.parametrize("name", MUTANTS)
def test_a_mutant_replaces_a_function_and_leaves_no_trace(name):
    before = function_of(MUTANTS[name])
    with planted(name) as bug:
        assert function_of(MUTANTS[name]) is not before
    assert function_of(MUTANTS[name]) is before
    assert bug.acts == 0


def test_there_are_thirty_of_them_over_the_rules():
    assert len(MUTANTS) >= 30
    assert RULES - {mutant.rule for mutant in MUTANTS.values()} <= {"S9"}


def test_a_mutant_whose_function_is_gone_fails_when_it_is_planted(monkeypatch):
    monkeypatch.delattr(RobotController, "_stop")
    with pytest.raises((AttributeError, KeyError)), planted("stop-ignored"):
        pass


def test_an_unknown_mutant_is_refused():
    with pytest.raises(ConfigError) as refused:
        named("stop-ignore")
    assert unnamed(str(refused.value), "stop-ignore", "stop-ignored") == []


def test_a_bug_that_does_nothing_is_not_found(monkeypatch):
    idle = Mutant("S1", "none", MUTANTS["stop-ignored"].place, lambda original, bug: original)
    monkeypatch.setitem(mutants.MUTANTS, "idle", idle)
    monkeypatch.setattr(hunting, "draw", lambda *_: replace(small(), calm_s=5.0))
    assert hunt("idle", range(1), "none").rules == ()


def test_hunts_are_a_table_with_a_line_for_each():
    found = hunting.Hunt("stop-ignored", 3, ("S1", "S2"), 7, "")
    missed = hunting.Hunt("counts-wrong", 8, (), 0, "")
    *_, first, second = hunting.table([found, missed]).splitlines()
    assert unnamed(first, "S1", "stop-ignored", "3", "S2", "7") == []
    assert unnamed(second, "S6", "counts-wrong", "not in 8", "0") == []


TEAM = {
    "site": {"name": "hall"},
    "robot": {"count": 1, "processing_s": 0.01},
    "guard": {"count": 0},
    "operator": {"count": 1},
    "pattern": "req-rep",
    "camera": {"rate_hz": 5, "frame_bytes": 4000},
    "link": {"delay_s": 0.005},
    "events": [{"kind": "fire", "at_s": 100.0, "reported": True}],
}
AGAIN = tuple(
    Fault("order-again", 16.0 + 20 * n, 0.0, "robot-1", on=on, value=2.0)
    for n, on in enumerate(("CancelMission", "StopTeleOp") * 4 + ("CancelMission",))
)
FLOODS = tuple(
    Fault("flood-in-doubt", 16.0 + 10 * n, 6.0, "robot-1", value=150.0) for n in range(14)
)
HANGS = (Fault("vanishes", 16.0, 40.0, "operator-1"), Fault("robot-hangs", 20.0, 45.0, "robot-1"))


@pytest.mark.system
@pytest.mark.parametrize(
    ("mutant", "faults", "rule"),
    [
        ("orders-act-again", AGAIN, "S1"),
        ("questions-without-bound", FLOODS, "S10"),
        ("subscribes-once", HANGS, "S8"),
    ],
)
def test_what_storms_seldom_lead_to_is_found_where_they_do(mutant, faults, rule):
    plan = StormPlan(2, TEAM, faults, 200.0, drivers=1)
    with planted(mutant) as bug:
        outcome = play(plan)
    assert bug.acts
    assert outcome.signature == {rule}


EMERGENCY = Fault("emergency", 20.0, target="robot-*", on="SetTeleOp")
OTHERS = (
    Fault("clock-drifts", 16.0, 5.0, "robot-1"),
    Fault("messages-doubled", 17.0, 5.0, "operator-1", value=0.2),
    Fault("asks-twice", 30.0, 0.0, "operator-1", value=1.0),
)


@pytest.mark.system
def test_a_planted_bug_is_found_and_its_storm_is_cut_down_to_what_matters():
    plan = small(*OTHERS, EMERGENCY)
    with planted("emergency-of-holder-only") as bug:
        outcome = play(plan)
        smallest = Shrinker(plan, outcome, tries=12).shrink()
    assert bug.acts
    assert "S3" in outcome.signature
    assert smallest.faults == (EMERGENCY,)
    assert play(smallest).is_clean
