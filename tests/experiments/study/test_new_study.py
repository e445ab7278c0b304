"""The study to begin with is one that works."""

import pytest
from helpers.studies.small_study import run_study

from dva_sim.cli.studies import next_steps
from dva_sim.experiments.analysis.predictions import judge_all
from dva_sim.experiments.report.summary import Reading
from dva_sim.experiments.results.results import Results
from dva_sim.experiments.study import cell_grid
from dva_sim.experiments.study.loading import load_study, write_study
from dva_sim.experiments.study.registration import register
from dva_sim.testing.files import check_file


@pytest.fixture
def fresh(tmp_path, monkeypatch):
    """The file of a new study."""
    monkeypatch.chdir(tmp_path)
    write_study("mine")
    return tmp_path / "mine.yaml"


def test_a_new_study_is_valid_as_it_stands_in_both_versions(fresh):
    assert check_file(fresh).problems == []
    assert load_study(fresh, version="full").persons == 24


def test_it_is_small_enough_to_try_at_once(fresh):
    assert len(cell_grid.jobs(load_study(fresh))) == 8 * 4 * 4  # 20 s of CPU time with the report


def test_it_can_be_registered_as_it_stands(fresh):
    register(load_study(fresh))
    assert load_study(fresh).status.kind == "confirmatory"


def test_every_key_it_shows_in_a_comment_is_valid_too(fresh):
    text = fresh.read_text()
    shown = [line.removeprefix("# ") for line in text.splitlines() if line.startswith("# design:")]
    shown += [line.removeprefix("# ") for line in text.splitlines() if line.startswith("# stop:")]
    assert len(shown) == 4
    (fresh.parent / "rows.csv").write_text("link.loss\n0\n0.01\n")
    for line in shown:
        fresh.write_text(f"{text.partition('full:')[0]}\n{line}\n")
        assert cell_grid.cells(load_study(fresh))


def test_what_can_be_done_next_is_told_in_the_order_of_doing_it(tmp_path):
    path = tmp_path / "my study.yaml"
    commands = [line.split("#")[0].strip() for line in next_steps(path).splitlines()[1:]]
    quoted = f"'{path}'"
    assert commands == [
        f"dva-sim check {quoted}",
        f"dva-sim run {quoted} --dry-run",
        f"dva-sim register {quoted}",
        f"dva-sim run {quoted}",
    ]


@pytest.mark.soak
def test_it_answers_its_question(fresh, tmp_path):
    """So it did with 12 other seeds, 201 to 212, that had no part in choosing its size."""
    folder = run_study(load_study(fresh), tmp_path / "results", jobs=1)
    reading = Reading(Results.load(folder))
    finding = reading.finding
    assert finding.low[1] > 0
    assert abs(finding.mean[0]) < 0.1
    assert [tested.verdict for tested in reading.judgement.tested] == ["held"]
    assert [entry.verdict for entry in judge_all(reading.study, reading.view)] == ["held", "held"]
    assert reading.plans == []  # nothing is open, so no more persons are needed
