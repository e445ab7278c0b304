"""Results of people at a console: a results folder with the tables of any run."""

import json
import re
import shutil
import sqlite3

import pytest
from helpers.console.simulated_console import Page
from helpers.processes.programs import wait_until
from helpers.wording import unnamed

import dva_sim
from dva_sim.cli.program import call
from dva_sim.console.run.recorder import KEPT_PER_DRIVE
from dva_sim.console.world.kept_results import KeptResults, name_of
from dva_sim.experiments.execution import kept_run
from dva_sim.experiments.execution.checkpoint import load_so_far
from dva_sim.experiments.execution.kept_run import KEPT_RUN, KeptRun
from dva_sim.experiments.report.blocks import Printed
from dva_sim.experiments.report.report import blocks_of
from dva_sim.experiments.report.study_size import size_of
from dva_sim.experiments.report.summary import Reading
from dva_sim.experiments.results.folder_lock import FolderInUse
from dva_sim.experiments.results.results import Results
from dva_sim.kernel.errors import ConfigError, DvaSimError, ExitCode, RunsFailed
from dva_sim.simulation.full.stage import DVA, id_of, kind_of

pytestmark = pytest.mark.system


def begun(monkeypatch, out, *changes, seed=1):
    """A console whose results are kept, and its page."""
    results = KeptResults(out, "hands-on", changes, seed, False)
    page = Page(monkeypatch, results.scenario.model_dump(mode="json"), seed, measured=True)
    results.follow(page.world)
    return results, page


def driven(monkeypatch, out, seed=1, end=KeptResults.write):
    """The results of two drives of two robots by one person, under two patterns."""
    results, page = begun(monkeypatch, out, "link.delay_s=0.1", seed=seed)
    page.let(1.0)
    assert page.do("take", robots=[0, 1])[0]
    for pattern in ("latest-wins", "req-rep"):
        assert page.do("pattern", robot=0, name=pattern)[0]
        assert page.do("start")[0]
        page.want(0.5, 0.2)
        page.let(5.0)
        page.let_go()
        assert page.do("stop")[0]
        page.let(1.0)
    end(results)
    results.close()
    return Results.load(out) if end is KeptResults.write else None


