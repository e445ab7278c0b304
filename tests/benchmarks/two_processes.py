"""Speed-up of a study by more workers. Overhead per run: growth.py."""

from __future__ import annotations

import math
import os
import time
from pathlib import Path

import pytest
from benchmarks.goals import goal
from helpers.studies import small_study as kit
from helpers.studies.small_study import run_study

from dva_sim.experiments.execution import executors

STAT = Path("/proc/stat")


def load() -> str:
    return f"load {os.getloadavg()[0]:.1f} on {executors.cores()} cores"


def cpu_used_s() -> float:
    """CPU time that all programs of this machine have used so far, where the system tells [s]."""
    if not STAT.exists():
        return math.nan
    user, nice, system, _idle, _waits, *interrupts = STAT.read_text().split("\n")[0].split()[1:8]
    return sum(map(int, (user, nice, system, *interrupts))) / os.sysconf("SC_CLK_TCK")


def two_processes(folder: Path) -> None:
    """By the wall clock, so it is judged only if the cores had little else to do meanwhile.

    What else they did is all CPU time that the machine has spent but for that of the runs
    themselves, so the start of the processes and the parent's work are in it, too.
    """
    if executors.cores() < 2:
        pytest.skip("needs two cores")
    study, took, beside = kit.study_in(folder, "persons=30"), {}, {}
    for jobs in (1, 2):
        begun, used = time.perf_counter(), cpu_used_s()
        out = run_study(study, folder / f"{jobs}", jobs=jobs, episode=kit.busy)
        took[jobs], runs = time.perf_counter() - begun, len(kit.rows(out))
        others = cpu_used_s() - used - runs * kit.BUSY_S
        beside[jobs] = others / (took[jobs] * (os.cpu_count() or 1))
    ratio, is_idle = took[1] / took[2], max(beside.values()) < 0.1
    judged = "judged" if is_idle else "not judged: the cores were not idle"
    print(
        f"\ntwo processes: {ratio:.2f} times as fast as one, {judged} ({runs} runs of "
        f"{kit.BUSY_S} s of CPU: {took[1]:.1f} s, then {took[2]:.1f} s; {load()}; all else took "
        f"{100 * beside[1]:.0f} %, then {100 * beside[2]:.0f} % of {os.cpu_count()} cores)"
    )
    if is_idle:
        goal("two processes over one", ratio, least=1.7)
