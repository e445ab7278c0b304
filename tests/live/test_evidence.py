"""Evidence of a live run: replayed decisions of the DVA, and lines made into a recording."""

import errno
import inspect
import json
import os
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from helpers.processes.command_line import call
from helpers.wording import unnamed

from dva_sim.console.replay.console import player_of
from dva_sim.console.replay.player import playing
from dva_sim.core.dva import Dva
from dva_sim.core.events import EventTable
from dva_sim.core.store import Store
from dva_sim.kernel.clock import Clock
from dva_sim.kernel.errors import ConfigError, ExitCode
from dva_sim.kernel.recorder import Recorder
from dva_sim.live import recording
from dva_sim.live.recording import Keeper, LiveRecorder, TraceFile
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import encode
from dva_sim.recordings.reading import read_recording
from dva_sim.serving.pipes import PipeEnd
from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.full import dva_server
from dva_sim.simulation.full.dva_trace import TracedDva, replay_dva, traced
from dva_sim.simulation.full.observations import STATIONARY, FactLog, Page
from dva_sim.simulation.full.run import Run, Watched
from dva_sim.simulation.full.stage import DVA, id_of
from dva_sim.testing.evidence import check_recording, check_trace

ROBOT, PHONE = id_of("robot", 1), id_of("operator", 1)
PAGE = Page(EventTable(1.0), (), True)
Change = Callable[[list[dict[str, Any]]], object]


def scenario_of(name: str = "drive-to-event", **changes: object) -> scenarios.Scenario:
    return scenarios.build(scenarios.load(name), changes)


def trace_of(path: Path, name: str, memory: Store | None = None, **changes: object) -> Run:
    """A virtual run whose DVA is written down."""
    run = Run(scenario_of(name, **changes), 1)
    with path.open("w") as file:
        run.dva._memory, core = memory, run.dva.core
        run.dva.core = traced(core, lambda line: file.write(line + "\n"), run.stage, memory)
        if memory:
            run.dva.start()
        run.run()
        run.dva.close()
    return run


def differences(path: Path) -> int:
    return sum(d.then != d.now for d in replay_dva(path.read_bytes().splitlines(), path))


