"""`show` and `report` on studies that are running or were interrupted."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from helpers.studies import small_study as kit
from helpers.studies.report_text import words_of
from helpers.studies.small_study import run_study

from dva_sim.cli.results_json import shown
from dva_sim.experiments.execution.checkpoint import load_so_far
from dva_sim.experiments.results.manifest import status_of
from dva_sim.experiments.results.results import Results
from dva_sim.experiments.study.cell_grid import StudyJob
from dva_sim.kernel.errors import ConfigError

pytestmark = pytest.mark.system


def measured(job: StudyJob) -> kit.Tables:
    """A run that leaves its measures and no track."""
    return {"runs": kit.cheap(job)["runs"]}


@pytest.fixture
def stopped(tmp_path: Path) -> Callable[[int], Path]:
    """A results folder whose study was interrupted after some runs."""

    def stop(after: int) -> Path:
        def show(done: int, total: int) -> None:
            if done >= after:
                raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt):
            run_study(
                kit.study_in(tmp_path), tmp_path / "out", jobs=1, episode=measured, progress=show
            )
        return tmp_path / "out"

    return stop


def test_runs_are_made_person_by_person_so_that_all_cells_of_some_persons_are_known(stopped):
    out = stopped(after=kit.RUNS - 5)
    before = sorted(path.name for path in out.rglob("*"))
    results = load_so_far(out)
    assert sorted(path.name for path in out.rglob("*")) == before  # looking changes nothing
    reported = shown(results)
    assert reported["partial"] == {
        "done": kit.RUNS - 5,
        "of": kit.RUNS,
        "persons": reported["persons"],
    }
    runs = results.runs
    sizes = [np.sum((runs["part"] == "drive") & (runs["cell"] == c)) for c in set(runs["cell"])]
    assert len(set(sizes)) == 1
    persons = results.manifest["partial"]["persons"]
    assert set(runs["person"]) == set(range(persons))
    assert 0 < persons < 3


def test_what_is_shown_so_far_are_rows_of_the_results_to_come(stopped, tmp_path):
    out = stopped(after=kit.RUNS - 5)
    part = load_so_far(out).runs
    whole = Results.load(run_study(kit.study_in(tmp_path), out, jobs=1, episode=measured)).runs
    in_part = np.isin(whole["person"], np.unique(part["person"]))
    assert part["drive_time_s"].tolist() == whole["drive_time_s"][in_part].tolist()
    assert part["seed"].tolist() == whole["seed"][in_part].tolist()
    assert part["config"].tolist() == whole["config"][in_part].tolist()


def test_the_page_of_a_study_under_way_is_marked_partial_and_the_final_one_is_not(
    stopped, tmp_path
):
    out = stopped(after=kit.RUNS - 5)
    assert f"Partial: {kit.RUNS - 5} of {kit.RUNS} runs" in words_of(out)
    assert status_of(load_so_far(out).manifest).kind == "exploratory"
    run_study(kit.study_in(tmp_path), out, jobs=1, episode=measured)
    assert "Partial:" not in words_of(out)


def test_before_any_person_has_all_runs_that_is_said(stopped):
    out = stopped(after=2)
    with pytest.raises(ConfigError, match=f"2 of {kit.RUNS} runs .* no person"):
        load_so_far(out)


def test_a_failed_run_counts_as_ended_and_is_listed(tmp_path):
    def failing(job):
        if job.person == 2 and job.trial == 0:
            raise KeyboardInterrupt
        if job.person == 0 and job.cell == 1:
            raise ValueError("sank")
        return measured(job)

    out = tmp_path / "out"
    with pytest.raises(KeyboardInterrupt):
        run_study(kit.study_in(tmp_path), out, jobs=1, episode=failing)
    results = load_so_far(out)
    assert {f["error"] for f in results.failures} == {"ValueError: sank"}
    assert set(results.runs["person"]) == {0, 1}


def test_a_finished_folder_is_read_as_it_is(tmp_path):
    out = run_study(kit.study_in(tmp_path), tmp_path / "out", jobs=1, episode=measured)
    assert load_so_far(out).manifest == json.loads((out / "manifest.json").read_text())
    assert not load_so_far(out).partial