def killed(results):
    """End as by kill -9: what is in the journal by then is there, and nothing else."""
    results._kept._waiting.put(None)
    results._kept._thread.join()


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Those of a console that was ended, with another seed."""
    with pytest.MonkeyPatch.context() as monkeypatch:
        return driven(monkeypatch, tmp_path_factory.mktemp("whole") / "out", seed=7)


@pytest.fixture(scope="module")
def journal(tmp_path_factory):
    """The folder of one that was killed."""
    out = tmp_path_factory.mktemp("killed") / "out"
    with pytest.MonkeyPatch.context() as monkeypatch:
        driven(monkeypatch, out, seed=7, end=killed)
    return out


@pytest.fixture
def cut_off(journal, tmp_path):
    """A copy of it."""
    return shutil.copytree(journal, tmp_path / "out")


def test_a_drive_of_a_person_is_a_row(whole):
    results, drives = whole, whole.table("drives")
    assert set(results.tables) >= {"runs", "operators", "drives", "commands", "events", "people"}
    assert list(drives["person_label"]) == ["person-1"] * 4
    assert list(drives["robot_name"]) == ["robot-1", "robot-2"] * 2
    assert list(drives["pattern"]) == ["latest-wins", "latest-wins", "req-rep", "latest-wins"]
    assert list(drives["outcome"]) == ["stopped"] * 4
    assert list(drives["driven_s"]) == pytest.approx([5.2] * 4, abs=1.0)
    assert all(age == pytest.approx(0.102, abs=0.03) for age in drives["command_age_p50_s"])
    assert list(results.table("operators")["operator_name"]) == ["console-1"]
    assert results.runs["simulated_s"][0] > 10


def test_a_drive_that_is_over_at_once_has_its_person_too(monkeypatch, tmp_path):
    results, page = begun(monkeypatch, tmp_path / "out")
    page.let(1.0)
    assert page.do("take", robots=[0])[0]
    for _ in range(3):
        assert page.do("start")[0]
        assert page.do("stop")[0]
        page.let(0.1)
    results.write()
    results.close()
    drives = Results.load(tmp_path / "out").table("drives")
    assert len(drives["person_label"]) >= 3
    assert set(drives["person_label"]) == {"person-1"}


def test_the_times_of_the_tour_are_in_the_table_and_the_report(monkeypatch, tmp_path):
    results, page = begun(monkeypatch, tmp_path / "out")
    page.let(1.0)
    assert page.do("take", robots=[0])[0]
    assert not page.do("tour_time", robot=0, took_s=9.0)[0]  # who has not driven
    assert page.do("start")[0]
    for robot, took in [(0, -1.0), (0, True), (0, 4000.0), (1, 9.0)]:
        assert not page.do("tour_time", robot=robot, took_s=took)[0]
    assert page.do("tour_time", robot=0, took_s=12.34)[0]
    assert page.do("stop")[0]
    results.write()
    results.close()
    found = Results.load(tmp_path / "out")
    assert list(found.table("drives")["tour_time_s"]) == [12.34]
    (table,) = Reading(found).cells
    assert table.heads[-1].endswith("[s]")
    assert [row[-1] for row in table.rows] == ["12.3"]


def test_each_command_that_took_effect_is_a_row(whole):
    drives, commands = whole.table("drives"), whole.table("commands")
    for number, count in zip(drives["drive"], drives["commands_applied"], strict=True):
        assert 0 < count <= sum(commands["drive"] == number)
    assert all(commands["t_made_s"] <= commands["t_sent_s"])
    assert all(commands["t_sent_s"] < commands["t_arrived_s"])
    assert all(commands["t_arrived_s"] <= commands["t_applied_s"])


def test_its_report_shows_the_drives_of_people_by_pattern_and_link_and_compares_nothing(whole):
    reading = Reading(whole)
    reports = [reading.answer.lead, size_of(reading)]
    assert unnamed(" ".join(reports), "1 person", "4 drives", "2 robots", "people drove") == []
    (table,) = reading.cells
    delay = "0.10\N{NO-BREAK SPACE}s"
    assert [row[:5] for row in table.rows] == [
        ["person-1", "robot-1", "latest-wins PUB/SUB", delay, "1"],
        ["person-1", "robot-2", "latest-wins PUB/SUB", delay, "2"],
        ["person-1", "robot-1", "REQ/REP", delay, "1"],
    ]
    assert (reading.finding, reading.endings) == (None, None)
    printed = [block.table for block in blocks_of(reading, []) if isinstance(block, Printed)]
    assert table in printed  # and not folded
    assert list(whole.table("drives")["link_delay_s"]) == [0.1] * 4


@pytest.fixture(scope="module")
def decided(tmp_path_factory):
    """Results of a person who drove nothing: who raised an event, saw it, and sent a robot."""
    out = tmp_path_factory.mktemp("decided") / "out"
    with pytest.MonkeyPatch.context() as monkeypatch:
        results, page = begun(monkeypatch, out, "dispatch.mode=ask_first")
        assert page.do("room_join", name="Jane", role="supervise")[0]
        about = {"kind": "flood", "severity": "high", "x_m": 20.0, "y_m": 12.0}
        assert page.do("event_raise", **about)[0]
        page.let(3.0)
        assert page.do("event_acknowledge", event=1)[0]
        page.let(2.0)
        assert page.do("mission", robot="robot-1", event=1, role="supervise")[0]
        page.let(1.0)
        assert page.do("mission_found", event=1, finding="refuted")[0]
        page.let(1.0)
        results.write()
        results.close()
        yield Results.load(out)


def test_a_raised_event_is_a_row_with_what_people_did_and_how_long_it_took(decided):
    reported = decided.table("reported")
    row = {name: reported[name][0] for name in reported}
    who = [row[by] for by in ("raised_by", "acknowledged_by", "decided_by", "sent_by")]
    assert who == ["person-1"] * 4
    assert (row["kind"], row["sent"], row["ended"]) == ("flood", "robot-1", "refuted")
    assert row["acknowledge_s"] == pytest.approx(3.0, abs=0.2)
    assert row["decide_s"] == row["send_s"] == pytest.approx(5.0, abs=0.3)
    assert row["t_closed_s"] > row["t_reported_s"]
    assert [c.name for c in decided.columns("reported") if not c.meaning] == []


def test_its_report_says_who_decided_and_how_each_event_ended_though_nobody_drove(decided):
    reading = Reading(decided)
    lead = reading.answer.lead
    assert unnamed(lead, "Nobody drove", "1 person decided", "1 event: 1 refuted") == []
    people, events = reading.cells
    assert people.rows == [["person-1", "1", "3.0", "1", "5.0", "1", "5.0"]]
    assert [row[0] for row in events.rows] == ["1"]
    assert events.rows[0][-1] == "refuted"


def test_the_name_of_a_person_who_decides_is_in_no_table(decided):
    for table in decided.tables:
        assert b"Jane" not in decided.path_of(table).read_bytes()


def test_contacts_are_counted_drive_by_drive(monkeypatch, tmp_path):
    results, page = begun(monkeypatch, tmp_path / "out")
    page.let(1.0)
    assert page.do("take", robots=[0])[0]
    body = page.robot(0).body
    hits = []
    for seconds in (40.0, 2.0):
        before = body.contacts
        assert page.do("start")[0]
        page.want(1.0)
        page.let(seconds)
        page.let_go()
        assert page.do("stop")[0]
        page.let(2.0)
        hits.append(body.contacts - before)
    results.write()
    results.close()
    assert hits[0] > 0
    assert list(Results.load(tmp_path / "out").table("drives")["contacts"]) == hits


def test_every_column_says_what_it_means(whole):
    for table in ("drives", "commands"):
        assert [c.name for c in whole.columns(table) if not c.meaning] == []


def test_the_same_drives_give_the_same_bytes(whole, cut_off):
    again = load_so_far(cut_off)
    for table in ("drives", "commands"):
        assert whole.path_of(table).read_bytes() == again.path_of(table).read_bytes()


def test_what_a_person_calls_a_device_is_in_no_table(monkeypatch, tmp_path):
    out = tmp_path / "out"
    results, page = begun(monkeypatch, out)
    device = page.world.seating.person(0).device
    device.label = device.labels[device.id_tag] = "Jane's own"
    page.sets_out(then=3.0)
    results.write()
    results.close()
    for table in Results.load(out).tables:
        rows = Results.load(out).table(table)
        assert not any("Jane" in str(value) for column in rows.values() for value in column)


def test_a_folder_that_holds_something_is_left_as_it_is(tmp_path):
    (tmp_path / "mine.txt").write_text("mine")
    with pytest.raises(ConfigError, match="holds something"):
        KeptResults(tmp_path, "hands-on", [], 1, False)
    with pytest.raises(ConfigError, match="holds something"):
        KeptResults(tmp_path / "mine.txt", "hands-on", [], 1, True)
    KeptResults(tmp_path, "hands-on", [], 1, True).close()
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]


def test_the_manifest_tells_what_was_changed(whole):
    manifest = json.loads((whole.folder / "manifest.json").read_text())
    assert manifest["study"]["seed"] == 7
    assert manifest["study"]["parts"]["console"]["changes"] == {"link.delay_s": 0.1}


@pytest.mark.parametrize("kind", ["robot", "console", "phone"])
def test_a_device_has_a_kind_and_a_number_by_its_id(kind):
    assert kind_of(id_of(kind, 300)) == (kind, 300)
    assert name_of(id_of(kind, 2)) == f"{kind}-2"
    assert kind_of("AA:BB:CC:DD:EE:FF") == ("", 0xEEFF)
    assert kind_of(DVA)[0] == "dva"


def test_of_a_console_that_was_killed_the_next_command_makes_the_tables(whole, cut_off):
    assert not (cut_off / "manifest.json").exists()
    found = load_so_far(cut_off)
    assert found.partial == ""
    assert not (cut_off / KEPT_RUN).exists()
    for table in ("drives", "commands", "events"):
        assert found.table(table).rows == whole.table(table).rows
    assert list(found.table("commands")["t_made_s"]) == list(whole.table("commands")["t_made_s"])
    assert whole.runs["simulated_s"][0] - found.runs["simulated_s"][0] <= 1.0


def begun_again(out):
    with pytest.raises(ConfigError, match="cut off"):
        KeptResults(out, "hands-on", [], 1, False)


FIRST = {
    "export": lambda out: dva_sim.export(out, out.parent / "runs.csv"),
    "compare": lambda out: dva_sim.compare(out, out),
    "report": dva_sim.report,
    "load": dva_sim.load,
    "console": begun_again,
}


@pytest.mark.parametrize("command", FIRST)
def test_any_command_that_takes_results_makes_them_first(cut_off, command):
    FIRST[command](cut_off)
    assert Results.load(cut_off).table("drives").rows == 4
    assert not (cut_off / KEPT_RUN).exists()


def test_while_it_goes_on_it_is_shown_up_to_now_and_left_alone(monkeypatch, tmp_path):
    seen = []

    def show(results):
        wait_until(lambda: load_so_far(tmp_path / "out").runs["simulated_s"][0] > 10, "it is kept")
        before = {path.name for path in (tmp_path / "out").iterdir()}
        seen.append(load_so_far(tmp_path / "out"))
        assert {path.name for path in (tmp_path / "out").iterdir()} == before
        with pytest.raises(FolderInUse):
            dva_sim.load(tmp_path / "out")
        with pytest.raises(FolderInUse):
            KeptResults(tmp_path / "out", "hands-on", [], 1, True)
        results.write()

    driven(monkeypatch, tmp_path / "out", end=show)
    assert re.match("Partial: .* 1", seen[0].partial)
    assert seen[0].table("drives").rows == 4
    assert Results.load(tmp_path / "out").partial == ""


def test_a_folder_that_was_removed_meanwhile_is_made_again_with_all(monkeypatch, tmp_path):
    def end(results):
        shutil.rmtree(tmp_path / "out")
        results.write()

    driven(monkeypatch, tmp_path / "out", end=end)
    assert Results.load(tmp_path / "out").table("drives").rows == 4


def test_a_disk_that_is_full_for_a_while_costs_nothing(monkeypatch, tmp_path):
    keep, failed = KeptRun._keep, []

    def full(kept, lines):
        if len(failed) < 5 and lines:
            failed.append(len(lines))
            raise sqlite3.OperationalError("database or disk is full")
        keep(kept, lines)

    monkeypatch.setattr(KeptRun, "_keep", full)
    monkeypatch.setattr(kept_run, "RETRY_DELAY_S", 0.01)
    assert driven(monkeypatch, tmp_path / "out").table("drives").rows == 4
    assert len(failed) == 5


def test_a_disk_that_stays_full_is_told_and_what_it_took_is_kept(monkeypatch, tmp_path):
    def end(results):
        killed_thread = results._kept._thread
        monkeypatch.setattr(KeptRun, "_keep", full)
        monkeypatch.setattr(kept_run, "RETRY_DELAY_S", 0.01)
        with pytest.raises(DvaSimError, match="disk is full"):
            results.write()
        assert not killed_thread.is_alive()

    def full(kept, lines):
        raise sqlite3.OperationalError("database or disk is full")

    driven(monkeypatch, tmp_path / "out", end=end)
    assert load_so_far(tmp_path / "out").table("drives").rows == 4


@pytest.mark.parametrize("name", kept_run._TABLES)
def test_a_table_that_cannot_be_made_costs_no_other_and_is_made_later(
    monkeypatch, cut_off, capsys, name
):
    def broken(_):
        raise KeyError("who")

    reason = f"table '{name}' cannot be made: KeyError: 'who'"
    with monkeypatch.context() as during:
        during.setitem(kept_run._TABLES, name, broken)
        assert reason in load_so_far(cut_off).partial
        for command in ("show", "report"):
            assert call([command, str(cut_off)]) == ExitCode.OK
        assert reason in " ".join(capsys.readouterr().out.split())
        found = Results.load(cut_off)
        made = set(kept_run._TABLES) - {name, "reported"}  # nothing was reported by then
        assert set(found.tables) == made
    found = load_so_far(cut_off)
    assert (found.partial, found.has("runs"), (cut_off / KEPT_RUN).exists()) == ("", True, False)


def test_a_console_that_ends_without_a_table_names_it_and_fails(monkeypatch, tmp_path):
    monkeypatch.setitem(kept_run._TABLES, "operators", lambda _: {}["who"])
    out = tmp_path / "out"
    with pytest.raises(RunsFailed) as failure:
        driven(monkeypatch, out)
    assert unnamed(str(failure.value), out, "'operators'", "KeyError", "dva-sim show") == []
    assert failure.value.exit_code == ExitCode.RUNS_FAILED == 3
    assert Results.load(out).table("drives").rows == 4


def test_memory_does_not_grow_with_what_was_kept(monkeypatch, tmp_path):
    results, page = begun(monkeypatch, tmp_path / "out")
    page.sets_out(0.3, 0.5, then=30.0)
    (drive,) = page.world.recorder.drives
    assert drive.sent > 500
    for grown in (drive.frames, drive.commands, drive.applied, drive.intents):
        assert len(grown) <= KEPT_PER_DRIVE + 100
    assert sum(map(len, page.world.recorder.tracks.values())) <= 100
    results.write()
    results.close()
    commands = Results.load(tmp_path / "out").table("commands")
    assert commands.rows > 500
    assert commands["t_made_s"][-1] - commands["t_made_s"][0] > 25


def test_a_journal_that_is_damaged_is_told_in_a_line(tmp_path):
    (tmp_path / KEPT_RUN).write_bytes(b"no journal at all, but as long as a file of SQLite is" * 99)
    with pytest.raises(ConfigError, match=KEPT_RUN):
        load_so_far(tmp_path)


def test_a_class_in_a_file_is_run_for_no_results(cut_off):
    with sqlite3.connect(cut_off / KEPT_RUN) as kept:
        kept.execute("UPDATE run SET scenario = replace(scenario, '\"fire\"', '\"x.py:X\"')")
    kept.close()
    with pytest.raises(ConfigError, match="Python file"):
        load_so_far(cut_off)
