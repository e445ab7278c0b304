import re

import numpy as np
import pytest
from helpers.kills import subjects
from helpers.studies import synthetic_results
from helpers.studies.report_text import blank_pictures, words
from helpers.studies.small_study import run_study
from helpers.wording import unnamed

from dva_sim.experiments.analysis.shift_effects import pooled
from dva_sim.experiments.execution.scheduling import run_job
from dva_sim.experiments.report.report import write_report
from dva_sim.experiments.study.loading import load_study

pytestmark = pytest.mark.system


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study") / "results"
    with blank_pictures():
        return write_report(synthetic_results.write_shifts(folder, 3))


def test_the_answer_names_both_sides_of_the_trade(report):
    text = words(report)
    assert re.search(r"load 0\.\d+|load tried", text)
    assert unnamed(text, "people stand in danger", "Shifts: 3 simulated") == []
    assert "simulated person" not in text


def test_the_figures_of_dispatch_take_the_place_of_those_of_driving(report):
    page = report.read_text(encoding="utf-8")
    names = ["answer", "trade", "way"]
    assert re.findall(r'<figure id="(\w+)"', page) == names
    assert {path.stem for path in (report.parent / "figures").glob("*.csv")} == set(names)


def test_conditions_and_method_are_those_of_shifts(report):
    text = words(report)
    stated = ("2 guards and 1 robot", "30 per hour times intensity, 30 % false", "waiting 120 s")
    assert unnamed(text, *stated, "over independent shifts") == []
    assert "wheel slip" not in text


def test_every_cell_of_policy_and_rate_has_its_row(report):
    rows = re.findall(r"<tr.*?</tr>", report.read_text(encoding="utf-8"))
    assert len([row for row in rows if row.count("<td") > 10]) == 3 * 2


def test_a_policy_all_of_whose_runs_failed_leaves_a_report_of_the_others(tmp_path):
    def episode(job):
        if job.levels["dispatch.policy"] == "random":
            raise MemoryError
        return run_job(job)

    subjects.study(tmp_path)
    study = load_study(tmp_path / "study.yaml")
    out = run_study(study, tmp_path / "out", jobs=1, episode=episode)
    with blank_pictures():
        text = words(write_report(out))
    assert unnamed(text, "Quickest on the mean: nearest_idle", "no run") == []
    assert "Of the way" not in text


def test_a_percentile_that_too_few_events_reach_is_infinite():
    events = {
        "response_s": np.array([10.0, 20.0, 30.0, np.nan]),
        "person": np.array([0, 0, 1, 1]),
    }
    value, low, high = pooled(events, [0.5, 0.9], 600)
    assert value.tolist() == [20, np.inf]
    assert low[0] == 10
    assert high[0] == np.inf or high[0] == 30
