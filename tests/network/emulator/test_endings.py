"""Whatever ends `dva-sim link`, nothing that either command has started is left behind."""

import os
import signal
import socket
import subprocess

import pytest
from helpers.network.emulated_link import children, need_link
from helpers.processes.programs import Program, Programs, wait_until
from helpers.wording import unnamed

from dva_sim.network.emulator import pair
from dva_sim.network.emulator.process import LinkProcess
from dva_sim.network.link import LinkConfig

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


def test_sigterm_ends_both_commands_and_their_daemons(programs):
    program = begun(programs, "exec sleep 999")
    program.send(signal.SIGTERM)
    assert program.ends() == 143
    assert commands(programs) == []


def test_a_far_command_that_ignores_signals_is_killed_after_a_while(monkeypatch):
    need_link()
    monkeypatch.setattr(pair, "GRACE_S", 0.2)
    with LinkProcess(LinkConfig(), 1) as link:
        before = children(os.getpid())
        assert pair.run_pair(link, "sleep 0.3; exit 3", DAEMON + STUBBORN, print).code == 3
        assert set(children(os.getpid())) <= set(before)


def test_afterwards_signals_are_for_those_who_heard_them_before():
    need_link()
    reads, writes = socket.socketpair()
    with reads, writes, LinkProcess(LinkConfig(), 1) as link:
        writes.setblocking(False)
        heard, woken = signal.getsignal(signal.SIGTERM), signal.set_wakeup_fd(writes.fileno())
        try:
            pair.run_pair(link, "true", "true", print)
        finally:
            left = signal.set_wakeup_fd(woken)
        assert left == writes.fileno()
        assert signal.getsignal(signal.SIGTERM) is heard


def test_a_command_sees_its_own_processes_alone():
    need_link()
    if subprocess.run(["unshare", "-Urpf", "--mount-proc", "true"], check=False).returncode:
        pytest.skip("/proc cannot be mounted here")
    own = 'test "$(cat /proc/$$/comm)" = sh && test "$(readlink /proc/self)" -lt 100'
    with LinkProcess(LinkConfig(), 1) as link:
        assert pair.run_pair(link, own, "true", print).code == 0


def test_ctrl_c_lets_the_near_command_tidy_up(programs):
    program = begun(programs, "trap 'echo tidy; exit 5' INT; while :; do sleep 0.05; done")
    program.send(signal.SIGINT)
    assert program.ends() == 5
    assert program.output == "tidy\n"
    assert commands(programs) == []


def test_a_second_signal_waits_for_nobody(programs):
    program = begun(programs, STUBBORN, STUBBORN)
    program.send(signal.SIGINT)
    program.send(signal.SIGTERM)
    assert program.ends() == 137
    assert commands(programs) == []


def test_the_end_of_the_near_command_ends_the_far_one(programs):
    far = "trap 'echo ended; exit' TERM; while :; do sleep 0.05; done"
    program = begun(programs, "sleep 0.5; exit 3", far)
    assert program.ends() == 3
    assert program.output == "ended\n"
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
    assert "emulated link" in program.complained[-1]
    assert commands(programs) == []


def test_commands_that_cannot_start_are_told_with_their_exit_codes(programs):
    near = f"{DAEMON} sleep 0.3; no-such-command"
    program = programs.start("link", "--near", near, "--far", "no-such-command")
    assert program.ends() == 127
    assert any(not unnamed(line, "far", "127") for line in program.complained)
    assert commands(programs) == []
