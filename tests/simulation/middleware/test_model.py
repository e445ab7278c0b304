"""Real runs of the model: what is measured, what fails, and how a study of it is run."""

import math
import shutil

import pytest
from helpers.network.emulated_link import need_link
from helpers.wording import unnamed

from dva_sim.experiments.execution.session import _at_random, _workers
from dva_sim.experiments.study.loading import load_study
from dva_sim.experiments.study.plan import StudyPlan, checked_plan
from dva_sim.kernel.errors import ConfigError
from dva_sim.network.middleware import ends
from dva_sim.simulation.measures.middleware import tables
from dva_sim.simulation.middleware import build, lacks, measure
from dva_sim.simulation.models import MODELS

SHORT = {"model": "middleware", "set_up_s": 1.5, "measure_s": 1.0, "attempts": 1}


def run(**changed):
    scenario = build(SHORT | {"transport": {"name": "udp"}} | changed)
    found = tables(measure(scenario, 1))
    return found, found["runs"][0]


@pytest.mark.system
def test_commands_and_pictures_cross_a_real_link_and_are_as_old_as_it_makes_them():
    need_link()
    link = {"up": {"delay_s": 0.1}, "down": {"delay_s": 0.2}}
    found, row = run(link=link, pictures={"rate_hz": 10, "bytes": 2000}, set_up_s=5.0)
    assert row["connected"] == 1
    assert row["command_age_p50_s"] > 0.1
    assert row["picture_age_p50_s"] > 0.2
    assert row["age_in_force_p50_s"] > row["command_age_p50_s"]
    assert row["up_bytes"] > 400 * row["commands"]
    assert set(row) == {column.name for column in MODELS["middleware"].columns["runs"]}
    for stream in ("commands", "pictures"):
        late = [r["arrived_s"] - r["made_s"] for r in found[stream] if r["arrived_s"] > 0]
        assert min(late) > 0.1
        assert {*found[stream][0]} == {c.name for c in MODELS["middleware"].columns[stream]}


@pytest.mark.system
def test_where_no_packet_passes_nothing_is_connected_and_that_is_a_result():
    need_link()
    found, row = run(link={"outages": [{"from_s": 0, "for_s": 100}]})
    assert row["connected"] == row["commands"] == row["command_rate_hz"] == 0
    assert row["too_old_share"] == 1.0
    assert math.isnan(row["connected_after_s"])
    assert found["commands"] == []


def test_what_is_not_installed_is_said_before_the_first_run(monkeypatch):
    monkeypatch.setattr(shutil, "which", lambda _: None)
    monkeypatch.setattr(ends, "find_spec", lambda _: None)
    scenario = build(SHORT | {"transport": {"name": "mqtt"}})
    assert unnamed(lacks(scenario), "paho", "pip install -e '.[mqtt]'") == []
    with pytest.raises(ConfigError, match="paho"):
        measure(scenario, 1)
    with pytest.raises(ConfigError, match="paho") as refused:
        checked_plan(load_study("middleware"))
    assert unnamed(str(refused.value), "[mqtt]", "[zenoh]", "[webrtc]", "[dds]") == []


def test_a_study_in_real_time_runs_alone_in_an_order_by_chance_that_stays():
    plan = StudyPlan.of(load_study("middleware", version="quick"))
    assert plan.is_real_time
    first = [job for job in plan.jobs if job.person == 0]
    order = sorted(first, key=_at_random)
    assert order != first
    assert [job.key for job in order] == [job.key for job in sorted(order, key=_at_random)]
    for jobs, scheduler in ((2, None), (None, "tcp://127.0.0.1:1")):
        with pytest.raises(ConfigError, match="--jobs"), _workers(plan, jobs, scheduler):
            pass
