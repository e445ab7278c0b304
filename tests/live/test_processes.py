"""`dva-sim live` as users run it: real processes, real sockets, real signals."""

import errno
import json
import os
import re
import resource
import signal
import socket
from collections import defaultdict
from pathlib import Path

import pytest
from helpers.processes.command_line import call
from helpers.processes.programs import Program, wait_until
from helpers.wording import unnamed

from dva_sim.agents.robot.decision_log import replay
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import decode
from dva_sim.recordings.reading import read_recording
from dva_sim.simulation.full.verdicts import RULES

pytestmark = [
    pytest.mark.system,
    pytest.mark.skipif(not Path("/proc/self/environ").exists(), reason="no list of processes"),
]

SCRIPTED = (
    *("live", "drive-to-event", "--operators", "scripted"),
    *("--set", "robot.processing_s=0"),
)


NEAR = (
    *("--set", "events=[{kind: fire, at_s: 0, reported: true, room: Robot bay}]"),
    *("--set", "robot.way_m=4"),
)
BRIEFLY = """
from functools import partial

from dva_sim.agents.operator.scripted import drill
from dva_sim.live import parts

parts.drill = partial(drill, commands=20)
"""


@pytest.fixture
def briefly(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The script drives for two seconds rather than for twenty."""
    (tmp_path / "sitecustomize.py").write_text(BRIEFLY)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))


# --- a whole run ---------------------------------------------------------------------------


def test_a_run_tells_its_story_shows_all_devices_and_ends_when_its_script_is_done(
    programs, tmp_path
):
    run = programs.start(*SCRIPTED, "--record", "traces")
    assert run.ends() == 0, run.complained
    assert all_held(run)
    words = ("breaks out", "mode Teleoperation", "mode Idle", "200 of 200 commands")
    assert unnamed(run.output, *words, "an emergency: obeyed", "refused (wrong mode)") == []
    first, *lines = run.output.partition("after ")[0].splitlines()
    assert first.startswith("DVA: 127.0.0.1:")
    story = defaultdict(list)  # of each device in its order: parts of a run may be late
    for line in lines:
        time, _, rest = line.partition(" s ")
        story[rest.split()[0]].append(float(time))
    assert [times for times in story.values() if times != sorted(times)] == []
    table = run.output[run.output.rindex("mode Idle") :]
    words = ("(the script is done)", "robot-1", "operator-1", "event 1 (fire)")
    assert unnamed(table, *words, "pending") == []  # nobody who follows a script goes there
    assert run.complained == []
    assert programs.processes() == {}

    decided = list(replay(tmp_path / "traces" / "robot-1.trace.jsonl"))
    assert sum(isinstance(message.body, m.SetTeleOp) for message, _, _ in decided) == 211
    assert all(then == now for _, then, now in decided)
    assert call("check", *(tmp_path / "traces").iterdir()).stdout.endswith("2 files: 2 valid\n")


def all_held(run: Program) -> bool:
    """True if a run has reported each safety rule as held."""
    return all(f"\n{rule} held: " in run.output for rule in RULES)


DEAF = f"""{BRIEFLY}
from dva_sim.agents.robot.controller import Decision, RobotController
from dva_sim.protocol import messages as m

RobotController.stop = lambda *_: Decision(m.OK, "stopped")
"""


@pytest.mark.invariant("S3")
def test_a_robot_that_answers_an_emergency_and_ignores_it_lets_no_run_end_as_done(
    programs, tmp_path, monkeypatch
):
    """The bug is in all processes; what it did is judged by what was seen."""
    (tmp_path / "sitecustomize.py").write_text(DEAF)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    run = programs.start(*SCRIPTED, "--record", "run.mcap")
    assert run.ends() == 1
    assert "an emergency: obeyed" in run.output
    story, entry = [line for line in run.output.splitlines() if "S3 broken" in line]
    assert re.fullmatch(r" +[\d.]+ s  robot-1 +S3 broken: .*", story)
    assert re.fullmatch(r"S3 broken: robot-1, at \d+\.\d s.*: .*", entry)
    (complaint,) = run.complained  # on a busy machine S1, too: it moves for longer than allowed
    assert unnamed(complaint, "S3") == []
    ended = call("check", tmp_path / "run.mcap")
    assert ended.returncode == 1
    assert f"run.mcap: {entry}" in ended.stdout
    assert "S3 broken: " in call("replay", tmp_path / "run.mcap").stdout


def count_in(recording: Path, element: bytes) -> int:
    """Number of messages with an element in a recording, which must be valid."""
    ended = call("check", recording)
    assert ended.returncode == 0, ended.stdout
    traffic = read_recording(recording).playback.recorder.traffic or ()
    return sum(isinstance(sent.payload, bytes) and element in sent.payload for sent in traffic)


@pytest.mark.usefixtures("briefly")
def test_a_run_leaves_a_recording_that_is_replayed_and_whose_decisions_hold(programs, tmp_path):
    run = programs.start(*SCRIPTED, "--record", "run.mcap")
    assert run.ends() == 0, run.complained
    assert all_held(run)
    assert "run.mcap written" in run.output
    file = tmp_path / "run.mcap"
    assert count_in(file, b"<SetTeleOp>") == 20 + 1 + 10
    opened = read_recording(file)
    assert set(opened.traces) == {"dva", "robot-1"}
    assert "robot-1" in opened.playback.recorder.tracks
    ended = call("replay", file, "--still", "still.png", cwd=tmp_path)
    assert ended.returncode == 0, ended.stderr
    words = ("breaks out", "an emergency: obeyed", "refused (wrong mode)", "event 1 (fire)")
    assert unnamed(ended.stdout, *words) == []
    assert not list(tmp_path.glob("*.part"))


@pytest.mark.usefixtures("briefly")
def test_the_robots_go_on_when_the_disk_becomes_full(programs, tmp_path):
    run = programs.start(*SCRIPTED, "--record", "run.mcap")
    run.wait_to_say("mode Teleoperation")
    resource.prlimit(run.process.pid, resource.RLIMIT_FSIZE, (50_000, 50_000))
    assert run.ends() == 2
    assert unnamed(run.output, "20 of 20 commands", "(the script is done)") == []
    (complaint,) = run.complained
    assert unnamed(complaint, "error: run.mcap ", os.strerror(errno.EFBIG), "run.mcap.part") == []
    assert call("replay", tmp_path / "run.mcap.part").returncode == 0


def test_a_run_lasts_as_long_as_it_is_told_to(programs):
    run = programs.start(*SCRIPTED, "--for", "3")
    assert run.ends() == 0
    assert "(time is up)" in run.output
    assert programs.processes() == {}


def test_a_simulated_person_drives_to_the_fire_and_confirms_it(programs, tmp_path):
    run = programs.start("live", "drive-to-event", *NEAR, "--record", "traces")
    assert run.ends() == 0, run.complained
    assert unnamed(run.output, "(settled)", "event 1 (fire)", "confirmed") == []
    assert all_held(run)
    assert programs.processes() == {}
    decided = list(replay(tmp_path / "traces" / "robot-1.trace.jsonl"))
    assert sum(isinstance(message.body, m.SetTeleOp) for message, _, _ in decided) > 10
    assert all(then == now for _, then, now in decided)


# --- how it ends ---------------------------------------------------------------------------


def test_a_run_that_is_interrupted_ends_cleanly(programs):
    run = programs.start("live", "drive-to-event")
    run.wait_to_say("mode Teleoperation")
    run.send(signal.SIGTERM)
    assert run.ends() == 0
    assert "(interrupted)" in run.output
    assert run.output.rindex("mode Idle") > run.output.rindex("mode Teleoperation")
    assert run.complained == []
    assert programs.processes() == {}


def test_a_run_can_be_interrupted_before_anything_has_happened(programs):
    run = programs.start(*SCRIPTED)
    programs.process_of("dva")
    run.send(signal.SIGINT)
    assert run.ends() == 0
    assert unnamed(run.output, "(interrupted)", "no event") == []
    assert programs.processes() == {}


# --- mistakes ------------------------------------------------------------------------------


def test_a_mistake_that_a_part_finds_ends_in_one_line_and_exit_code_2(programs):
    run = programs.start("live", "drive-to-event", "--for", "60", "--keys", ".")
    assert run.ends() == 2
    (line,) = run.complained
    assert unnamed(line, "error: ", "no keys") == []
    assert programs.processes() == {}


def test_a_port_that_is_taken_ends_in_one_line(programs, address):
    port = int(address.partition(":")[2])
    whole = (*SCRIPTED, "--dva", address)
    world = (*SCRIPTED, "--only", "world", "--port", str(port))
    for taken, words in ((port, world), (port + 1, whole)):
        with socket.socket() as other:
            other.bind(("127.0.0.1", taken))
            other.listen()
            run = programs.start(*words)
            assert run.ends() == 2
        (line,) = run.complained
        assert unnamed(line, "127.0.0.1", port, port + 1, os.strerror(errno.EADDRINUSE)) == []
    assert programs.processes() == {}


# --- parts started by hand -----------------------------------------------------------------


def test_three_parts_started_by_hand_work_together(programs, address):
    at = ("--dva", address)
    parts = [programs.start(*SCRIPTED, "--only", part, *at) for part in ("dva", "world")]
    parts.append(programs.start(*SCRIPTED, "--only", "operator", *at))
    dva, world, operator = parts
    dva.wait_to_say(f"DVA: {address}\n", "event 1 (fire) is pending")
    world.wait_to_say("mode Teleoperation", "mode Idle")
    for part in reversed(parts):
        part.send(signal.SIGINT)
        assert part.ends() == 0
        assert part.complained == []
    assert "robot-1" in dva.output
    assert "operator-1" in operator.output
    programs.wait_for_none()


def test_parts_may_start_before_the_dva(programs, address):
    at = ("--dva", address, "--set", "request.timeout_s=1")
    operator = programs.start(*SCRIPTED, "--only", "operator", *at)
    world = programs.start(*SCRIPTED, "--only", "world", *at)
    world.wait_to_say("breaks out")  # both have found nobody so far
    programs.start(*SCRIPTED, "--only", "dva", "--no-page", *at)
    world.wait_to_say("mode Teleoperation", "mode Idle")
    assert (operator.process.poll(), world.process.poll()) == (None, None)


def sessions_of_drives(trace: Path) -> set[int | None]:
    """In which sessions a robot was driven so far; its trace grows meanwhile."""
    whole = trace.read_text().split("\n")[1:-1]
    entries = [json.loads(line) for line in whole]
    messages = [decode(e["message"].encode()) for e in entries if e.get("code") == m.OK]
    return {message.session for message in messages if isinstance(message.body, m.SetTeleOp)}


@pytest.mark.invariant("S8")
def test_devices_register_again_at_a_dva_that_was_killed_and_is_back(programs, address, tmp_path):
    """The world is the same all the time; only a DVA that knows the robot can permit to drive."""
    at = ("--dva", address, "--set", "request.timeout_s=1")
    dva = programs.start(*SCRIPTED, "--only", "dva", "--no-page", *at)
    world = programs.start(*SCRIPTED, "--only", "world", *at, "--record", "traces")
    operator = programs.start(*SCRIPTED, "--only", "operator", *at)
    world.wait_to_say("mode Teleoperation")
    for part in (dva, operator):
        part.send(signal.SIGKILL)
        assert part.ends() == -signal.SIGKILL
    trace = tmp_path / "traces" / "robot-1.trace.jsonl"
    (before,) = sessions_of_drives(trace)
    for part in ("dva", "operator"):
        programs.start(*SCRIPTED, "--only", part, *at)
    wait_until(lambda: sessions_of_drives(trace) > {before}, "is driven by a new permission")
    assert max(sessions_of_drives(trace)) != before


def test_a_dva_that_was_killed_remembers_its_events_and_goes_on_with_them(
    programs, address, tmp_path
):
    """The fire is reported once, to the first DVA; the second hears that it is confirmed."""
    live = ("live", "drive-to-event", *NEAR, "--dva", address)
    keeps = ("--only", "dva", "--no-page", "--state", "dva.sqlite")
    dva = programs.start(*live, *keeps, "--record", "first")
    world = programs.start(*live, "--only", "world")
    programs.start(*live, "--only", "operator")
    world.wait_to_say("mode Teleoperation")
    dva.send(signal.SIGKILL)
    assert dva.ends() == -signal.SIGKILL
    again = programs.start(*live, *keeps, "--record", "second")
    again.wait_to_say("remembers 1 open event", "event 1 (fire) is confirmed")
    assert "pending" not in again.output
    again.send(signal.SIGINT)
    assert again.ends() == 0
    traces = [tmp_path / life / "dva.trace.jsonl" for life in ("first", "second")]
    assert '"do": "recall"' in traces[1].read_text()
    checked = call("check", *traces)
    assert checked.returncode == 0, checked.stdout
