"""Traces of robots' decisions: replayed through a fresh controller they give the same."""

import json
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from helpers.dva.permissions import confirmation, enter
from helpers.network.scripted_session import ROBOT, over_sockets, pipelined

from dva_sim.agents.robot.controller import LEASE_S, Limits, RobotController
from dva_sim.agents.robot.decision_log import (
    ASKS,
    LEASE_ENDS,
    MISSION_ENDS,
    DecisionLog,
    replay,
)
from dva_sim.kernel.errors import ConfigError
from dva_sim.protocol import messages as m
from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.full.run import Run
from dva_sim.simulation.full.stage import DVA, id_of

PHONE = id_of("operator", 1)
LATER = {"events": [{"kind": "fire", "at_s": 500}], "horizon_s": 600}


def differences(path: Path) -> int:
    """Number of a trace's decisions that a fresh controller makes differently."""
    return sum(then != now for _, then, now in replay(path))


def kinds(path: Path) -> Counter[str]:
    return Counter(type(message.body).__name__ for message, _, _ in replay(path))


@contextmanager
def traced(path: Path, **changes: object) -> Iterator[Run]:
    """A virtual run, everybody in place, whose robot keeps a trace."""
    scenario = scenarios.build(scenarios.load("drive-to-event"), changes)
    run = Run(scenario, 1)
    robot = run.field.robots[ROBOT]
    robot.trace = DecisionLog(path, robot.controller)
    yield run
    robot.trace.close()


def say(run: Run, body: m.Body, session: int) -> None:
    """Let the DVA say something to the robot, which its book says, too."""
    enter(run.dva.core, ROBOT, body)
    run.dva.device.ask(ROBOT, body, session=session)


def lines(path: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in path.read_text().splitlines()]


def change(path: Path, number: int, how: Callable[[dict[str, Any]], object]) -> None:
    """Change a line of a trace by hand."""
    entries = lines(path)
    how(entries[number])
    path.write_text("".join(json.dumps(entry) + "\n" for entry in entries))


@pytest.fixture
def drive(tmp_path: Path) -> Path:
    """A short trace: a grant, confirmed; a start, three commands, an emergency, one refused."""
    path = tmp_path / "robot-1.trace.jsonl"
    controller = RobotController(ROBOT, DVA, Limits(watchdog=1.0, max_age=2.0))
    trace = DecisionLog(path, controller)
    reports: list[tuple[str, m.Body]] = [
        (DVA, grant := m.PermissionGrant(PHONE, "teleoperation", 7)),
        (DVA, confirmation(grant)),
        (PHONE, m.StartTeleOp()),
        (PHONE, m.SetTeleOp(0.1, 0.0, 1000)),
        (PHONE, m.SetTeleOp(0.2, 0.1, 1100)),
        (PHONE, m.SetTeleOp(0.3, 0.2, None)),
        (PHONE, m.Emergency()),
        (PHONE, m.SetTeleOp(0.4, 0.0, 1300)),
    ]
    for number, (source, body) in enumerate(reports, 1):
        message = m.Message(ROBOT, number, source, "12:00:00", 7, body)
        now = 1.0 + number / 10
        if isinstance(body, m.Reply):
            trace.happened(ASKS, now)
            controller.inquiry.next(now)
        trace.decided(message, now, now, False, controller.handle(message, now, now, False))
    trace.close()
    return path


# --- the same again ------------------------------------------------------------------------


@pytest.mark.system
def test_a_trace_taken_over_sockets_is_decided_the_same_again(tmp_path):
    path = tmp_path / "robot-1.trace.jsonl"
    decisions = over_sockets(pipelined, trace=path)
    replayed = list(replay(path))
    reports = [now for message, _, now in replayed if not isinstance(message.body, m.Reply)]
    assert [(d.code, d.text) for d in decisions] == [(now.code, now.text) for now in reports]
    assert kinds(path)["SetTeleOp"] == 200 + 1 + 10
    assert differences(path) == 0


@pytest.mark.parametrize("pattern", ["req-rep", "pub-sub", "latest-wins"])
def test_a_simulated_operators_drive_is_decided_the_same_again(tmp_path, pattern):
    link = {"delay_s": 0.2, "jitter_s": 0.1, "loss": 0.1}
    path = tmp_path / "robot-1.trace.jsonl"
    with traced(path, pattern=pattern, link=link, horizon_s=120) as run:
        drives = run.run().recorder.drives
    assert 100 < kinds(path)["SetTeleOp"] <= sum(drive.sent for drive in drives)
    assert differences(path) == 0


def test_missions_emergencies_and_leases_that_end_are_decided_the_same_again(tmp_path):
    path = tmp_path / "robot-1.trace.jsonl"
    with traced(path, **LATER) as run:
        _mission_lease_and_emergency(run)
    happened = [entry["happened"] for entry in lines(path) if "happened" in entry]
    assert [what for what in happened if what != ASKS] == [MISSION_ENDS, LEASE_ENDS]
    codes = {then.code for _, then, _ in replay(path)}
    assert {m.OK, m.BUSY, m.BAD_SESSION, m.WRONG_MODE} <= codes
    assert differences(path) == 0


