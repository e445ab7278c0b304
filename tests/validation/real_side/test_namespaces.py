"""With real namespaces, devices and packets, where they are allowed."""

import os
import signal
import socket
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from typing import IO

import pytest
from helpers.network.emulated_link import all_end, need_link, networks, wait_for_children
from helpers.processes.patience import becomes
from helpers.wording import unnamed

from dva_sim.network.emulator.needs import EmulatorError
from dva_sim.network.pattern_runs import Condition
from dva_sim.validation.network.real_side import cell
from dva_sim.validation.network.real_side.cell import (
    EmulatedJob,
    EmulatedOutcome,
    run_job,
    start_job,
    why_no_packets,
)
from dva_sim.validation.network.real_side.measuring import COLUMNS, make_job, measure
from dva_sim.validation.network.real_side.self_check import PROBES, Crossing, find_bursts, find_loss

pytestmark = pytest.mark.system

LONG = Condition("pub", 10, dur_s=600)
WAITING = """
from dva_sim.validation.network.real_side.measuring import measure
from dva_sim.network.pattern_runs import Condition
measure(Condition("pub", 10, dur_s=600), 1)
"""


@dataclass
class Run:
    """A run of ten minutes that nobody waits for."""

    process: subprocess.Popen[bytes]
    out: IO[bytes]

    @property
    def pid(self) -> int:
        return self.process.pid

    def leave(self) -> None:
        assert self.process.stdin is not None
        self.process.stdin.close()


@pytest.fixture
def run() -> Iterator[Run]:
    need_link()
    with tempfile.TemporaryFile() as out:
        run = Run(start_job(make_job(LONG, 1), out, out), out)
        yield run
        run.process.kill()
        run.process.wait()
        run.leave()


@pytest.mark.parametrize("rootless", [False, True], ids=["root or not", "user namespace"])
def test_real_packets_are_lost_as_told(rootless):
    need_link(rootless)
    loss, bursts = (PROBES[2], find_loss), (PROBES[3], find_bursts)
    for probe, find in (loss,) if rootless else (loss, bursts):
        outcome = run_job(probe.job(rootless))
        crossing = Crossing.of(probe, outcome)
        assert outcome.link["emu_lost_ab"] == crossing.lost.sum()
        assert [str(finding) for finding in find(crossing) if not finding.passed] == []


def test_no_real_packet_is_early_or_faster_than_the_line():
    """It may be late on a busy machine: how late is what the link's own check asks."""
    need_link()
    delay, rate = PROBES[0], PROBES[-1]
    crossing = Crossing.of(delay, run_job(delay.job(False)))
    assert len(crossing.numbers) == delay.count
    assert crossing.delays.min() >= 0.05
    queued = Crossing.of(rate, run_job(rate.job(False)))
    assert queued.delays[-1] >= rate.count * (8e-3 - rate.interval_s) - 1e-3


def test_a_condition_is_measured_with_all_its_columns():
    """A hundred milliseconds away and five of service: a command is at least 105 old."""
    need_link()
    condition = Condition("req", 10, timeout_ms=2500, attempts=3, delay_ms=100, dur_s=2)
    row = measure(condition, 1)
    assert tuple(row) == COLUMNS
    assert Condition.from_row(row) == condition
    assert float(row["age_p50"]) >= 105
    assert float(row["rtt_p50"]) >= 205
    assert float(row["t_hs_ms"]) >= 600
    assert (row["first_seq"], row["dup"], row["timeouts"], row["alerts"]) == ("0", "0", "0", "0")


def test_a_publisher_that_does_not_wait_loses_its_first_commands():
    """Four round trips of 0.2 s at 50 a second: the first forty and one at least."""
    need_link()
    row = measure(Condition("pub", 50, delay_ms=100, wait_hs=False, warm_s=0, dur_s=2), 1)
    assert int(row["first_seq"]) >= 4 * 0.2 * 50
    assert row["t_hs_ms"] == row["rtt_p50"] == row["timeouts"] == ""


def test_a_dealer_hears_replies_while_it_sends():
    need_link()
    row = measure(Condition("dealer", 50, delay_ms=50, dur_s=1), 1)
    assert float(row["rtt_p50"]) >= 105
    assert int(row["n_sent"]) == 50


def test_a_robot_that_is_too_slow_makes_requests_time_out_and_commands_repeat():
    """300 ms of service, 100 ms of patience, two attempts: alerts, and nothing else."""
    need_link()
    condition = Condition("req", 10, 300, 100, 2, warm_s=0, dur_s=2)
    row = measure(condition, 1)
    assert int(row["timeouts"]) >= 2 * int(row["alerts"]) > 0
    assert row["rtt_p50"] == ""
    assert int(row["dup"]) > 0


def test_each_end_has_a_network_of_its_own_and_this_one_is_not_touched(run):
    devices = socket.if_nameindex()
    ends = wait_for_children(run.pid, 2)
    assert becomes(lambda: len(networks(os.getpid(), run.pid, *ends)) == 4)
    assert socket.if_nameindex() == devices


def test_a_killed_forwarder_leaves_nothing(run):
    ends = [os.pidfd_open(pid) for pid in wait_for_children(run.pid, 2)]
    run.process.kill()
    assert all_end(ends)


def test_a_killed_parent_leaves_nothing():
    need_link()
    parent = subprocess.Popen([sys.executable, "-c", WAITING], stderr=subprocess.DEVNULL)
    try:
        (leader,) = wait_for_children(parent.pid, 1)
        ends = wait_for_children(leader, 2)
        handles = [os.pidfd_open(pid) for pid in (leader, *ends)]
    finally:
        parent.kill()
        parent.wait()
    assert all_end(handles)


def test_a_run_ends_when_nobody_waits_for_it(run):
    ends = [os.pidfd_open(pid) for pid in wait_for_children(run.pid, 2)]
    run.leave()
    assert all_end([os.pidfd_open(run.pid), *ends])


def test_a_killed_robot_ends_the_run_and_is_named(run):
    operator, robot = wait_for_children(run.pid, 2)
    assert becomes(lambda: len(networks(run.pid, operator, robot)) == 3)
    handles = [os.pidfd_open(pid) for pid in (run.pid, operator)]
    os.kill(robot, signal.SIGKILL)
    assert all_end(handles)
    run.out.seek(0)
    assert EmulatedOutcome.from_json(run.out.read().decode()).problem.startswith("the robot")


def test_a_run_that_takes_too_long_is_ended():
    need_link()
    job = make_job(LONG, 1)
    short = EmulatedJob("commands", bound_s=0.1, arguments=job.arguments)
    with pytest.raises(EmulatorError, match=r"within 0\.1 s"):
        run_job(short)


def test_a_congestion_control_that_the_kernel_does_not_have_is_told_in_one_line():
    need_link()
    with pytest.raises(EmulatorError, match="'none-such'") as error:
        run_job(EmulatedJob("nothing", congestion="none-such"))
    assert "\n" not in str(error.value)


def test_where_packets_can_be_emulated_nothing_is_missing():
    need_link()
    assert why_no_packets() == ""


def test_where_devices_are_forbidden_one_line_says_what_is_needed(monkeypatch):
    def refuse(job: EmulatedJob) -> None:
        raise EmulatorError("a user namespace is refused: Operation not permitted")

    monkeypatch.setattr(cell, "run_job", refuse)
    reported = why_no_packets()
    assert not unnamed(reported, "Linux", "/dev/net/tun", "Operation not permitted")
