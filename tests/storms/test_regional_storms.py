"""Storms of several DVAs: honest ones break no rule, and each planted bug is found."""

from dataclasses import replace

import pytest
from helpers.mutation.hunting import hunt
from helpers.mutation.regional_bugs import REGIONAL_BUGS

from dva_sim.storms.campaign import REGIONS, drawn
from dva_sim.storms.plan import Fault, load_plan
from dva_sim.storms.regional_storm import KILLED, LASTS, RETURNED, RegionalStorm, draw_regions
from dva_sim.storms.storm import play


def test_the_same_seed_gives_the_same_storm_of_several_dvas():
    plan = draw_regions(3)
    assert draw_regions(3) == plan
    assert drawn(3, REGIONS) == plan
    briefly = replace(plan, calm_s=25.0 - LASTS)
    one, other = play(briefly), play(briefly)
    assert one.digest == other.digest
    assert one.is_clean, one.breaches


def test_a_plan_of_several_dvas_is_read_from_its_file(tmp_path):
    plan = next(p for p in map(draw_regions, range(1, 20)) if p.faults[0].kind == KILLED)
    file = tmp_path / "plan.yaml"
    file.write_text(plan.text())
    assert load_plan(file) == plan


def test_no_event_goes_to_a_dva_that_was_started_again_and_forgot_its_region():
    assert play(draw_regions(70_001)).is_clean


@pytest.mark.soak
@pytest.mark.parametrize("seed", [110, 303, 372, 395, 485])
def test_storms_that_broke_a_rule_once_break_none(seed):
    assert play(draw_regions(seed)).is_clean


def test_a_supervisor_in_a_storm_gives_a_region_back_whose_dva_was_killed():
    plan = next(p for p in map(draw_regions, range(1, 20)) if "part-3" not in p.built().dva.regions)
    killed = Fault(KILLED, 20.0, target="dva-part-1", value=30.0)
    given_back = Fault(RETURNED, 80.0, target="dva-part-1")
    scenario = {**plan.scenario, "events": [{"kind": "fire", "at_s": 300}]}
    storm = RegionalStorm(replace(plan, scenario=scenario, faults=(killed, given_back)))
    assert storm.play().is_clean
    first, second = storm.run.dvas.values()
    assert first.core.counters["region taken back"] == 1
    assert dict(second.core.division.served()).keys() == {"part-2"}


# --- planted bugs ----------------------------------------------------------------------------


@pytest.mark.soak
@pytest.mark.parametrize("name", [bug.name for bug in REGIONAL_BUGS])
def test_a_planted_bug_is_found_within_thirty_storms(name):
    trial = hunt(name, 30)
    assert trial.noticed_by, str(trial)
