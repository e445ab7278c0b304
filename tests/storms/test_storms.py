"""Storms: drawn from a seed, the same in every process, and no rule breaks in them."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from dva_sim.storms.drawing import PROFILES, draw
from dva_sim.storms.faults import FAULTS
from dva_sim.storms.plan import Fault, StormPlan, load_plan
from dva_sim.storms.storm import play

FOUND = sorted((Path(__file__).parent / "found").glob("*.yaml"))
SMALL: dict[str, Any] = {
    "robot": {"count": 1},
    "operator": {"count": 1},
    "guard": {"count": 0},
    "link": {"delay_s": 0.05},
    "camera": {"rate_hz": 2, "frame_bytes": 4000},
    "events": [{"kind": "flood", "at_s": 5, "reported": True}],
}


def small(*faults: Fault, calm: float = 60.0) -> StormPlan:
    """A storm of one robot and one operator."""
    return StormPlan(1, SMALL, faults, calm)


def test_a_plan_is_drawn_from_its_seed_and_read_again_from_its_file(tmp_path):
    plan = draw(5)
    assert draw(5) == plan != draw(6)
    file = tmp_path / "plan.yaml"
    file.write_text(plan.text(), encoding="utf-8")
    assert load_plan(file).as_plain() == plan.as_plain()


def test_every_kind_of_fault_is_drawn_and_ends_before_the_calm():
    plans = [draw(seed) for seed in range(40)]
    assert {fault.kind for plan in plans for fault in plan.faults} == set(FAULTS)
    assert all(fault.at_s + fault.for_s < plan.calm_s for plan in plans for fault in plan.faults)


@pytest.mark.parametrize("profile", PROFILES)
def test_a_profile_draws_its_own_kinds_alone(profile):
    kinds = {fault.kind for seed in range(40) for fault in draw(seed, profile).faults}
    assert kinds <= set(PROFILES[profile])


def test_a_driver_keeps_a_robot_moving_and_gives_it_back():
    """It drives by the rules, most of the time, and leaves nothing behind."""
    moving = []
    plan = StormPlan(4, SMALL, (), 60.0, drivers=1)

    def watch(storm):
        storm.run.clock.every(1.0, lambda: moving.append(storm.robots[0].agent.is_moving))

    outcome = play(plan, watch)
    assert sum(moving[:60]) > 15
    assert (outcome.breaches, outcome.error) == ([], "")


@pytest.mark.system
def test_the_same_storm_is_the_same_in_two_processes(tmp_path):
    plan = replace(draw(8), calm_s=90.0)
    file = tmp_path / "plan.yaml"
    file.write_text(plan.text(), encoding="utf-8")
    code = (
        "import sys; from pathlib import Path; from dva_sim.storms.plan import load_plan; "
        "from dva_sim.storms.storm import play; print(play(load_plan(Path(sys.argv[1]))).digest)"
    )
    call = [sys.executable, "-c", code, str(file)]
    first, second = (subprocess.run(call, capture_output=True, check=True) for _ in range(2))
    assert first.stdout == second.stdout
    assert len(first.stdout.strip()) == 24


@pytest.mark.system
@pytest.mark.parametrize("kind", FAULTS)
def test_each_fault_alone_is_survived(kind):
    """It strikes while the robot is driven, at its lowest strength."""
    what = FAULTS[kind]
    strikes = what.strikes[0] and what.strikes[0] + "-1" * (what.strikes[0] != "dva")
    fault = Fault(kind, 20.0, what.lasts[0], strikes, value=what.value[0])
    plan = StormPlan(1, {**SMALL, "guard": {"count": 1}}, (fault,), 40.0, drivers=1)
    outcome = play(plan)
    assert outcome.faults[kind] == 1
    assert (outcome.breaches, outcome.error) == ([], "")


@pytest.mark.soak
@pytest.mark.invariant("S1", "S2", "S3", "S4", "S5", "S6", "S7", "S8", "S10", "S11")
@pytest.mark.parametrize("seed", range(1, 9))
def test_no_rule_breaks_in_a_storm(seed):
    outcome = play(draw(seed))
    assert (outcome.breaches, outcome.error) == ([], "")


@pytest.mark.system
@pytest.mark.parametrize("file", FOUND, ids=lambda file: file.stem)
def test_what_a_storm_once_broke_holds_now(file):
    outcome = play(load_plan(file))
    assert (outcome.breaches, outcome.error) == ([], "")
