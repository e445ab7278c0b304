"""Runs of a study kept as recordings, equal however they are made."""

import errno
import math
import os
import resource
from dataclasses import replace
from pathlib import Path

import pytest
from helpers.studies.small_study import run_study
from helpers.wording import unnamed

from dva_sim.experiments.execution.kept_recordings import (
    chosen,
    name_of,
    record_study,
)
from dva_sim.experiments.study import cell_grid
from dva_sim.experiments.study.loading import load_study
from dva_sim.experiments.study.plan import StudyPlan, checked_plan
from dva_sim.kernel.errors import ConfigError
from dva_sim.recordings.reading import read_recording

STUDY = """\
question: Which is quicker?
seed: 3
persons: 2
replications: 2
record: {record}
factors:
  pattern: [req-rep, latest-wins]
parts:
  drive:
    scenario: one.yaml
    reference: {{operator.strategy: oracle}}
answer:
  part: drive
  measure: {measure}
  factor: pattern
  contrast: [req-rep, latest-wins]
"""
SCENARIO = "description: one robot\nsite: {name: caparica}\nhorizon_s: 3\n"


def study_in(folder, record, measure="drive_time_s", scenario=SCENARIO):
    (folder / "one.yaml").write_text(scenario)
    (folder / "study.yaml").write_text(STUDY.format(record=record, measure=measure))
    return load_study(folder / "study.yaml")


def recordings(folder) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted((folder / "recordings").iterdir())}


# --- which -----------------------------------------------------------------------------------


def names(study, values):
    """Names of the files, where the runs came to some values, in the order of the design."""
    rows = {
        job.address: {study.answer.measure: value}
        for job, value in zip(cell_grid.jobs(study), values, strict=True)
    }
    return [name_of(job) for job in chosen(StudyPlan.of(study), rows)]


NAN = math.nan
TIMES = [1, 2, 3, 4, 9, 7, 8, 9, 5, NAN, 7, NAN]  # the reference, req-rep, latest-wins


def test_a_sample_is_the_first_trial_of_the_first_person_of_each_cell(tmp_path):
    kept = names(study_in(tmp_path, "sample"), TIMES)
    assert kept == ["drive-reference-0-0.mcap", "drive-0-0-0.mcap", "drive-1-0-0.mcap"]


def test_the_worst_has_the_largest_measure_of_its_cell_or_none_at_all(tmp_path):
    """The first of equals counts; a missing measure is the worst."""
    kept = names(study_in(tmp_path, "worst"), TIMES)
    assert kept == ["drive-reference-1-1.mcap", "drive-0-0-0.mcap", "drive-1-0-1.mcap"]


def test_where_more_is_better_the_smallest_is_the_worst(tmp_path):
    kept = names(study_in(tmp_path, "worst", measure="commands_applied"), [*TIMES[:8], 5, 6, 4, 7])
    assert kept == ["drive-reference-0-0.mcap", "drive-0-0-1.mcap", "drive-1-1-0.mcap"]


def test_all_are_all_that_were_run(tmp_path):
    study = study_in(tmp_path, "all")
    assert len(names(study, TIMES)) == 12
    run = {job.address: {} for job in cell_grid.jobs(study)[:5]}
    assert [name_of(job) for job in chosen(StudyPlan.of(study), run)][-1] == "drive-0-0-0.mcap"


# --- making them -----------------------------------------------------------------------------


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    """A study with its recordings, made in this process."""
    folder = tmp_path_factory.mktemp("study")
    study = study_in(folder, "worst")
    out = run_study(study.model_copy(update={"record": None}), folder / "out", jobs=1)
    counts = []
    assert record_study(study, out, jobs=1, progress=lambda *n: counts.append(n)) == []
    assert counts == [(0, 3), (1, 3), (2, 3), (3, 3)]
    return study, out


@pytest.mark.system
def test_a_recording_is_of_the_run_it_is_named_after(kept):
    _, out = kept
    files = recordings(out)
    assert len(files) == 3
    for name in files:
        opened = read_recording(out / "recordings" / name)
        about = opened.about
        cell = "reference" if about["cell"] == "-1" else about["cell"]
        assert name == f"{about['part']}-{cell}-{about['person']}-{about['trial']}.mcap"
        assert opened.tables["runs"][0]["simulated_s"] == 3.0


