"""Measures that a scenario can have, and measures that its runs lack."""

from functools import partial

import pytest
from helpers.paths import ROOT
from helpers.studies.report_text import words_of
from helpers.studies.small_study import SHIFT, STUDY, cheap, run_study, study_in

from dva_sim.experiments.report.summary import Reading
from dva_sim.experiments.results.results import Results
from dva_sim.experiments.study import cell_grid
from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.models import MODELS, model_of

TASKS = ROOT / "experiments" / "scenarios" / "tasks"
DESIGN_ONLY = {"outcome", "cause", "network_depth"}


@pytest.mark.system
@pytest.mark.parametrize(
    "kind", ["fitts-tilt", "tracking", "corner", "slalom", "course", "excavator"]
)
def test_a_task_has_the_measures_that_its_runs_hold(kind):
    document = scenarios.load(f"tasks/{kind}")
    model = model_of(document)
    scenario = model.build(document, {"trials": 1})
    (row,) = model.tables(scenario, 1, with_tracks=False)["runs"]
    assert set(model.measures(scenario)) == row.keys()


@pytest.mark.parametrize("containment", [True, False])
def test_a_shift_has_the_measures_that_its_runs_hold(containment):
    data = SHIFT | {"dispatch": {"escalate_after_s": 120, "containment": containment}}
    scenario = MODELS["timed"].build(data, {})
    (row,) = MODELS["timed"].tables(scenario, 1, with_tracks=False)["runs"]
    assert set(MODELS["timed"].measures(scenario)) == row.keys()


@pytest.mark.parametrize(
    "changes",
    [
        {"guard.count": 1, "robot.count": 0},
        {"guard.count": 1, "bystander.count": 1, "robot.count": 0, "operator.count": 0},
        {"guard.count": 0, "robot.count": 1},
    ],
)
def test_a_run_holds_no_measure_that_its_scenario_cannot_have(changes):
    scenario = MODELS["full"].build({"horizon_s": 40.0}, changes)
    (row,) = MODELS["full"].tables(scenario, 1, with_tracks=False)["runs"]
    assert row.keys() - DESIGN_ONLY <= set(MODELS["full"].measures(scenario))


def test_a_measure_is_there_if_one_level_of_a_factor_has_it(tmp_path):
    text = STUDY.replace("measure: drive_time_s", "measure: evacuated_s").replace(
        "  link.delay_s: [0, 0.25]", "  bystander.count: [0, 2]"
    )
    text = text.replace("over: link.delay_s", "over: bystander.count")
    assert cell_grid.cells(study_in(tmp_path, text=text))


def without(column, job):
    tables = cheap(job)
    return {"runs": [{k: v for k, v in row.items() if k != column} for row in tables["runs"]]}


@pytest.mark.parametrize("column", ["path_m", "confirmed"])
def test_a_measure_that_no_run_came_to_hold_leaves_the_question_open(tmp_path, column):
    text = STUDY.replace("measure: drive_time_s", f"measure: {column}")
    study = study_in(tmp_path, text=text)
    run_study(study, tmp_path / "out", jobs=1, episode=partial(without, column))
    results = Results.load(tmp_path / "out")
    assert Reading(results).answer.lead.startswith("No pair of runs")
    assert "No pair of runs" in words_of(tmp_path / "out")
