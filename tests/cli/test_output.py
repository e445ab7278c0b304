"""Output of commands: lists that do not wrap, pure JSON, quieter and more verbose modes."""

import json
import re
import sys

import pytest
from generators import json_output
from helpers.processes.command_line import ended as say
from helpers.studies.report_text import blank_pictures
from helpers.studies.small_study import cheap, run_study, study_in, unlucky
from helpers.wording import unnamed

from dva_sim.cli import call, names
from dva_sim.experiments.execution import dry_run, session
from dva_sim.experiments.execution.dry_run import _Tried
from dva_sim.kernel.errors import ExitCode
from dva_sim.testing.promises import plural


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study")
    study = study_in(folder)
    episodes = {"right": runs_alone, "one failed": one_fails}
    return [run_study(study, folder / n, jobs=1, episode=e) for n, e in episodes.items()]


def runs_alone(job):
    return {"runs": cheap(job)["runs"]}


def one_fails(job):
    return {"runs": unlucky(job)["runs"]}


# --- list and plugins ------------------------------------------------------------------


def test_a_list_has_a_line_for_each_name_with_what_it_is():
    code, out, _ = say("list")
    lines = out.splitlines()
    assert code == 0
    for name in ("fire-drill", "min_eta", "latest-wins", "caparica", "servrobot", "pursuit"):
        assert any(re.match(f"  {name} +\\w", item) for item in lines)
    everything = names.everything()
    assert len(lines) == sum(len(found) + 2 for found in everything.values()) - 1
    assert all(entry.description for found in everything.values() for entry in found)


def test_a_list_of_one_kind():
    assert say("list", "sites")[1].splitlines()[0] == "sites"
    assert "fire-drill" not in say("list", "sites")[1]


def test_a_terminal_cuts_what_it_has_no_room_for_and_a_pipe_does_not(monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "40")
    names.tell(["x" * 100])
    assert capsys.readouterr().out == "x" * 100 + "\n"
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True, raising=False)
    names.tell(["x" * 100, "y" * 40])
    assert capsys.readouterr().out == "x" * 37 + "...\n" + "y" * 40 + "\n"


def test_what_is_listed_of_plugins_is_what_is_there():
    for several, (_, plugins) in names.kinds_of_plugins().items():
        assert several == plural(plugins.kind)
        listed = {entry.name: entry.description for entry in names.everything(several)[several]}
        assert list(listed) == plugins.known()
        assert all(listed.values())


def test_every_kind_that_is_listed_can_be_completed():
    assert names.kinds() == list(names.everything())


def test_plugins_are_told_by_kind_with_the_group_of_their_entry_points():
    out = say("plugins")[1]
    for several, (_, plugins) in names.kinds_of_plugins().items():
        assert f"\n{several}\n" in f"\n{out}"
        for entry in (plugins.group, plugins.key, plugins.public, plugins.folder):
            assert entry in out
    assert unnamed(out, "check policy mine.py:Mine", "agents/policies/patrol.py") == []


# --- JSON ------------------------------------------------------------------------------


def test_lists_and_plugins_as_json_have_stable_keys():
    _, out, err = say("list", "--json")
    found = json.loads(out)
    assert err == ""
    assert list(found) == names.kinds()
    entries = [entry for entries in found.values() for entry in entries]
    assert {frozenset(entry) for entry in entries} == {frozenset({"name", "description", "file"})}
    plugins = json.loads(say("plugins", "--json")[1])
    keys = {"key", "entry_points", "class", "method", "shipped", "installed", "files"}
    assert all(item.keys() == keys for item in plugins.values())


def keys_on_the_page(call_):
    """The keys that the page promises of a call, at any depth."""
    lines = json_output.page().splitlines()
    (row,) = [line for line in lines if line.startswith(f"| `{call_}` |")]
    return set(re.findall(r"`(\w+)`", row.split("|")[2]))


def keys_in(data):
    """All keys of JSON, but for names of factors, tables and columns of rows."""
    if isinstance(data, list):
        return set().union(*map(keys_in, data))
    if not isinstance(data, dict):
        return set()
    own = {key: value for key, value in data.items() if key not in ("levels", "within", "data")}
    return {*data, *keys_in(list(own.values()))}


