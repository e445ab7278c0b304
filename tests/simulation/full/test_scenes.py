"""Covariates known beforehand: equal for all treatments, and zero on average."""

import math
from typing import Any

import numpy as np
import pytest

from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.full import scenes, simulate
from dva_sim.simulation.full.run import Run
from dva_sim.simulation.full.scenes import trait_off, way_off
from dva_sim.simulation.models import MODELS
from dva_sim.simulation.run_measures import COVARIATES, load_measure, values_of
from dva_sim.simulation.scenario import Scenario
from dva_sim.statistics import off_zero


def drive(**changes: Any) -> Scenario:
    return scenarios.build(scenarios.load("drive-to-event"), changes)


@pytest.mark.parametrize("trait", ["caution", "patience_s", "motor_noise"])
def test_persons_are_off_the_median_by_zero_on_the_average_and_by_one_deviation(trait):
    usual, model = drive(), MODELS["full"]
    off = [trait_off(model.played_by(usual, number), trait) for number in range(250)]
    assert off_zero(off) < 4
    assert np.std(off) == pytest.approx(1.0, abs=0.15)


def test_who_is_drawn_around_another_median_is_as_far_off_it():
    usual, other = drive(), drive(**{"operator.traits": {"caution": 0.2}})
    assert trait_off(other, "caution") == pytest.approx(trait_off(usual, "caution"))


def test_ways_of_other_seeds_are_as_long_as_usual_on_the_average(monkeypatch):
    monkeypatch.setattr(scenes, "SCENES", 1000)
    usual = drive()
    off = [way_off(usual, seed) for seed in range(60)]
    assert off_zero(off) < 4
    assert np.std(off) > 5


def test_the_way_is_that_from_the_first_base_to_the_event_of_the_run():
    known, ways = [], []
    for seed in range(8):
        run = Run(drive(), seed)
        base = run.stage.site.robot_bases[0]
        goal = run.field.incidents[0].hazard.position
        known.append(way_off(drive(), seed))
        ways.append(run.stage.planner.distance((base.x, base.y), goal))
        assert run.stage.planner.cost((base.x, base.y), goal) >= ways[-1]
    assert np.corrcoef(known, ways)[0, 1] > 0.95


def test_a_treatment_changes_neither():
    fast, slow = (
        simulate(drive(pattern=pattern, horizon_s=2.0), 3) for pattern in ("latest-wins", "req-rep")
    )
    measures = [load_measure(name) for name in COVARIATES]
    assert values_of(measures, fast, "full") == values_of(measures, slow, "full")
    assert all(map(math.isfinite, values_of(measures, fast, "full").values()))


@pytest.mark.parametrize(
    "changes", [{"robot.way_m": 12.0}, {"site.map": "hall.yaml"}, {"robot.count": 0}]
)
def test_a_way_that_is_not_drawn_in_this_manner_has_no_average(changes):
    scenario = drive()
    for key, value in changes.items():
        block, name = key.split(".")
        part = getattr(scenario, block).model_copy(update={name: value})
        scenario = scenario.model_copy(update={block: part})
    assert way_off(scenario, 1) is None
