"""Results and recordings that version 0.7.0 wrote are still read; it made `data/results-0.7.0`."""

import json
import shutil
from pathlib import Path

import pytest
from helpers.paths import TESTS
from helpers.processes.command_line import call
from helpers.wording import unnamed

import dva_sim
from dva_sim.kernel.errors import ExitCode

DATA = TESTS / "data" / "results-0.7.0"
CONFIRMED_S = {"req-rep": [39.477242, 110.563333], "latest-wins": [35.876995, 88.163333]}


@pytest.fixture
def older(tmp_path):
    """A copy, since a report is written into it."""
    return Path(shutil.copytree(DATA, tmp_path / "older"))


@pytest.fixture
def unfinished(older):
    """Folder of an interrupted study: runs, but neither tables nor manifest."""
    (older / "manifest.json").unlink()
    shutil.rmtree(older / "tables")
    return older


def test_older_results_are_loaded(older):
    results = dva_sim.load(older)
    assert results.manifest["versions"]["dva-sim"] == "0.7.0"
    assert results.tables == ["events", "operators", "runs", "tracks"]
    for pattern, times in CONFIRMED_S.items():
        rows = results.runs.where(results.runs["pattern"] == pattern)
        assert rows["drive_time_s"] == pytest.approx(times)
    assert "too small to tell" in results.answer.lead


def test_a_key_that_this_version_no_longer_knows_keeps_no_results_from_being_read(older):
    file = older / "manifest.json"
    manifest = json.loads(file.read_text())
    manifest["study"]["retired"] = 8
    file.write_text(json.dumps(manifest))
    assert dva_sim.load(older).tables == ["events", "operators", "runs", "tracks"]


@pytest.mark.parametrize(
    ("command", "expected"),
    [
        ("show .", "dva-sim 0.7.0"),
        ("show .", "too small to tell"),
        ("show . --columns", "somebody is on scene"),
    ],
)
def test_older_results_are_shown(older, command, expected):
    done = call(*command.split(), cwd=older)
    assert (done.returncode, done.stderr) == (0, "")
    assert expected in done.stdout


def test_an_older_recording_is_told_and_its_rules_are_not_judged(older):
    done = call("replay", "recordings/drive-0-0-0.mcap", cwd=older)
    assert (done.returncode, unnamed(done.stderr, "S1", "S7")) == (ExitCode.NOT_JUDGED, [])
    assert "dva-sim 0.7.0" in done.stdout


@pytest.mark.system  # draws
def test_older_results_are_reported(older):
    assert call("report", older).returncode == 0
    assert "dva-sim 0.7.0" in (older / "report.html").read_text()


def test_older_results_are_compared_with_others(older, tmp_path):
    copy = shutil.copytree(DATA, tmp_path / "copy")
    done = call("compare", older, copy, "--fail-if", "mean(drive_time_s) > 1x")
    assert (done.returncode, done.stderr) == (0, "")
    assert dva_sim.compare(older, copy).paired == (4, 4)


def test_older_results_are_exported(older, tmp_path):
    (file,) = dva_sim.export(older, tmp_path / "runs.csv")
    assert len(file.read_text().splitlines()) == 1 + 4


def test_an_older_unfinished_study_is_shown_as_far_as_it_is(unfinished):
    done = call("show", unfinished)
    assert done.returncode == 0
    assert unnamed(done.stdout, "Partial:", "4 of 4") == []


@pytest.mark.parametrize("finished", [True, False])
def test_an_older_study_is_not_gone_on_with_by_another_program(older, finished):
    if not finished:
        (older / "manifest.json").unlink()
    done = call("run", older / "study.yaml", "-o", older)
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert unnamed(line, "libraries were changed", "-o") == []


def test_an_older_recording_is_played(older):
    played = dva_sim.replay(older / "recordings" / "drive-0-0-0.mcap")
    assert played.measures["drive_time_s"] == pytest.approx(CONFIRMED_S["req-rep"][0])
