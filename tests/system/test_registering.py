"""From a new study to a confirmed hypothesis, as users call it."""

import json
from pathlib import Path

import pytest
from helpers.processes.command_line import call
from helpers.studies.report_text import blank_pictures
from helpers.wording import unnamed

pytestmark = pytest.mark.system

STUDY = """\
question: Does the nearest come sooner?
persons: 3
replications: 1
factors:
  dispatch.policy: [random, min_eta]
parts:
  shift: {scenario: small-shift, changes: {horizon_s: 900}}
answer:
  part: shift
  measure: response_mean_s
  factor: dispatch.policy
  contrast: [random, min_eta]
hypotheses:
  sooner: {direction: above}
"""


def status_of(folder: Path) -> dict[str, object]:
    found: dict[str, object] = json.loads((folder / "manifest.json").read_text())["status"]
    return found


def test_a_study_is_registered_run_and_told_apart_from_what_was_only_tried(tmp_path):
    study = tmp_path / "mine.yaml"
    study.write_text(STUDY)
    done = call("register", "mine.yaml", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert unnamed(done.stdout, "sooner", "3 persons x 1", "mine.registration.yaml") == []
    again = call("register", "mine.yaml", cwd=tmp_path)
    assert (again.returncode, len(again.stderr.splitlines())) == (2, 1)

    with blank_pictures():
        assert call("run", "mine.yaml", "--jobs", "1", cwd=tmp_path).returncode == 0
    assert status_of(tmp_path / "results" / "mine")["kind"] == "confirmatory"

    with blank_pictures():
        ran = call("run", "mine.yaml", "--pilot", "2", "--jobs", "1", cwd=tmp_path)
    assert ran.returncode == 0
    pilot = status_of(tmp_path / "results" / "mine-pilot")
    assert pilot["kind"] == "exploratory"
    assert unnamed(pilot["why"], "pilot", "2 persons") == []

    study.write_text(STUDY.replace("direction: above", "direction: below"))
    refused = call("run", "mine.yaml", "--jobs", "1", cwd=tmp_path)
    assert refused.returncode == 2
    assert "holds another study" in refused.stderr
    assert call("check", "mine.registration.yaml", cwd=tmp_path).returncode == 1