@pytest.fixture(scope="module")
def drill(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two events, robots, guards, operators; who goes is drawn by chance."""
    path = tmp_path_factory.mktemp("traces") / "dva.trace.jsonl"
    trace_of(path, "fire-drill", horizon_s=120, dispatch={"policy": "random"})
    return path


# --- the DVA decides the same again -------------------------------------------------------


def test_a_dva_that_draws_by_chance_decides_the_same_again(drill):
    entries = [json.loads(line) for line in drill.read_text().splitlines()]
    assert any(entry.get("bits") for entry in entries)
    decided = "".join(text for entry in entries for text in entry.get("decided", ()))
    for name in ("Order(", "PermissionGrant(", "Reply("):
        assert name in decided
    assert differences(drill) == 0
    problems, doubts, note = check_trace(drill)
    assert (problems, doubts) == ([], [])
    assert int(note.split()[0]) > 200


@pytest.mark.parametrize("policy", ["auction", "coverage", "hazard_team", "min_eta"])
def test_a_dva_with_another_policy_decides_the_same_again(tmp_path, policy):
    path = tmp_path / "dva.trace.jsonl"
    trace_of(path, "fire-drill", horizon_s=60, dispatch={"policy": policy})
    assert differences(path) == 0


def test_a_dva_that_remembers_an_earlier_life_decides_the_same_again(tmp_path):
    store = Store(tmp_path / "memory.sqlite")
    Run(scenario_of(horizon_s=30), 1, watched=Watched(Clock(), Recorder(), memory=store)).run()
    path = tmp_path / "dva.trace.jsonl"
    run = trace_of(path, "drive-to-event", store, horizon_s=60)
    assert '"do": "recall"' in path.read_text()
    assert run.dva.core.events.total == 1
    assert differences(path) == 0


def test_every_way_to_ask_the_dva_is_written_down():
    """A change of the DVA that no trace records would be missed by every replay."""
    public = {name for name, _ in inspect.getmembers(Dva, inspect.isfunction) if name[0] != "_"}
    asked = set(re.findall(r"\bcore\.(\w+)\(", inspect.getsource(dva_server)))
    kept = {name for name in vars(TracedDva) if name[0] != "_"}
    assert public - kept == {"next_deadline", "with_something_open"}  # which change nothing
    assert asked <= kept


def _first_grant(entries: list[dict[str, Any]]) -> dict[str, Any]:
    return next(e for e in entries if "PermissionGrant" in str(e.get("decided")))


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (lambda es: _first_grant(es)["decided"].pop(), "decided was"),
        (lambda es: es.remove(next(e for e in es if "<RegMsg>" in str(e))), "decided was"),
        (lambda es: _first_grant(es).update(bits=[1, 1, 1]), "decided was"),
        (lambda es: es[0].update(seed=2), "decided was"),
        (lambda es: es[1].update(do="lunch"), "'lunch' does not happen to a DVA"),
        (lambda es: es[1].pop("now"), "'now' is missing"),
        (lambda es: es.clear(), "is no line of a robot's trace"),
    ],
)
def test_a_trace_changed_by_hand_is_found_out(drill, tmp_path, change, text):
    entries = [json.loads(line) for line in drill.read_text().splitlines()]
    change(entries)
    path = tmp_path / "changed.trace.jsonl"
    path.write_text("".join(json.dumps(entry) + "\n" for entry in entries))
    problems, *_ = check_trace(path)
    assert problems
    assert any(text in problem.text for problem in problems)


def test_a_trace_that_ends_in_the_middle_of_a_line_is_checked_up_to_there(drill, tmp_path):
    path = tmp_path / "cut.trace.jsonl"
    path.write_bytes(drill.read_bytes()[:-20])
    ended = call("check", str(path))
    assert (ended.returncode, ended.stderr) == (0, "")
    assert unnamed(ended.stdout, "warning: ", "cut off") == []


def test_a_trace_runs_no_class_in_a_file(drill, tmp_path):
    start, *rest = drill.read_text().splitlines(keepends=True)
    reported = json.loads(start)
    reported["scenario"]["dispatch"]["policy"] = "mine.py:Mine"
    path = tmp_path / "dva.trace.jsonl"
    path.write_text("".join([json.dumps(reported) + "\n", *rest]))
    (problem,) = check_trace(path)[0]
    assert unnamed(problem.text, "mine.py:Mine", "class") == []


# --- lines on their way -------------------------------------------------------------------


def message(number: int, source: str = PHONE) -> bytes:
    return encode(m.Message(ROBOT, number, source, "12:00:00", 7, m.SetTeleOp(0.1, 0.0, None)))


def test_who_records_never_waits_and_counts_what_has_no_room():
    reads, writes = os.pipe()
    recorder = LiveRecorder(Clock(), PipeEnd(writes))
    for number in range(1, 2001):
        recorder.message(PHONE, message(number), True)
    dropped = recorder.counters["not recorded"]
    kept = 2000 - dropped
    assert 0 < dropped < 2000
    whole = os.read(reads, 1 << 20).split(b"\n")
    assert abs(len(whole) - kept) <= 1  # the last one may be there in part
    assert all(json.loads(line)[0] == "sent" for line in whole[:-1])
    os.close(reads)
    recorder.message(PHONE, message(1), True)  # nobody reads any longer: no exception
    os.close(writes)


def test_nothing_is_written_to_a_file_that_has_the_number_of_a_closed_outlet():
    reads, writes = os.pipe()
    outlet = PipeEnd(writes)
    assert outlet.offer(b"a line\n")
    outlet.close()
    assert os.read(reads, 100) == b"a line\n"
    os.dup2(reads, writes)
    assert not outlet.offer(b"another\n")
    os.close(reads)
    os.close(writes)


def test_a_part_says_no_more_in_a_second_than_was_agreed(monkeypatch):
    monkeypatch.setattr(recording, "BYTES_PER_SECOND", 1000)
    monkeypatch.setattr(recording.time, "monotonic", lambda: 5.0)
    with Path(os.devnull).open("wb") as nowhere:
        recorder = LiveRecorder(Clock(), PipeEnd(nowhere.fileno()))
        for number in range(1, 101):
            recorder.message(PHONE, message(number), True)
    assert 95 <= recorder.counters["not recorded"] < 100


@pytest.mark.parametrize("source", [PHONE, "AA:BB:CC:DD:EE:01"])
def test_strangers_leave_half_of_the_room_to_the_devices_of_the_run(monkeypatch, source):
    monkeypatch.setattr(recording, "BYTES_PER_SECOND", 100_000)
    monkeypatch.setattr(recording.time, "monotonic", lambda: 5.0)
    clock = Clock()
    with Path(os.devnull).open("wb") as nowhere:
        recorder = LiveRecorder(clock, PipeEnd(nowhere.fileno()), keeps=False)
        recorder.team = {PHONE, ROBOT}
        recorder.log = FactLog(recorder.observe, {ROBOT}, lambda _: STATIONARY, keeps_sent=False)
        for number in range(1, 1001):
            recorder.message(ROBOT, message(number, source), False)
        used = recording.BYTES_PER_SECOND - recorder._room
        most = 100_000 if source == PHONE else 50_000
        assert most <= used < most + 1000
        assert [gap.missing > 500 for gap in recorder._gaps.values()] == [True]
        recorder.message(ROBOT, message(1, PHONE), True)
        assert (False in recorder._gaps) == (source == PHONE)


@pytest.mark.parametrize("has_order", [False, True])
def test_registrations_of_strangers_without_an_order_are_no_facts(has_order):
    reads, writes = os.pipe()
    recorder = LiveRecorder(Clock(), PipeEnd(writes), keeps=False)
    recorder.is_own = {DVA}.__contains__
    recorder.log = FactLog(
        recorder.observe, (), lambda _: STATIONARY, lambda _: PAGE, keeps_sent=False
    )
    stranger = "AA:BB:CC:DD:EE:01"
    if has_order:
        order = m.Order(1, "fire", m.Position(1.0, 2.0), None)
        recorder.message(DVA, encode(m.Message(stranger, 1, DVA, "12:00:00", 0, order)), True)
    wish = m.Registration("mine", "Guard", "127.0.0.1:9999")
    recorder.message(DVA, encode(m.Message(DVA, 5, stranger, "12:00:00", 0, wish)), False)
    recorder.log.shows(0.0, PAGE)
    lines = [json.loads(line) for line in os.read(reads, 1 << 20).splitlines()]
    facts = [line[2] for line in lines if line[0] == "seen"]
    assert facts == (["book", "arrived", "book"] if has_order else ["heard", "book"])
    os.close(reads)
    os.close(writes)


def test_of_strangers_what_arrives_is_kept_of_others_what_they_send():
    reads, writes = os.pipe()
    recorder = LiveRecorder(Clock(), PipeEnd(writes))
    recorder.is_own = {PHONE, ROBOT}.__contains__
    stranger = "AA:BB:CC:DD:EE:01"
    recorder.message(PHONE, message(1), True)
    recorder.message(ROBOT, message(1), False)
    recorder.message(ROBOT, message(2, stranger), False)
    recorder.message(ROBOT, message(3, stranger).replace(b"0.1", b"fast"), False)  # is none
    recorder.message(ROBOT, b"rubbish", False)
    lines = [json.loads(line) for line in os.read(reads, 1 << 20).splitlines()]
    assert [(line[0], line[2]) for line in lines] == [("sent", PHONE), ("sent", stranger)]
    os.close(reads)
    os.close(writes)


def test_after_a_gap_a_trace_goes_on_no_more():
    reports = []

    class Full(LiveRecorder):
        def trace(self, who: str, line: str) -> bool:
            reports.append(line)
            return line != "second"

    take = recording.TraceLines(Full(Clock(), PipeEnd(os.open(os.devnull, os.O_WRONLY))), "dva")
    for line in ("first", "second", "third"):
        take(line)
    assert reports == ["first", "second"]


# --- from lines to a recording ------------------------------------------------------------


def record(path: Path, lines: int = 20) -> Keeper:
    """A run of a few lines, whose part has ended."""
    keeper = Keeper(path, scenario_of(), 1)
    inlet = keeper.inlet()
    recorder = LiveRecorder(Clock(), PipeEnd(inlet))
    recorder.put("team", {ROBOT: "robot-1", PHONE: "operator-1"}, {ROBOT: 0.3})
    for number in range(1, lines + 1):
        recorder.put("sent", number / 10, PHONE, ROBOT, message(number).decode())
        recorder.put("at", number / 10, [["robot-1", number / 10, 1.0, 0.0, "Idle"]])
    recorder.tell(2.0, "robot-1", "is now in mode Idle", "mode")
    os.close(inlet)
    return keeper


def found_in(path: Path) -> tuple[object, ...]:
    """Findings of `check_recording`, without the safety rules, which live runs do not judge."""
    *found, rules = check_recording(path)
    assert {verdict.state for verdict in rules} == {"not judged"}
    return tuple(found)


def test_what_parts_say_becomes_a_recording_whose_messages_are_valid(tmp_path):
    path = tmp_path / "run.mcap"
    assert record(path).finish() is None
    assert [file.name for file in tmp_path.iterdir()] == ["run.mcap"]
    playback = read_recording(path).playback
    assert [sent.payload for sent in playback.recorder.traffic or ()] == [
        message(number) for number in range(1, 21)
    ]
    assert len(playback.recorder.tracks["robot-1"]) == 20
    assert playback.recorder.timeline[0].what.endswith("mode Idle")
    assert found_in(path) == ([], [], "20 messages")


def test_a_message_that_is_none_is_found_in_a_recording(tmp_path):
    path = tmp_path / "run.mcap"
    keeper = record(path)
    inlet = keeper.inlet()
    bad = message(99).replace(b"0.1", b"fast").decode()
    os.write(inlet, json.dumps(["sent", 3.0, PHONE, ROBOT, bad]).encode() + b"\n")
    os.close(inlet)
    assert keeper.finish() is None
    ended = call("check", str(path))
    assert ended.returncode == 1
    assert unnamed(ended.stdout, "message 21", "3.0 s", PHONE) == []


def test_lines_that_were_left_are_read_like_a_recording_and_stay(tmp_path):
    """The lines are those of a run whose supervisor was killed in the middle of one."""
    keeper = record(tmp_path / "run.mcap")
    keeper.close()
    with keeper.path.open("ab") as file:
        file.write(b'["sent", 9.9, "02')
    left = keeper.path.read_bytes()
    done = call("check", str(keeper.path))
    assert done.returncode == ExitCode.NOT_JUDGED, done.stdout
    assert "interrupted" in done.stdout
    ended = call("replay", str(keeper.path))
    assert (ended.returncode, unnamed(ended.stderr, "S1", "S7")) == (ExitCode.NOT_JUDGED, [])
    assert unnamed(ended.stdout, "mode Idle", "run.mcap.part", " 2 s ") == []
    with playing(player_of(keeper.path, None)) as player:
        assert player.run is not None
        assert player.run.name == "run.mcap.part"
    assert [path.name for path in tmp_path.iterdir()] == ["run.mcap.part"]
    assert keeper.path.read_bytes() == left


def test_a_recording_is_made_of_lines_that_were_left_where_one_is_asked_for(tmp_path):
    keeper = record(tmp_path / "run.mcap")
    keeper.close()
    made = tmp_path / "made.mcap"
    ended = call("replay", str(keeper.path), "--mcap", str(made))
    assert (ended.returncode, unnamed(ended.stderr, "S1", "S7")) == (ExitCode.NOT_JUDGED, [])
    assert found_in(made) == ([], [], "20 messages")
    assert keeper.path.exists()
    again = call("replay", str(keeper.path), "--mcap", str(made))
    assert (again.returncode, unnamed(again.stderr, made, "replaced")) == (2, [])
    already = call("replay", str(made), "--mcap", str(tmp_path / "other.mcap"))
    assert (already.returncode, unnamed(already.stderr, made, "already")) == (2, [])


def test_the_lines_of_a_run_that_goes_on_can_be_read_meanwhile(tmp_path):
    keeper = record(tmp_path / "run.mcap")
    inlet = keeper.inlet()
    ended = call("replay", str(keeper.path))
    assert (ended.returncode, unnamed(ended.stderr, "S1", "S7")) == (ExitCode.NOT_JUDGED, [])
    with pytest.raises(ConfigError, match=r"run\.mcap\.part.*in progress"):
        Keeper(tmp_path / "run.mcap", scenario_of(), 1)
    os.write(inlet, b'["told", 3.0, "dva", "is here", "event"]\n')
    os.close(inlet)
    assert keeper.finish() is None
    assert found_in(tmp_path / "run.mcap") == ([], [], "20 messages")
    assert read_recording(tmp_path / "run.mcap").playback.recorder.timeline[-1].time == 3.0


def test_a_run_whose_folder_is_removed_meanwhile_is_recorded(tmp_path):
    folder = tmp_path / "there"
    folder.mkdir()
    keeper = record(folder / "run.mcap")
    shutil.rmtree(folder)
    assert keeper.finish() is None
    assert found_in(folder / "run.mcap") == ([], [], "20 messages")


def test_a_disk_that_becomes_full_is_told_in_one_line(tmp_path):
    keeper = Keeper(tmp_path / "run.mcap", scenario_of(), 1)
    inlet = keeper.inlet()
    with Path("/dev/full").open("wb") as full:
        os.dup2(full.fileno(), keeper._file.fileno())
    os.write(inlet, b'["told", 1.0, "dva", "is here", "event"]\n')
    os.close(inlet)
    assert unnamed(keeper.finish(), "run.mcap", " 0 s ", os.strerror(errno.ENOSPC)) == []


def test_a_run_that_has_grown_too_large_is_kept_up_to_there(tmp_path, monkeypatch):
    monkeypatch.setattr(recording, "MAX_BYTES", 30_000)
    lost = record(tmp_path / "run.mcap", lines=1000).finish()
    assert unnamed(lost, "run.mcap", " s only", "0 MB") == []
    assert check_recording(tmp_path / "run.mcap")[0] == []


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no disk that is always full")
def test_a_trace_on_a_full_disk_ends_and_is_told_once():
    reports: list[str] = []
    take = TraceFile(Path("/dev/full"), reports.append)
    for _ in range(3):
        take("line")
    (line,) = reports
    assert unnamed(line, "trace", os.strerror(errno.ENOSPC)) == []
