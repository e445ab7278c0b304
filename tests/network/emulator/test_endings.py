"""Whatever ends `dva-sim link`, nothing that either command has started is left behind."""

import os
import signal
from collections.abc import Callable

import pytest
from helpers.network.emulated_link import children
from helpers.processes.programs import Program, Programs, wait_until

pytestmark = pytest.mark.system

DAEMON = "(trap '' TERM INT HUP; setsid sleep 1000 & setsid sleep 1000 &); "
STUBBORN = "trap '' TERM INT HUP; while :; do sleep 0.05; done"
SLEEPERS = 4  # of the daemons of both commands


def begun(programs: Programs, near: str, far: str = "exec sleep 998") -> Program:
    """A program whose two commands run, with all that they have started."""
    program = programs.start("link", "--near", DAEMON + near, "--far", DAEMON + far)
    wait_until(lambda: commands(programs).count("sleep 1000") == SLEEPERS, "both commands run")
    return program


def commands(programs: Programs) -> list[str]:
    return [command.strip() for command in programs.processes().values()]


def interrupt(program: Program) -> None:
    program.send(signal.SIGINT)


def terminate(program: Program) -> None:
    program.send(signal.SIGTERM)


@pytest.mark.parametrize(
    ("end", "far", "code"),
    [(interrupt, "exec sleep 998", 130), (terminate, STUBBORN, 143)],
    ids=["Ctrl-C", "SIGTERM, which the far one ignores"],
)
def test_a_signal_ends_both_commands_and_their_daemons(
    programs, end: Callable[[Program], None], far: str, code: int
):
    program = begun(programs, "exec sleep 999", far)
    end(program)
    assert program.ends() == code
    assert commands(programs) == []


def test_the_near_command_may_tidy_up_after_a_signal(programs):
    program = begun(programs, "trap 'echo tidy; exit 5' INT; while :; do sleep 0.05; done")
    interrupt(program)
    assert program.ends() == 5
    assert program.said == "tidy\n"
    assert commands(programs) == []


def test_a_second_signal_waits_for_nobody(programs):
    program = begun(programs, STUBBORN, STUBBORN)
    interrupt(program)
    program.send(signal.SIGTERM)
    assert program.ends() == 137
    assert commands(programs) == []


def test_the_end_of_the_near_command_ends_the_far_one(programs):
    far = "trap 'echo ended; exit' TERM; while :; do sleep 0.05; done"
    program = begun(programs, "sleep 0.5; exit 3", far)
    assert program.ends() == 3
    assert program.said == "ended\n"
    assert commands(programs) == []


def test_a_killed_program_leaves_nothing(programs):
    program = begun(programs, STUBBORN, STUBBORN)
    program.send(signal.SIGKILL)
    programs.wait_for_none()


def test_a_killed_emulator_ends_both_commands_and_is_named(programs):
    program = begun(programs, "exec sleep 999")
    starts = next(p for p, command in programs.processes().items() if "emulator.start" in command)
    os.kill(starts, signal.SIGKILL)
    assert program.ends() == 3
    assert "the emulated link has ended by itself" in program.complained[-1]
    assert commands(programs) == []


def test_a_command_that_cannot_start_is_told_with_its_exit_code(programs):
    program = programs.start("link", "--near", "sleep 0.5", "--far", "no-such-command")
    assert program.ends() == 0
    assert "the far command has ended with exit code 127" in program.complained
    assert programs.start("link", "--near", "no-such-command", "--far", DAEMON).ends() == 127
    assert commands(programs) == []
    assert children(program.process.pid) == []
