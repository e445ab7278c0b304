"""Planted bugs: each has a function to replace, acts, is found, and is gone afterwards."""

import importlib
import inspect
from dataclasses import replace

import pytest
from helpers.mutation import bugs, hunting
from helpers.mutation.bugs import BUGS, planted
from helpers.mutation.hunting import hunt, hunted
from helpers.mutation.planting import Bug
from helpers.wording import unnamed
from storms.test_storms import small

from dva_sim.agents.robot.controller import RobotController
from dva_sim.storms.plan import Fault, StormPlan
from dva_sim.storms.shrinking import Shrinker
from dva_sim.storms.storm import play

RULES = {f"S{number}" for number in range(1, 12)}


def function_of(bug: Bug):
    module, _, path = bug.place.partition(":")
    found = importlib.import_module(module)
    for step in path.split("."):
        found = getattr(found, step)
    return found


@pytest.mark.parametrize("name", BUGS)
def test_a_bug_replaces_a_function_and_leaves_no_trace(name):
    before = function_of(BUGS[name])
    with planted(name) as bug:
        after = function_of(BUGS[name])
    assert after is not before
    assert function_of(BUGS[name]) is before
    assert bug.acts == 0
    takes = inspect.signature(after, follow_wrapped=False)
    for by_place, by_name in ways_to_call(before):
        takes.bind(*by_place, **by_name)


def ways_to_call(function):
    """The names of the arguments that a function must get, and those that it may."""
    given = inspect.signature(function).parameters.values()
    for asked in ([each for each in given if each.default is each.empty], given):
        by_name = {each.name: None for each in asked if each.kind is each.KEYWORD_ONLY}
        yield [each.name for each in asked if each.name not in by_name], by_name


def test_every_rule_of_a_storm_has_a_bug_that_breaks_it():
    assert RULES - {bug.rule for bug in BUGS.values()} <= {"S9"}


def test_a_bug_whose_function_is_gone_fails_when_it_is_planted(monkeypatch):
    monkeypatch.delattr(RobotController, "_stop")
    with pytest.raises(AttributeError, match="_stop is no function"), planted("stop-ignored"):
        pass


def test_a_bug_that_does_nothing_is_not_found(monkeypatch):
    idle = Bug("idle", "S1", "none", BUGS["stop-ignored"].place, lambda original, bug: original)
    monkeypatch.setitem(bugs.BUGS, "idle", idle)
    monkeypatch.setattr(hunting, "draw", lambda seed: replace(small(), calm_s=5.0))
    trial = hunt("idle", 1)
    assert trial.noticed_by == ""
    assert unnamed(str(trial), "NOT SEEN", "idle", "S1", "did not act") == []


@pytest.mark.system
def test_each_hunt_in_processes_of_its_own_says_which_rule_found_the_bug_and_when():
    names = ["speed-not-clamped", "emergency-of-holder-only"]
    trials = list(hunted([BUGS[name] for name in names], 2, 2))
    assert [trial.name for trial in trials] == names
    assert [trial.noticed_by for trial in trials] == [hunt(name, 2).noticed_by for name in names]
    assert unnamed(str(trials[0]), "noticed", "S4", "in storm 1", "acted", "m/s") == []


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
    ("name", "faults", "rule"),
    [
        ("orders-act-again", AGAIN, "S1"),
        ("questions-without-bound", FLOODS, "S10"),
        ("subscribes-once", HANGS, "S8"),
    ],
)
def test_what_storms_seldom_lead_to_is_found_where_they_do(name, faults, rule):
    plan = StormPlan(2, TEAM, faults, 200.0, drivers=1)
    with planted(name) as bug:
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