def test_results_as_json_have_the_keys_that_the_page_promises(folders):
    results, failed = folders
    shown = json.loads(say("show", results, "--json")[1])
    assert keys_on_the_page("show FOLDER --json") == keys_in(shown)
    assert shown["runs"] == 42
    assert {cell["part"] for cell in shown["cells"]} == {"drive", "story"}
    assert shown["answer"]["finding"]["differences"][0].keys() == {"level", "mean", "low", "high"}

    table = json.loads(say("show", results, "--table", "runs", "--rows", 3, "--json")[1])
    promised = keys_on_the_page("show FOLDER --table NAME --json")
    assert table.keys() == promised - {"name", "unit", "meaning"}
    assert (table["rows"], len(table["data"])) == (42, 3)
    assert list(table["data"][0]) == [column["name"] for column in table["columns"]]

    columns = json.loads(say("show", results, "--columns", "--json")[1])
    assert columns.keys() == {"folder", "tables"}
    assert columns["tables"]["runs"][0]["name"] == "part"

    compared = json.loads(say("compare", results, failed, "--json")[1])
    gates = {"condition", "groups", "bound"}
    assert keys_on_the_page("compare A B --json") - gates <= keys_in(compared)
    assert compared["b"]["failed"] == 1


def test_a_gate_fails_in_json_as_it_does_in_words(folders):
    results, _ = folders
    code, out, err = say("compare", results, results, "--fail-if", "max(contacts) > 0", "--json")
    (gate,) = json.loads(out)["gates"]
    assert (code, err) == (ExitCode.GATE_FAILED, "")
    assert (gate["condition"], gate["failed"]) == ("max(contacts) > 0", True)
    assert gate["groups"][0].keys() == {"part", "levels", "a", "b", "bound", "failed"}


def test_a_mistake_leaves_nothing_on_standard_output_for_a_program_to_trip_over(tmp_path):
    code, out, err = say("show", tmp_path, "--json")
    assert (code, out) == (2, "")
    assert err.startswith("error: ")
    assert err.count("\n") == 1


# --- less and more ---------------------------------------------------------------------


def test_an_episode_is_quiet_as_usual_or_tells_every_measure():
    words = ("episode", "drive-to-event", "--set", "horizon_s=3")
    assert say(*words, "-q") == (0, "", "")
    usual, more = say(*words)[1], say(*words, "-v")[1]
    assert "safety rules" in usual
    assert len(more.splitlines()) > len(usual.splitlines()) + 40
    assert re.search(r"\ntraffic_bytes +\d+ B +\w", more)


def test_a_report_is_quiet_or_tells_its_files(folders):
    results, _ = folders
    with blank_pictures():
        assert say("report", results, "--quiet") == (0, "", "")
        ended = say("report", results, "-v")[1]
    assert re.search(r"tables/runs\.parquet: [\d,]+ bytes\n", ended)


def test_a_dry_run_tells_every_configuration_if_asked_to(tmp_path, monkeypatch):
    monkeypatch.setattr(dry_run, "_tried", lambda *_: _Tried({}))
    path = study_in(tmp_path).file
    out = say("run", path, "--dry-run", "-v", "-o", tmp_path / "out")[1]
    assert len(re.findall(r"^  (?:drive|story), (?:cell \d+|reference): ", out, re.M)) == 9
    assert say("run", path, "--dry-run", "-q", "-o", tmp_path / "out") == (0, "", "")


def test_runs_that_failed_are_told_on_standard_error_however_quiet(tmp_path, monkeypatch):
    monkeypatch.setattr(session, "run_job", one_fails)
    path = study_in(tmp_path).file
    with blank_pictures():
        code, out, err = say("run", path, "-q", "-j", 1, "-o", tmp_path / "out")
    assert (code, out) == (ExitCode.RUNS_FAILED, "")
    assert err.startswith("error: 1 run failed")
    assert err.count("\n") == 1


# --- completion ------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("line", "found"),
    [
        ("dva-sim li", {"link", "list", "live"}),
        ("dva-sim run req", {"req-rep-vs-pub-sub"}),
        ("dva-sim episode fire", {"fire-drill"}),
        ("dva-sim episode tasks/fitts", {"tasks/fitts-lag", "tasks/fitts-tilt"}),
        ("dva-sim site show ca", {"campus", "caparica"}),
        ("dva-sim live fire-drill --only w", {"world"}),
        ("dva-sim run --dry", {"--dry-run"}),
        ("dva-sim list st", {"studies"}),
    ],
)
def test_the_shell_completes_commands_options_and_names(monkeypatch, capsys, line, found):
    monkeypatch.setenv("_DVA_SIM_COMPLETE", "complete_bash")
    monkeypatch.setenv("COMP_WORDS", line)
    monkeypatch.setenv("COMP_CWORD", str(len(line.split()) - 1))
    with pytest.raises(SystemExit) as ended:
        call([])
    assert ended.value.code == 0
    assert set(capsys.readouterr().out.split()) == found
