"""A recording in the console: any moment of it, told as a world that runs tells it."""

import math
import shutil
from itertools import pairwise
from pathlib import Path

import pytest
from helpers.console.declared_lines import at_page, checked
from helpers.console.recorded_console import RecordedPage
from helpers.console.simulated_phone import FIRE, PhonePage
from recordings.runs import drill, evacuation

from dva_sim.cameras.lines import PaintersLine
from dva_sim.console.replay.player import NOBODY, ExchangeLog, Player
from dva_sim.console.replay.recorded_run import RecordedRun
from dva_sim.console.replay.shelf import Shelf
from dva_sim.console.web.audit import rows_of
from dva_sim.kernel.errors import ConfigError
from dva_sim.protocol.codec import decode
from dva_sim.recordings.audit_log import AuditEntry, AuditLog, plain_row
from dva_sim.recordings.reading import read_recording
from dva_sim.recordings.writing import write_recording
from dva_sim.simulation.full.stage import DVA
from dva_sim.simulation.measures.episodes import tables_of


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("replay")
    for run in (drill, evacuation):
        write_recording(run(), folder / f"{run.__name__}.mcap", tables=tables_of(run()))
    return folder


@pytest.fixture(scope="module")
def recorded(files):
    return RecordedRun(read_recording(files / "drill.mcap"), "drill.mcap")


class PlayedWorld:
    """A player, and the newest line of each kind that it tells."""

    def __init__(self, run, shelf=None):
        self.lines, self.shown, self.answers, self.logs = {}, [], [], []
        self.received = []
        self.player = Player(run, shelf)
        self.player.tell, self.player.show = self._take, self._show

    def _take(self, line, key=None):
        line = checked(line)
        self.lines[line["k"]] = line
        self.received.append(line)
        if line["k"] == "log":
            self.logs.append(line)
        if line["k"] == "done":
            self.answers.append(line)

    def _show(self, line, key=None):
        self.shown.append(checked(line, PaintersLine))

    def ask(self, what, number="a", **more):
        self.player.take({"do": what, "id": number, "client": "c", **more})
        return self.answers[-1]


@pytest.fixture
def playing():
    """Makes players, which leave nothing behind."""
    made = []

    def play(*what):
        made.append(PlayedWorld(*what))
        made[-1].player.begin()
        return made[-1]

    yield play
    for entry in made:
        entry.player.close()


@pytest.mark.system
def test_events_come_back_as_the_dva_knew_them(files):
    known, kept = drill().events, read_recording(files / "drill.mcap").playback.events
    assert known
    assert [(e.number, e.kind, e.state, e.times) for e in kept] == [
        (e.number, e.kind, e.state, e.times) for e in known
    ]
    assert [(e.responder, e.operator, e.actor) for e in kept] == [
        (e.responder, e.operator, e.actor) for e in known
    ]


def test_the_history_of_an_event_is_told_up_to_the_moment(recorded, playing):
    page = playing(recorded)
    page.ask("pace", paused=True)
    page.ask("seek", "s1", t_ms=64_000)  # events are assigned as soon as they are reported
    first = page.ask("event_details", "d1", event=1)["details"]["history"]
    assert [(step["what"], step["at_ms"]) for step in first] == [
        ("reported", 64_000),
        ("assigned", 64_000),
    ]
    assert first[1]["device"] == "guard-1"
    assert page.ask("event_details", "d2", event=2)["text"] == "there is no event 2"
    page.ask("seek", "s2", t_ms=90_000)
    newest = page.ask("event_details", "d3")["details"]["history"]
    assert [step["event"] for step in newest] == [1, 1, 2, 2]


def states(run, now):
    return [row["state"] for row in run.events(now)["events"]]


def test_a_jump_back_unlearns_what_was_heard_since(recorded):
    assert states(recorded, 90.0) == ["assigned", "assigned"]
    assert states(recorded, 64.0) == ["assigned"]
    assert states(recorded, 63.9) == []


