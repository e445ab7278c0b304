"""Warnings name what a command opens to a network without keys or tokens, and nothing else."""

import pytest
from helpers.processes.command_line import call
from helpers.wording import unnamed

from dva_sim.cli import exposure, live_screen
from dva_sim.console.remote import supervisor as attached
from dva_sim.console.simulator.robot_simulator import RobotSimulator
from dva_sim.console.supervisor import ConsoleSupervisor

FORGERS, TOKEN = "stop or drive the robots", "leave out --no-token"
LAN = "192.0.2.7"  # nobody has it (RFC 5737), and nothing is opened here


@pytest.fixture
def warnings_of(monkeypatch: pytest.MonkeyPatch) -> object:
    """Runs a command that would listen; its lines on stderr."""

    def nothing(*_: object, **__: object) -> None:
        return None

    for owner, name in (
        (live_screen, "run_all"),
        (live_screen, "run_one"),
        (ConsoleSupervisor, "run"),
        (RobotSimulator, "run"),
        (attached, "attach"),
    ):
        monkeypatch.setattr(owner, name, nothing)

    def run(command: str) -> list[str]:
        result = call(*command.split())
        assert result.returncode == 0, result.stderr
        return [line for line in result.stderr.splitlines() if line.startswith("warning:")]

    return run


ALL = "(every address"
DEVICES = [
    ("live drive-to-event --host 0.0.0.0", f"0.0.0.0 {ALL}"),
    ("live drive-to-event --host ::", f":: {ALL}"),
    (f"live drive-to-event --host {LAN}", LAN),
    (f"live drive-to-event --only dva --dva {LAN}:5600", LAN),
    (f"live drive-to-event --only dva --host {LAN} --port 5600", LAN),
    (f"live drive-to-event --only world --host {LAN}", LAN),
    (f"live drive-to-event --dva {LAN}:5600", LAN),
    (f"robot --host {LAN}", LAN),
]
PAGES = [
    (f"console --no-token --host {LAN}", LAN),
    ("console --no-token --host 0.0.0.0", f"0.0.0.0 {ALL}"),
    ("console --no-token --phones", f"0.0.0.0 {ALL}"),
    (f"robot --no-token --host {LAN} --keys keys", LAN),
    (f"console --dva 127.0.0.1:5600 --no-token --host {LAN}", LAN),
]


@pytest.mark.parametrize(
    ("command", "names"),
    [
        *[(command, [where, FORGERS, "--keys FOLDER"]) for command, where in DEVICES],
        (f"console --links real --host {LAN}", [LAN, FORGERS, "--host 127.0.0.1"]),
        *[(command, [where, TOKEN]) for command, where in PAGES],
    ],
)
def test_what_listens_beyond_this_machine_without_keys_or_a_token_is_said_in_a_line(
    warnings_of, command, names
):
    (line,) = warnings_of(command)
    assert unnamed(line, *names) == []


@pytest.mark.parametrize(
    "command",
    [
        "live drive-to-event",
        "live drive-to-event --host 127.0.0.1",
        "live drive-to-event --host localhost",
        "live drive-to-event --host ::1",
        f"live drive-to-event --host {LAN} --keys keys",
        "live drive-to-event --only dva",
        f"live drive-to-event --only world --dva {LAN}:5600",
        "console",
        f"console --host {LAN}",
        "console --no-token",
        "console --no-token --host 127.0.0.2",
        "console --links real",
        "console --phones",
        "console --dva 127.0.0.1:5600",
        "robot --no-token",
        f"robot --host {LAN} --keys keys",
    ],
)
def test_nothing_is_said_on_this_machine_or_with_keys_or_a_token(warnings_of, command):
    assert warnings_of(command) == []


def test_both_are_said_where_both_are_open(warnings_of):
    lines = warnings_of(f"console --links real --no-token --host {LAN}")
    assert [TOKEN in lines[0], FORGERS in lines[1]] == [True, True]


def test_an_address_of_which_nobody_knows_is_not_taken_for_this_machine(tmp_path):
    assert not exposure.is_local("no-such-host.invalid")
    assert exposure.is_local("[::1]")


@pytest.mark.parametrize(
    ("more", "is_open"),
    [("--camera-port 0", True), ("--camera-port 0 --only dva", False), ("", False)],
)
def test_pictures_beyond_this_machine_are_said_though_devices_have_keys(
    warnings_of, tmp_path, more, is_open
):
    found = warnings_of(f"live drive-to-event --host {LAN} --keys {tmp_path} {more}")
    assert [LAN in line and "leave out --camera-port" in line for line in found] == [True] * is_open
