"""`dva-sim check RECORDING` says of each safety rule whether it was held, broken or not judged."""

import re
from functools import partial

import pytest
from helpers.processes.command_line import call
from helpers.wording import unnamed
from recordings.runs import drive

from dva_sim.agents.robot.controller import Decision, RobotController
from dva_sim.agents.robot.robot import RobotAgent
from dva_sim.protocol import messages as m
from dva_sim.recordings import writing
from dva_sim.recordings.writing import write_recording
from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.full import observations
from dva_sim.simulation.full.run import Run
from dva_sim.simulation.full.stage import id_of
from dva_sim.simulation.full.verdicts import RULES

ROBOT = id_of("robot", 1)


def checked(path):
    """The exit code, the state of each rule, and all lines."""
    ended = call("check", path)
    assert ended.stderr == ""
    lines = [line.removeprefix(f"{path}: ") for line in ended.stdout.splitlines()]
    found = [re.match(r"(S\d) (held|broken|not judged): ", line) for line in lines]
    return ended.returncode, {one[1]: one[2] for one in found if one}, lines


def recorded(path, seconds=16.0, also=lambda _: None):
    """A recording of the first seconds of a drive."""
    scenario = scenarios.build(scenarios.load("drive-to-event"), {})
    run = Run(scenario, 1, keep_traffic=True)
    also(run)
    run.clock.run(seconds)
    write_recording(run.recording(), path)
    return path


@pytest.mark.system
def test_a_recording_of_an_honest_run_holds_every_rule(folder):
    code, rules, lines = checked(folder / "drive.mcap")
    assert (code, rules) == (0, dict.fromkeys(RULES, "held"))
    assert lines[-2].startswith("recording: valid; ")


def emergency(run):
    run.clock.call_at(13.0, partial(run.dva.device.ask, ROBOT, m.Emergency()))


@pytest.mark.invariant("S3")
def test_a_broken_rule_is_told_with_when_by_whom_and_how_and_makes_it_invalid(
    tmp_path, monkeypatch
):
    path = recorded(tmp_path / "honest.mcap", also=emergency)
    assert checked(path)[:2] == (0, dict.fromkeys(RULES, "held"))
    monkeypatch.setattr(RobotController, "stop", lambda *_: Decision(m.OK, "stopped"))
    path = recorded(tmp_path / "deaf.mcap", also=emergency)
    code, rules, lines = checked(path)
    assert code == 1
    assert rules == dict.fromkeys(RULES, "held") | {"S3": "broken"}
    (text,) = [line for line in lines if line.startswith("S3")]
    assert re.match(r"S3 broken: robot-1, at 13\.\d s, .*\d+ times", text)
    assert lines[-1] == "1 file: 1 invalid"


def test_a_recording_without_facts_is_not_taken_to_hold_any_rule(tmp_path, monkeypatch):
    """Recordings of version 0.8.0 and before have no facts."""
    run = drive()
    monkeypatch.setattr(run.recorder, "facts", None)
    write_recording(run, tmp_path / "old.mcap")
    code, rules, lines = checked(tmp_path / "old.mcap")
    assert (code, rules) == (5, dict.fromkeys(RULES, "not judged"))
    assert unnamed(lines, "how robots moved", "the DVA's book") == []


def test_a_recording_that_was_cut_short_is_judged_up_to_there(folder, tmp_path, monkeypatch):
    monkeypatch.setattr(writing, "CHUNK", 16 * 1024)
    whole = recorded(tmp_path / "whole.mcap")
    path = tmp_path / "cut.mcap"
    data = whole.read_bytes()
    messages_end = int.from_bytes(data[-28:-20], "little")  # the footer says where the index begins
    path.write_bytes(data[: messages_end * 2 // 3])
    code, rules, lines = checked(path)
    assert (code, rules) == (0, dict.fromkeys(RULES, "held"))
    assert "warning: was cut short" in lines
    assert re.search(r"S1 held: .*, up to \d+ s\n", "\n".join(lines))


def test_facts_that_nobody_has_written_so_end_in_one_line(tmp_path, monkeypatch):
    honest = observations.event_facts
    monkeypatch.setattr(
        observations, "event_facts", lambda *about: honest(*about) | {"state": "eaten"}
    )
    code, rules, lines = checked(recorded(tmp_path / "odd.mcap"))
    assert (code, rules) == (1, {})
    assert unnamed(lines[0], "facts", "'eaten'", "State") == []


@pytest.mark.invariant("S4")
def test_robots_are_held_to_what_they_were_whatever_has_become_of_their_profile(
    tmp_path, monkeypatch
):
    """A profile may be a file of a user, and no recording has it: the limits go with the facts."""
    path = recorded(tmp_path / "run.mcap")
    monkeypatch.setattr(observations, "robot_profiles", lambda _: pytest.fail("reads a profile"))
    assert checked(path)[:2] == (0, dict.fromkeys(RULES, "held"))


def test_who_moves_and_says_nothing_is_seen_all_the_same(tmp_path, monkeypatch):
    """No command was accepted, and none is recorded: the body moves."""

    def walks_off(run):
        body = run.field.robots[ROBOT].body
        run.clock.call_at(6.0, lambda: body.drive(0.3, 0.0, 100.0))

    monkeypatch.setattr(RobotAgent, "move", lambda *_: None)
    code, rules, _ = checked(recorded(tmp_path / "run.mcap", 10.0, walks_off))
    assert (code, rules["S1"]) == (1, "broken")
