"""A study can bring its own measures and models, in files that are read by every process."""

import json

import pytest
from helpers.studies.report_text import words_of
from helpers.studies.small_study import STUDY, run_study, study_in
from helpers.wording import unnamed

from dva_sim.experiments.results.results import Results
from dva_sim.experiments.study.registration import plan_of

MEASURE = """\
from dva_sim.kernel.measure import Measure
from dva_sim.simulation.run_measures import RunMeasure


class Mine(RunMeasure):
    about = Measure("standing_s", "time that robots stood", title="time standing")

    def of(self, recording):
        tracks = recording.recorder.tracks
        points = [p for name in tracks if name.startswith("robot") for p in tracks[name]]
        pairs = zip(points, points[1:])
        return sum(b.time - a.time for a, b in pairs if (a.x, a.y) == (b.x, b.y))
"""
SMALL = (
    STUDY.replace("persons: 3", "persons: 2")
    .replace("replications: 2", "replications: 1")
    .replace("    reference: {operator.strategy: oracle}\n", "")
    .replace("link.delay_s: [0, 0.25]", "link.delay_s: [0]")
    .replace("measure: drive_time_s", "measure: standing_s")
    .replace("  over: link.delay_s\n", "")
    .replace("  story:\n    scenario: one.yaml\n    replications: 1\n", "")
    .replace("scenario: one.yaml", "scenario: one.yaml\n    changes: {horizon_s: 20}")
)


def study_with(tmp_path, measures="[mine.py:Mine]", code=MEASURE, text=SMALL):
    (tmp_path / "mine.py").write_text(code)
    return study_in(tmp_path, text=f"{text}measures: {measures}\n")


@pytest.mark.system
def test_a_study_measures_what_a_file_beside_it_says_in_every_process(tmp_path):
    study = study_with(tmp_path)
    run_study(study, tmp_path / "two", jobs=2)
    found = Results.load(tmp_path / "two")
    assert (found.runs["standing_s"] > 0).all()
    values = {column.name: column for column in found.columns("runs")}
    assert (values["standing_s"].unit, values["standing_s"].meaning) == (
        "s",
        "time that robots stood",
    )


@pytest.mark.system
def test_results_are_read_without_the_file_and_say_what_it_said(tmp_path):
    study = study_with(tmp_path)
    run_study(study, tmp_path / "out", jobs=1)
    manifest = json.loads((tmp_path / "out" / "manifest.json").read_text())
    assert manifest["columns"]["runs"]["standing_s"]["title"] == "time standing"
    assert "mine.py:Mine" in manifest["inputs"]  # wherever it lies
    (tmp_path / "mine.py").write_text("raise SystemExit('read from a results folder')\n")
    assert "time standing" in words_of(tmp_path / "out")


def test_a_study_without_own_measures_is_the_same_study_as_ever(tmp_path):
    assert "measures" not in study_in(tmp_path).asked()


def test_a_run_whose_measure_fails_is_a_failure_that_is_told(tmp_path):
    study = study_with(tmp_path, code=MEASURE.replace("return sum", "return 1 / 0 + sum"))
    run_study(study, tmp_path / "out", jobs=1)
    (error, *_) = [row["error"] for row in Results.load(tmp_path / "out").failures]
    assert unnamed(error, "'standing_s'", "ZeroDivisionError") == []


def test_a_registration_fixes_what_an_own_measure_does(tmp_path):
    study = study_with(tmp_path)
    before = plan_of(study)["inputs"]
    file = tmp_path / "mine.py"
    file.write_text(f"{file.read_text()}\n# otherwise\n")
    assert plan_of(study)["inputs"] != before
