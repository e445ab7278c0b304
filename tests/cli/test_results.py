"""Results on the terminal: the commands show, compare and export, and their exit codes."""

import io
import json
import re
import shutil

import pytest
from helpers.processes.command_line import ended as command
from helpers.studies import synthetic_results as synthetic
from helpers.studies.small_study import cheap, run_study, study_in, unlucky
from helpers.wording import unnamed
from rich.console import Console

from dva_sim.experiments.report import terminal
from dva_sim.experiments.report.summary import Reading
from dva_sim.experiments.results.results import Results


def later(job):
    """Every drive takes 5 s more."""
    tables = cheap(job)
    tables["runs"][0]["drive_time_s"] += 5.0
    return tables


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """Results as they were, later ones, and some with a failure."""
    folder = tmp_path_factory.mktemp("study")
    study = study_in(folder)
    return {
        e.__name__: run_study(study, folder / e.__name__, jobs=1, episode=e)
        for e in (cheap, later, unlucky)
    }


def shown(width, print_it):
    """Output on a terminal of some width."""
    file = io.StringIO()
    print_it(Console(file=file, width=width, force_terminal=True, color_system=None))
    return file.getvalue()


# --- show --------------------------------------------------------------------------------------


def test_show_tells_question_status_size_answer_and_every_cell(tmp_path):
    facts = synthetic.manifest(
        6,
        2,
        status={"kind": "exploratory", "why": ["--set persons=6"]},
        hash="0123456789abcdef",
        versions={"dva-sim": "0.0", "commit": "0a1b2c3d4e5f6a7b", "dirty": True},
        failures=[],
    )
    rows = synthetic.drive_rows(6, 2) + [
        row | {"part": "story"} for row in synthetic.drive_rows(6, 2)
    ]
    folder = synthetic.write(tmp_path / "out", {"runs": rows}, facts)
    code, out, _ = command("show", folder)
    assert code == 0
    assert out.startswith(f"{facts['question']}\n")
    size = ("888 runs in 0", " 0 failed", "6 persons x 2 trials", "seed 1\n")
    made = ("dva-sim 0.0", "commit 0a1b2c3d4e5f ", "not committed", "study 0123456789abcdef\n")
    assert unnamed(out, "Status: exploratory: --set persons=6\n", *size, *made) == []
    assert Reading(Results.load(folder)).answer.lead in out
    cells = [line for line in out.splitlines() if line.startswith("latest-wins PUB/SUB  100\xa0ms")]
    assert len(cells) == 4  # two profiles in two parts
    assert "Tables: runs (" in out


@pytest.mark.system
def test_show_counts_failures_and_warns_of_them(folders):
    _, out, _ = command("show", folders["unlucky"])
    size = ("41 runs in 9", " 1 failed", "3 persons x 2 trials", "seed 3\n", "missing below: 1")
    assert unnamed(out, *size) == []


def test_show_tells_what_ended_a_study_early(folders, tmp_path):
    facts = json.loads((folders["cheap"] / "manifest.json").read_text())
    facts["stopped"] = {"rounds": 2, "of": 6, "why": "enough"}
    (tmp_path / "manifest.json").write_text(json.dumps(facts))
    (tmp_path / "tables").symlink_to(folders["cheap"] / "tables")
    _, out, _ = command("show", tmp_path)
    assert unnamed(out, "2 of 6 rounds", "interval") == []


def test_show_prints_the_first_rows_of_a_table(folders):
    code, out, _ = command("show", folders["cheap"], "--table", "tracks", "--rows", "2")
    lines = out.splitlines()
    assert code == 0
    assert len(lines) == 4
    assert lines[0].split()[:3] == ["part", "cell", "config"]
    assert lines[0].split()[-2:] == ["t_s", "x_m"]
    assert lines[2].split()[-2:] == ["0.1", "0.5"]
    assert lines[3].startswith("... and ")


def test_show_explains_columns(folders):
    _, out, _ = command("show", folders["cheap"], "--columns", "--table", "tracks")
    assert out.splitlines()[0] == "tracks"
    assert re.search(r"\nt_s +s +\w", out)