def test_an_event_that_was_assigned_twice_was_assigned_in_between(monkeypatch, tmp_path):
    page = PhonePage(monkeypatch, bystander__count=0, events=FIRE, dispatch__mode="ask_first")
    kept = RecordedPage(page, tmp_path / "run.mcap")
    page.let(4.0)
    dispatcher = {"event": 1, "device": "robot-2", "role": "supervise"}
    assert page.do("event_assign", **dispatcher)[0]
    page.let(2.0)
    assert page.do("event_take_off", **dispatcher)[0]
    page.let(2.0)
    assert page.do("event_assign", **dispatcher)[0]
    page.let(2.0)
    kept.finish()
    run = RecordedRun(read_recording(tmp_path / "run.mcap"), "run.mcap")
    (known,) = run.playback.events
    assert known.times["assigned"] > 8.0, "the DVA knows the second time alone"
    assert [states(run, now) for now in (5.0, 7.0, 9.0)] == [
        ["assigned"],
        ["pending"],
        ["assigned"],
    ]


def test_without_a_recording_there_is_no_history(files, playing):
    page = playing(None, Shelf(files))
    assert page.ask("event_details", event=1)["text"] == "No recording is played."


def test_everybody_is_where_the_run_had_them(recorded):
    for label, track in drill().recorder.tracks.items():
        for point in track[:: max(1, len(track) // 7)]:
            here = {name: at for name, at, _ in recorded.bench.places(point.time)}
            assert here[label].x == pytest.approx(point.x, abs=1e-3)
            assert here[label].y == pytest.approx(point.y, abs=1e-3)
            assert here[label].mode == point.mode


def test_between_two_points_of_a_track_somebody_glides(recorded):
    who, one, two = next(
        (name, a, b)
        for name, track in drill().recorder.tracks.items()
        for a, b in pairwise(track)
        if a.x != b.x
    )
    middle = (one.time + two.time) / 2
    at, speed = next((at, v) for name, at, v in recorded.bench.places(middle) if name == who)
    assert at.x == pytest.approx((one.x + two.x) / 2, abs=1e-3)
    way = math.dist((one.x, one.y), (two.x, two.y))
    assert speed == pytest.approx(way / (two.time - one.time), abs=1e-2)


def test_who_has_left_the_site_is_not_there_any_more(files):
    run = RecordedRun(read_recording(files / "evacuation.mcap"), "evacuation")
    there = [len(list(run.bench.places(when))) for when in (1.0, run.duration - 5.0)]
    assert there[1] < there[0]


def test_a_robot_that_is_driven_shows_who_drives_and_how(recorded):
    drive = next(d for d in drill().recorder.drives if d.started is not None and d.commands)
    when, speed, turn_rate = drive.commands[len(drive.commands) // 2]
    row = next(r for r in recorded.robots(when + 0.01) if r["holder"] == drive.operator)
    assert row["mode"] == "Teleoperation"
    assert row["set_speed_mps"] == pytest.approx(speed, abs=1e-3)
    assert row["set_turn_rate_radps"] == pytest.approx(turn_rate, abs=1e-3)
    assert row["battery"] is None


def test_a_driver_sees_the_picture_that_had_come_by_then(recorded):
    drive = next(d for d in drill().recorder.drives if len(d.frames) > 2)
    shown = drive.frames[2]
    frame = recorded.frame(drive.robot, 1, shown.time + 0.001)
    assert frame["captured_ms"] == round(1000 * shown.captured)
    assert frame["t"] > frame["captured_ms"]
    before = recorded.frame(drive.robot, 1, drive.frames[0].time - 0.001)
    assert before is None or before["captured_ms"] < frame["captured_ms"]


def test_a_jump_back_tells_the_moment_it_leads_to(recorded, playing):
    lines = playing(recorded)
    assert lines.ask("seek", "1", t_ms=80_000)["ok"]
    late = lines.lines["story_so_far"]["lines"]
    assert lines.lines["rows"]["t"] == 80_000
    assert lines.ask("seek", "2", t_ms=20_000)["ok"]
    early = lines.lines["story_so_far"]["lines"]
    assert lines.lines["rows"]["t"] == 20_000
    assert len(early) < len(late)
    assert all(line["t"] <= 20_000 for line in early)
    assert lines.lines["rows"]["clock"]["jumps"] == 2


def test_the_same_question_is_answered_once_and_done_once(recorded, playing):
    lines = playing(recorded)
    lines.ask("seek", "1", t_ms=50_000)
    lines.ask("seek", "2", t_ms=10_000)
    lines.ask("seek", "1", t_ms=50_000)
    assert round(lines.player.now) == 10


def test_what_would_tell_somebody_something_is_refused(recorded, playing):
    lines = playing(recorded)
    for what in ("take", "start", "emergency", "link", "phone_register", "guard_join"):
        answer = lines.ask(what, what)
        assert (answer["ok"], answer["text"]) == (False, NOBODY)


@pytest.mark.parametrize("factor", [0.01, 25.0])
def test_it_is_played_within_bounds(recorded, factor, playing):
    lines = playing(recorded)
    assert not lines.ask("pace", factor=factor)["ok"]


def test_at_its_end_it_stands_and_play_begins_again(recorded, playing):
    lines = playing(recorded)
    lines.ask("seek", "1", t_ms=10**9)
    assert lines.player.now == recorded.duration
    assert lines.lines["rows"]["clock"]["paused"]
    lines.ask("pace", "2", paused=False)
    assert lines.player.now < 1.0


def test_pictures_are_drawn_of_the_site_in_the_file_which_is_gone_afterwards(recorded, playing):
    lines = playing(recorded)
    (scene,) = [line for line in lines.shown if line["k"] == "scene"]
    site = Path(scene["scenario"]["site"]["name"])
    assert site.exists()
    lines.player.close()
    assert not site.exists()


def test_frames_are_told_of_robots_that_somebody_looks_at_alone(recorded, playing):
    lines = playing(recorded)
    lines.shown.clear()
    lines.player._show_frames()
    assert lines.shown == []
    lines.player.take({"do": "watch", "robots": [0]})
    lines.player._show_frames()
    assert [line["robot"] for line in lines.shown] == [0]


# --- recordings of a folder ---------------------------------------------------------------


def test_recordings_without_a_study_are_listed_by_name(files):
    line = Shelf(files).line()
    assert [one["name"] for one in line["recordings"]] == ["drill.mcap", "evacuation.mcap"]
    assert line["measures"] == []


def test_a_folder_without_recordings_is_told(tmp_path):
    with pytest.raises(ConfigError, match="contains no recordings"):
        Shelf(tmp_path)


@pytest.mark.parametrize("name", ["../drill.mcap", "other.mcap", "drill.mcap/"])
def test_only_what_is_on_the_list_is_opened(files, name, playing):
    lines = playing(None, Shelf(files))
    answer = lines.ask("open_recording", name=name)
    assert not answer["ok"]
    assert "there is no recording" in answer["text"]


def test_one_of_the_list_is_played_from_its_beginning(files, playing):
    lines = playing(None, Shelf(files))
    assert lines.lines["scene"]["replay"] is None
    assert lines.ask("open_recording", name="drill.mcap")["ok"]
    assert lines.lines["scene"]["replay"]["name"] == "drill.mcap"
    assert lines.lines["rows"]["t"] < 1000


def test_a_recording_that_is_damaged_is_told_and_the_one_before_goes_on(files, tmp_path, playing):
    shutil.copy(files / "drill.mcap", tmp_path / "good.mcap")
    (tmp_path / "bad.mcap").write_bytes(b"no recording at all")
    lines = playing(None, Shelf(tmp_path))
    assert lines.ask("open_recording", "1", name="good.mcap")["ok"]
    answer = lines.ask("open_recording", "2", name="bad.mcap")
    assert not answer["ok"]
    assert "is not a recording" in answer["text"]
    assert lines.player.run.name == "good.mcap"


# --- logs and windows ----------------------------------------------------------------------


def test_a_log_is_told_up_to_the_moment_and_again_after_a_jump(recorded, playing):
    lines = playing(recorded)
    lines.ask("seek", "1", t_ms=80_000)
    lines.logs.clear()
    lines.player.take({"do": "look", "logs": {"dva": False}, "tables": []})
    late = [row for line in lines.logs for row in line["lines"]]
    assert lines.logs[0]["replaces"]
    assert late[-1][1] <= 80_000
    assert [row[0] for row in late] == list(range(1, len(late) + 1))

    lines.logs.clear()
    lines.ask("seek", "2", t_ms=10_000)
    lines.player._tell_logs()
    early = [row for line in lines.logs for row in line["lines"]]
    assert lines.logs[0]["replaces"]
    assert early == late[: len(early)]
    assert 0 < len(early) < len(late)


def test_each_request_has_the_reply_that_answers_it(recorded):
    log = ExchangeLog(drill().recorder.traffic, DVA)
    rows = [row for line in log.batches("dva", 0, log.until(1e9)) for row in line["lines"]]
    answered = [row for row in rows if row[3] is not None]
    assert answered
    for row in answered:
        request, reply = decode(row[2].encode("latin-1")), decode(row[3].encode("latin-1"))
        assert reply.body.answers == request.message_id
        assert reply.destination == request.source
    assert {row[5] for row in rows if "<HBMsg>" in row[2]} == {1}


def test_a_window_tells_how_long_commands_were_under_way(recorded):
    drive = next(d for d in drill().recorder.drives if d.applied)
    one = drive.applied[len(drive.applied) // 2]
    line = recorded.window(drive.robot, one.time)
    assert line["one_way"]["last_ms"] == pytest.approx(1000 * (one.arrived - one.sent), abs=0.1)
    assert recorded.window(drive.robot, drive.applied[0].time - 0.01)["one_way"] is None


def test_the_table_has_who_had_registered_by_then(recorded):
    early, late = (recorded.devices(when)["devices"] for when in (0.0005, 80.0))
    assert len(early) < len(late)
    rows = {row["label"]: row for row in late}
    assert {"robot-1", "robot-2", "guard-1", "guard-2", "operator-1"} <= rows.keys()
    assert rows["robot-1"]["type"] == "Robot"
    assert rows["guard-1"]["beats_hz"] == pytest.approx(0.5, abs=0.11)
    assert 0.0 <= rows["guard-1"]["heard_s"] < 5.0
    assert rows["robot-1"]["refused"] is None


# --- its audit log --------------------------------------------------------------------------


def test_the_rows_of_an_audit_log_are_those_of_the_recording_that_is_played(tmp_path, playing):
    log = AuditLog(tmp_path / "audit.sqlite")
    entries = [AuditEntry(time_s=1.0, at_utc="", author="ana", action=a) for a in ("begin", "take")]
    rows = log.append(entries)
    log.close()
    write_recording(drill(), tmp_path / "a.mcap", audit=[(1.0, plain_row(row)) for row in rows])
    write_recording(drill(), tmp_path / "b.mcap")
    lines = playing(None, Shelf(tmp_path))
    lines.ask("open_recording", "1", name="a.mcap")

    path = lines.player.audit.path
    assert rows_of(path) == rows
    assert rows_of(path, after=1) == rows[1:]
    assert lines.lines["scene"]["replay"]["audit"]
    line = lines.lines["audit"]
    assert (line["rows"], line["hash"], line["file"]) == (2, rows[1].hash, "a.mcap")

    lines.ask("open_recording", "2", name="b.mcap")
    assert rows_of(path) == []
    assert not lines.lines["scene"]["replay"]["audit"]


def test_what_a_page_gets_of_a_recording_is_as_declared(playing, recorded):
    played = playing(recorded, None)
    played.player.take({"do": "watch", "client": "c", "robots": [0]})
    looked = {"logs": {"dva": True, "robot-1": False}, "tables": ["devices"]}
    for t_ms in (20_000, 40_000):
        played.ask("seek", str(t_ms), t_ms=t_ms)
        played.player.take({"do": "look", "client": "c"} | looked)
    kinds = {message["k"] for message in at_page(played.received, "c")}
    assert kinds >= {
        "snap",
        "d",
        "rows",
        "robot",
        "log",
        "devices",
        "events",
        "story_so_far",
        "hazards",
    }
