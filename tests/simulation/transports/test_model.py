"""The model `transports` as a study and the command line see it."""

import io
import math

import pytest
from rich.console import Console

from dva_sim.cli.stories import tell
from dva_sim.experiments.report.episode import Played
from dva_sim.experiments.study.loading import load_study
from dva_sim.kernel import resources
from dva_sim.kernel.yaml_files import Document, load_yaml
from dva_sim.simulation.measures.sessions import tables
from dva_sim.simulation.models import model_of
from dva_sim.simulation.transports import build, simulate_session

SHORT = {
    "warm_up_s": 5,
    "measure_s": 10,
    "drive.task.points_m": [[0, 0], [6, 0], [9, 3]],
    "drive.practice": 0,
    "drive.horizon_s": 100,
}


def played(scenario, seed):
    return tables(simulate_session(scenario, seed))


def shipped() -> Document:
    return load_yaml(resources.find("congested-link", "experiments/scenarios"))


def test_a_run_has_every_measure_that_a_study_may_ask_for():
    model = model_of(shipped())
    tables = model.tables(model.build(shipped(), SHORT), 3, with_tracks=False)
    assert set(tables["runs"][0]) == set(model.measures())
    assert all(math.isfinite(value) for value in tables["runs"][0].values())


@pytest.mark.system
def test_the_same_seed_and_person_give_the_same_run_and_others_do_not():
    scenario = build(shipped(), SHORT)
    other = model_of(shipped()).played_by(scenario, 5)
    assert played(scenario, 3) == played(scenario, 3)
    assert played(other, 3)["flows"] == played(scenario, 3)["flows"]
    assert played(other, 3)["runs"] != played(scenario, 3)["runs"]


def test_who_sees_a_picture_per_second_drives_slower():
    fresh = build(shipped(), SHORT | {"bulk.up": 0, "bulk.down": 0})
    rare = build(shipped(), SHORT | {"bottleneck.rate_bps": 4e4, "transport": {"kind": "tcp"}})
    times = [played(s, 3)["runs"][0]["movement_time_s"] for s in (fresh, rare)]
    assert times[1] > 1.5 * times[0]


def test_the_command_line_tells_flows_ages_and_the_drive():
    text = io.StringIO()
    scenario = build(shipped(), SHORT)
    run = Played(scenario, 3, simulate_session(scenario, 3), 0.1)
    tell(run, Console(file=text, width=100))
    for word in ("bulk 1", "delivered", "round trip", "drive: done in"):
        assert word in text.getvalue()


def test_the_shipped_study_sets_every_number_that_no_paper_gave():
    study = load_study("transports")
    model = model_of(shipped())
    for name, changes in study.treatments["transport"].items():
        scenario = model.build(shipped(), changes)
        assert scenario.transport.kind in (name, "datagrams")
