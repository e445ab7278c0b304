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
from dva_sim.storms.plan import Fault
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


EMERGENCY = Fault("emergency", 20.0, target="robot-*", on="SetTeleOp")
OTHERS = (
    Fault("clock-drifts", 16.0, 5.0, "robot-1"),
    Fault("messages-doubled", 17.0, 5.0, "operator-1", value=0.2),
    Fault("asks-twice", 30.0, 0.0, "operator-1", value=1.0),
)


@pytest.mark.system
def test_a_planted_bug_is_found_and_its_storm_is_cut_down_to_what_matters():
    plan = small(*OTHERS, EMERGENCY)
    with planted("emergency-forgotten") as bug:
        outcome = play(plan)
        smallest = Shrinker(plan, outcome, tries=12).shrink()
    assert bug.acts
    assert "S3" in outcome.signature
    assert smallest.faults == (EMERGENCY,)
    assert play(smallest).is_clean
