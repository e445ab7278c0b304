"""Programs that start processes name a crash in one line, end in good order, leave nothing."""

import os
import signal
from dataclasses import dataclass

import pytest
from helpers.network.emulated_link import need_link
from helpers.processes.programs import Program, Programs, wait_until
from helpers.wording import unnamed

pytestmark = pytest.mark.system

LIVE = ("live", "drive-to-event", "--operators", "scripted")
CONSOLE = ("console", "--no-open", "--no-token", "--port", "0")
SIGNALS = {signal.SIGINT, signal.SIGTERM, signal.SIGHUP}


@dataclass(frozen=True)
class User:
    """A program that starts processes.

    Attributes:
        words: Its command line.
        processes: Words of the command lines of those that it starts; the first one is killed.
        name: Name of that one in the line that tells of its end.
        asked: Exit code after a signal has asked for the end; None: 128 and the signal.
    """

    words: tuple[str, ...]
    processes: tuple[str, ...]
    name: str
    asked: int | None = 0


WEB, PICTURES = "dva_sim.console.web", "dva_sim.console.pages.pictures"
EMULATOR = "emulator.start"
USERS = {
    "live": User(LIVE, ('"part": "world"', '"part": "dva"', '"part": "operator"'), "world"),
    "live over a link": User(
        (*LIVE, "--link", "delay_s=0.05"), (EMULATOR, '"part": "operator"'), "the emulated link"
    ),
    "console": User(CONSOLE, (WEB, PICTURES), "the web process"),
    "console over a link": User(
        (*CONSOLE, "--links", "real", "--link", "delay_s=0.05"),
        (EMULATOR, WEB, PICTURES, "emulator.crossing"),
        "the emulated link",
    ),
    "link": User(
        ("link", "--near", "exec sleep 999", "--far", "exec sleep 998"),
        (EMULATOR, "\nsleep 999", "\nsleep 998"),
        "the emulated link",
        None,
    ),
}


@pytest.fixture(params=USERS)
def user(request) -> User:
    if EMULATOR in USERS[request.param].processes:
        need_link()
    return USERS[request.param]


def begun(programs: Programs, user: User) -> Program:
    """A program all of whose processes run and that hears signals."""
    program = programs.start(*user.words)

    def is_up() -> bool:
        commands = "\n".join(["", *programs.processes().values()])
        return not unnamed(commands, *user.processes)

    wait_until(is_up, "all its processes run")
    if user.words[0] != "link":
        program.wait_to_say(": ")
    return program


@pytest.mark.parametrize("number", sorted(SIGNALS))
def test_a_signal_ends_all_in_good_order(programs, user, number):
    program = begun(programs, user)
    program.send(number)
    assert program.ends() == (128 + number if user.asked is None else user.asked)
    assert [line for line in program.complained if "error" in line] == []
    assert programs.processes() == {}


def test_a_process_that_is_killed_ends_all_and_is_named_in_one_line(programs, user):
    program = begun(programs, user)
    killed = next(p for p, command in programs.processes().items() if user.processes[0] in command)
    os.kill(killed, signal.SIGKILL)
    assert program.ends() == 3
    line = f"error: {user.name} has ended by itself: killed by signal 9"
    assert [text for text in program.complained if text.startswith(line)] == [
        program.complained[-1]
    ]
    programs.wait_for_none()


def test_a_program_that_is_killed_leaves_nothing(programs, user):
    program = begun(programs, user)
    program.send(signal.SIGKILL)
    assert program.ends() == -signal.SIGKILL
    programs.wait_for_none()
