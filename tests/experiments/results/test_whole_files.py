"""Files that are whole or not at all, in folders of any name, and harmless in a spreadsheet."""

import csv
import errno
import os
from contextlib import suppress

import pytest
from helpers.processes.command_line import call
from helpers.studies import small_study as kit
from helpers.studies.small_study import run_study

from dva_sim.experiments.report import report
from dva_sim.experiments.results.results import Results
from dva_sim.kernel.csv_cells import harmless
from dva_sim.kernel.errors import DvaSimError
from dva_sim.kernel.whole_files import whole, write_whole


def test_a_file_is_replaced_only_by_a_whole_one(tmp_path):
    file = tmp_path / "a.svg"
    write_whole(file, "first")
    with suppress(KeyError), whole(file) as part:
        part.write_text("half")
        assert part.suffix == ".svg"
        raise KeyError
    assert [each.name for each in tmp_path.iterdir()] == ["a.svg"]
    assert file.read_text() == "first"


@pytest.fixture
def finished(tmp_path):
    """Results that a report can be made of."""

    def episode(job):
        return {"runs": kit.cheap(job)["runs"]}

    return run_study(kit.study_in(tmp_path), tmp_path / "results", jobs=1, episode=episode)


def test_a_full_disk_leaves_the_report_that_was_there(finished, monkeypatch):
    before = report.write_report(finished).read_bytes()

    def full(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(report, "write_whole", full)
    with pytest.raises(DvaSimError, match="No space"):
        report.write_report(finished)
    assert (finished / report.PAGE).read_bytes() == before


@pytest.mark.parametrize("name", ["what?", "all*", "some[1]", "it's", "ein Übel"])
def test_results_are_read_from_a_folder_of_any_name(tmp_path, name):
    run_study(kit.study_in(tmp_path), tmp_path / name, jobs=1, episode=kit.cheap)
    results = Results.load(tmp_path / name)
    assert results.runs.rows == kit.RUNS
    done = call("export", tmp_path / name, "-o", tmp_path / "out")
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("text", ["=1+2", "+1", "-1", "+cmd|' /C calc'!A0", "@SUM(A1)", "\t=1"])
def test_text_that_acts_in_a_spreadsheet_is_made_harmless(text):
    assert harmless(text) == f"'{text}"


@pytest.mark.parametrize("cell", ["req-rep", "a=b", "", -3, 0.5, None, True])
def test_other_cells_are_as_they_are(cell):
    assert harmless(cell) == cell


def test_characters_that_hide_or_turn_text_are_shown_in_a_cell():
    assert harmless("a\u202eb\x07\0c\nd") == "a\ufffdb\ufffd\ufffdc\nd"


def test_levels_that_look_like_formulas_are_exported_harmless(tmp_path):
    def noted(job):
        tables = kit.cheap(job)
        return tables | {"runs": [tables["runs"][0] | {"note": "=HYPERLINK(1)\u202e", "kind": -5}]}

    out = tmp_path / "out"
    run_study(kit.study_in(tmp_path), out, jobs=1, episode=noted)
    assert call("export", out, "--table", "runs", "-o", tmp_path / "runs.csv").returncode == 0
    with (tmp_path / "runs.csv").open(newline="") as file:
        row = next(csv.DictReader(file))
    assert (row["note"], row["kind"]) == ("'=HYPERLINK(1)\ufffd", "-5")