def test_two_processes_and_an_interruption_make_the_same_bytes(kept, tmp_path):
    """One is missing, one was half written by a process that is gone, one nobody asked for."""
    study, out = kept
    before = recordings(out)
    first, second, third = before
    folder = out / "recordings"
    (folder / first).unlink()
    (folder / second).rename(folder / f".{second}.99999999")
    (folder / "drive-0-9-9.mcap").write_bytes(before[third])
    assert record_study(study, out, jobs=2) == []
    assert recordings(out) == before


def test_what_is_there_is_not_made_again(kept):
    study, out = kept
    counts = []
    record_study(study, out, jobs=1, progress=lambda *n: counts.append(n))
    assert counts == [(3, 3)]


def test_another_choice_needs_no_other_runs(kept, tmp_path):
    study, out = kept
    sample = study.model_copy(update={"record": "sample"})
    assert sample.asked() == study.asked()
    before = recordings(out)
    assert record_study(sample, out, jobs=1) == []
    assert set(recordings(out)) == {f"drive-{cell}-0-0.mcap" for cell in ("reference", 0, 1)}
    assert record_study(study, out, jobs=1) == []
    assert recordings(out) == before


@pytest.fixture
def emptied(kept):
    """Study without its recordings; in the end all of them are made again."""
    study, out = kept
    before = recordings(out)
    for name in before:
        (out / "recordings" / name).unlink()
    yield study, out, before
    assert record_study(study, out, jobs=1) == []
    assert recordings(out) == before


def test_a_run_that_is_not_what_the_study_has_is_not_kept(kept, monkeypatch):
    """A changed program is simulated: the table says 3 s, the run would last 2 s."""
    study, out = kept
    every = cell_grid.jobs(study)
    shorter = [
        replace(job, scenario=job.scenario.model_copy(update={"horizon_s": 2.0})) for job in every
    ]
    before = recordings(out)
    path = out / "recordings" / next(iter(before))
    path.unlink()
    monkeypatch.setattr(cell_grid, "jobs", lambda *_: shorter)
    (problem,) = record_study(study, out, jobs=1)
    assert problem.startswith(f"DvaSimError: {path.name}: ")
    assert not path.exists()
    monkeypatch.undo()
    assert record_study(study, out, jobs=1) == []
    assert recordings(out) == before


def test_a_study_without_the_key_records_nothing(tmp_path):
    study = study_in(tmp_path, "null")
    assert record_study(study, tmp_path / "nowhere") == []
    assert not Path(tmp_path / "nowhere").exists()


def test_what_cannot_be_recorded_is_told_with_its_place(tmp_path):
    (tmp_path / "timed.yaml").write_text(
        STUDY.format(record="all", measure="response_mean_s")
        .replace("one.yaml", "patrol-shift")
        .replace("    reference: {operator.strategy: oracle}\n", "")
        .replace("pattern: [req-rep, latest-wins]", "dispatch.policy: [nearest_idle, hazard_team]")
        .replace("factor: pattern", "factor: dispatch.policy")
        .replace("[req-rep, latest-wins]", "[nearest_idle, hazard_team]")
    )
    timed = load_study(tmp_path / "timed.yaml")
    with pytest.raises(ConfigError, match=r"timed\.yaml:5:1: record: all"):
        checked_plan(timed)


def test_a_full_disk_costs_recordings_and_not_the_study(emptied):
    """Once there is room again, the same call makes what is missing, to the same bytes."""
    study, out, before = emptied
    limit = resource.getrlimit(resource.RLIMIT_FSIZE)
    smallest = min(len(data) for data in before.values())
    resource.setrlimit(resource.RLIMIT_FSIZE, (smallest - 1, limit[1]))
    try:
        problems = record_study(study, out, jobs=1)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limit)
    assert [problem.partition(": ")[0] for problem in problems] == ["DvaSimError"] * 3
    assert all("File too large" in problem for problem in problems)
    assert recordings(out) == {}


def test_a_disk_with_no_room_left_is_told_once_and_no_further_run_is_made(emptied, monkeypatch):
    study, out, _ = emptied

    def full(handle):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    (problem,) = record_study(study, out, jobs=1)
    first = out / "recordings" / "drive-reference-0-0.mcap"
    assert unnamed(problem, "DvaSimError", first, "No space left", "0 of 3") == []
    assert list((out / "recordings").iterdir()) == []
    monkeypatch.undo()


def test_ctrl_c_says_how_far_it_is_and_the_next_call_goes_on(emptied):
    study, out, _ = emptied

    def stop(done, total):
        if done == 1:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt, match="1 of 3 recordings"):
        record_study(study, out, jobs=1, progress=stop)
    assert len(recordings(out)) == 1