def _mission_lease_and_emergency(run: Run) -> None:
    def send(time: float, body: m.Body, session: int = 5) -> None:
        run.clock.call_at(time, say, run, body, session)

    place = m.Position(*run.stage.site.frame.to_latlon(12.0, 12.0))
    send(10.0, m.PermissionGrant(DVA, "both", 5))
    send(11.0, m.GoTo((place,)))
    send(12.0, m.GoTo((place,)))  # refused: busy
    send(60.0, m.StartTeleOp())
    for tenths in range(20):
        send(61.0 + tenths / 10, m.SetTeleOp(0.2, 0.1))
    send(61.5, m.SetTeleOp(0.2, 0.1), session=4)  # refused: not the session
    send(63.0 + LEASE_S + 5.0, m.SetTeleOp(0.2, 0.1))  # refused: idle by then
    send(110.0, m.GoTo((place,)))
    send(111.0, m.Emergency(), session=0)
    send(120.0, m.StartTeleOp())
    send(125.0, m.PermissionRevocation(DVA, DVA, 5))
    run.clock.run(130.0)


def test_reply_contents_are_not_kept_but_what_leads_to_them_is(tmp_path):
    path = tmp_path / "robot-1.trace.jsonl"
    grant = m.PermissionGrant(DVA, "both", 5, sensors=("heat_flux",))
    reported = ((10.0, grant), (11.0, m.GetSensorInfo()), (12.0, m.DevSub("heat_flux", 1)))
    with traced(path, **LATER) as run:
        for time, body in reported:
            run.clock.call_at(time, say, run, body, 5)
        run.clock.run(20.0)
    assert kinds(path) == {"PermissionGrant": 1, "Reply": 1, "GetSensorInfo": 1, "DevSub": 1}
    assert {then.code for _, then, _ in replay(path)} == {m.OK}
    assert differences(path) == 0


def test_what_was_decided_is_on_disk_at_once(drive):
    """A robot that is switched off in the middle leaves what it has decided until then."""
    controller = RobotController(ROBOT, DVA, Limits(1.0, 2.0))
    path = drive.with_name("other.jsonl")
    trace = DecisionLog(path, controller)
    message = m.Message(ROBOT, 1, PHONE, "12:00:00", 7, m.Emergency())
    trace.decided(message, 1.0, 1.0, False, controller.handle(message, 1.0, 1.0, False))
    assert kinds(path) == {"Emergency": 1}
    trace.close()


# --- changed by hand -----------------------------------------------------------------------


def test_the_trace_as_it_was_taken_shows_no_difference(drive):
    assert sum(kinds(drive).values()) == 8
    assert differences(drive) == 0


@pytest.mark.parametrize(
    ("number", "how", "found"),
    [
        (5, lambda e: e.update(code=m.STALE), 1),
        (5, lambda e: e.update(text="faster"), 1),
        (5, lambda e: e["set_point"].__setitem__(0, 0.5), 1),
        (5, lambda e: e["set_point"].__setitem__(2, 9.0), 1),
        (9, lambda e: e.update(code=m.OK, text="", set_point=[0.4, 0.0, 3.0]), 1),
        (6, lambda e: e.update(message=e["message"].replace("0.2<", "0.25<")), 1),
        (6, lambda e: e.update(arrived=1.2), 1),
        (4, lambda e: e.update(moving=True), 4),  # no start, so three commands are refused, too
        (0, lambda e: e["limits"].update(watchdog=0.5), 3),
    ],
)
def test_a_trace_changed_by_hand_is_found_out(drive, number, how, found):
    change(drive, number, how)
    assert differences(drive) == found


def test_a_line_taken_out_is_found_out(drive):
    whole = drive.read_text().splitlines(keepends=True)
    drive.write_text("".join(whole[:4] + whole[5:]))  # without the start
    assert differences(drive) == 3


# --- no trace ------------------------------------------------------------------------------


def is_reported_at(path: Path, number: int) -> bool:
    """True if a trace is refused in one line that names it and a line number."""
    with pytest.raises(ConfigError) as error:
        list(replay(path))
    return str(error.value).startswith(f"{path}:{number}: ") and "\n" not in str(error.value)


@pytest.mark.parametrize("kept", [1, 100, 500, -1, -2, -20])
def test_a_trace_that_ends_in_the_middle_of_a_line_ends_in_one_line(drive, kept):
    data = drive.read_text().rstrip("\n")
    drive.write_text(data[:kept])
    assert is_reported_at(drive, data[:kept].count("\n") + 1)


FOREIGN_LINES = [
    *("5", '"happened"', "{}", '{"happened": "lunch", "now": 1}', '{"happened": "lease ends"}'),
    *('{"message": 5}', '{"message": "<msg/>"}', '{"message": "\\ud800"}'),
]
WRONG = [("arrived", "soon"), ("now", None), ("set_point", [1]), ("set_point", 5)]
WRONG += [("code", "fine"), ("moving", "no"), ("text", 5)]


@pytest.mark.parametrize("line", [*FOREIGN_LINES, *({key: value} for key, value in WRONG)], ids=str)
def test_a_foreign_line_and_a_value_of_another_type_are_told_by_their_number(drive, line):
    whole = drive.read_text().splitlines()
    whole[3] = line if isinstance(line, str) else json.dumps(json.loads(whole[3]) | line)
    drive.write_text("\n".join(whole))
    assert is_reported_at(drive, 4)