def test_a_narrow_terminal_shows_fewer_columns_and_names_the_others(folders):
    results = Results.load(folders["cheap"])
    wide = shown(400, lambda console: terminal.show_table(results, "runs", 3, console))
    narrow = shown(60, lambda console: terminal.show_table(results, "runs", 3, console))
    assert "contacts" in wide.splitlines()[0]
    assert "also:" not in wide
    assert max(map(len, narrow.splitlines()[:4])) <= 60
    assert "contacts" in narrow.split("also: ")[1]


# --- compare -----------------------------------------------------------------------------------


def test_compare_tells_medians_and_differences_with_intervals(folders):
    code, out, _ = command("compare", folders["cheap"], folders["later"], "--by", "pattern")
    assert code == 0
    expected = ("8 cells are in both", "Compared in pairs", "all runs of A", "drive_time_s [s]")
    assert unnamed(out, *expected) == []
    row = next(line for line in out.splitlines() if line.startswith("drive  REQ/REP"))
    assert row.split()[-4:] == ["(5.0", "to", "5.0)", "*"]
    assert unnamed(out, "1 of 5", "changed: drive_time_s") == []


def test_the_same_results_are_told_to_be_identical(folders):
    _, out, _ = command("compare", folders["cheap"], folders["cheap"])
    assert out.count("identical") == 8
    assert "All 5 measures" in out


def test_another_question_other_settings_and_other_configurations_are_told(folders, tmp_path):
    other = shutil.copytree(folders["cheap"], tmp_path / "other")
    manifest = json.loads((other / "manifest.json").read_text())
    manifest["study"]["question"] = "Which is safer?"
    manifest["set"] = ["link.loss=0.1"]
    for cell in manifest["cells"][:3]:
        cell["config"] = "0"
    (other / "manifest.json").write_text(json.dumps(manifest))
    _, out, _ = command("compare", folders["cheap"], other)
    questions = ("\n  A: Which is quicker?\n", "\n  B: Which is safer?\n")
    assert unnamed(out, *questions, "8 cells", "2 of them", ", --set link.loss=0.1\n") == []


@pytest.mark.parametrize(
    ("conditions", "code", "expected"),
    [
        (["mean(drive_time_s) > +4 s"], 4, "failed: mean(drive_time_s) > +4 s"),
        (["mean(drive_time_s) > +6 s"], 0, "passed: mean(drive_time_s) > +6 s"),
        (["max(contacts) > 9", "mean(drive_time_s) > +4 s"], 4, "passed: max(contacts) > 9"),
    ],
)
def test_a_gate_ends_with_4_if_a_condition_holds(folders, conditions, code, expected):
    words = [word for condition in conditions for word in ("--fail-if", condition)]
    ended, out, _ = command("compare", folders["cheap"], folders["later"], *words)
    assert ended == code
    assert expected in out


def test_runs_that_failed_are_told(folders):
    _, out, _ = command("compare", folders["cheap"], folders["unlucky"])
    assert "1 runs of B" in out


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["show", "."], "holds no finished results"),
        (["show", "{cheap}", "--table", "flights"], "no table 'flights'; tables: runs, tracks"),
        (["compare", "{cheap}", "nowhere"], "nowhere is not a folder"),
        (["compare", "{cheap}", "{later}", "--fail-if", "p95(drive_time_s"], "expected ')'"),
        (["compare", "{cheap}", "{later}", "--measure", "speed"], "measure 'speed' is not in both"),
    ],
)
def test_a_mistake_ends_with_2_and_one_line(folders, words, expected):
    code, _, err = command(*(word.format(**folders) for word in words))
    assert code == 2
    assert expected in err
    assert len(err.strip().splitlines()) == 1


# --- export ------------------------------------------------------------------------------------


def test_export_names_what_it_wrote(folders, tmp_path):
    code, out, _ = command("export", folders["cheap"], "-o", tmp_path / "all", "--table", "runs")
    assert code == 0
    assert [line.rpartition("/")[2] for line in out.splitlines()] == ["runs.csv", "columns.csv"]
    assert command("export", folders["cheap"], "-o", tmp_path / "all")[0] == 2
    assert command("export", folders["cheap"], "-o", tmp_path / "all", "--overwrite")[0] == 0
