"""What the runner costs beside its runs, what it keeps in memory, and how soon help is there.

CPU time where it can be, since other programs do not add to it; where only the wall clock tells,
the load of the machine is said beside the figure.
"""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest
from benchmarks.goals import goal
from helpers.paths import PYTHON_PATH
from helpers.studies import small_study as kit

from dva_sim.experiments.execution import executors
from dva_sim.experiments.execution.runner import run_study

STAT = Path("/proc/stat")
ENVIRONMENT = {**os.environ, "PYTHONPATH": PYTHON_PATH}
MEMORY = """
import json, re, sys
from pathlib import Path
from helpers.studies import small_study as kit
folder, jobs, total = Path(sys.argv[1]), int(sys.argv[2]), []
def peak():
    return int(re.search(r"VmHWM:\\s+(\\d+)", Path("/proc/self/status").read_text())[1]) / 1024
study, before = kit.study_in(folder, "persons=230", "replications=8"), peak()
seen = lambda done, runs: total.append(runs)
kit.run_study(study, folder / "out", jobs=jobs, episode=kit.cheap, progress=seen)
print(json.dumps([total[-1], before, peak()]))
"""


def load() -> str:
    return f"load {os.getloadavg()[0]:.1f} on {executors.cores()} cores"


def test_the_runner_costs_little_beside_runs_of_a_tenth_of_a_second(tmp_path, benchmark):
    """Everything from the design to the manifest, in one process."""
    study = kit.study_in(tmp_path, "persons=20")  # 280 runs
    begun = time.process_time()
    out = run_study(study, tmp_path / "out", jobs=1, episode=kit.busy)
    whole = time.process_time() - begun
    runs = len(kit.rows(out))
    overhead = whole / (runs * kit.BUSY_S) - 1
    benchmark.extra_info.update(overhead_percent=round(100 * overhead, 2), runs=runs)
    print(f"\nrunner: {100 * overhead:.1f} % over {runs} runs of {kit.BUSY_S} s")
    goal("share of the runner", overhead, most=0.05)
    benchmark(lambda: None)


def test_handing_runs_to_processes_costs_the_parent_little(tmp_path, benchmark):
    study = kit.study_in(tmp_path, "persons=20")
    begun = time.process_time()
    out = run_study(study, tmp_path / "out", jobs=2, episode=kit.busy)
    own = time.process_time() - begun
    share = own / (len(kit.rows(out)) * kit.BUSY_S)
    benchmark.extra_info.update(parent_percent=round(100 * share, 2))
    print(f"\nparent of two processes: {100 * share:.1f} % of the runs' own time")
    goal("share of the parent", share, most=0.05)
    benchmark(lambda: None)


def cpu_used_s() -> float:
    """CPU time that all programs of this machine have used so far, where the system tells [s]."""
    if not STAT.exists():
        return math.nan
    user, nice, system, _idle, _waits, *interrupts = STAT.read_text().split("\n")[0].split()[1:8]
    return sum(map(int, (user, nice, system, *interrupts))) / os.sysconf("SC_CLK_TCK")


def test_two_processes_are_nearly_twice_as_fast_as_one(tmp_path, benchmark):
    """By the wall clock, so it is judged only if the cores had little else to do meanwhile.

    What else they did is all CPU time that the machine has spent but for that of the runs
    themselves, so the start of the processes and the parent's work are in it, too.
    """
    if executors.cores() < 2:
        pytest.skip("needs two cores")
    study, took, beside = kit.study_in(tmp_path, "persons=30"), {}, {}
    for jobs in (1, 2):
        begun, used = time.perf_counter(), cpu_used_s()
        out = run_study(study, tmp_path / f"{jobs}", jobs=jobs, episode=kit.busy)
        took[jobs], runs = time.perf_counter() - begun, len(kit.rows(out))
        others = cpu_used_s() - used - runs * kit.BUSY_S
        beside[jobs] = others / (took[jobs] * (os.cpu_count() or 1))
    ratio, is_idle = took[1] / took[2], max(beside.values()) < 0.1
    judged = "judged" if is_idle else "not judged: the cores were not idle"
    benchmark.extra_info.update(two_over_one=round(ratio, 2), is_idle=is_idle, machine=load())
    print(
        f"\ntwo processes: {ratio:.2f} times as fast as one, {judged} ({runs} runs of "
        f"{kit.BUSY_S} s of CPU: {took[1]:.1f} s, then {took[2]:.1f} s; all else took "
        f"{100 * beside[1]:.0f} %, then {100 * beside[2]:.0f} % of {os.cpu_count()} cores)"
    )
    if is_idle:
        goal("two processes over one", ratio, least=1.7)
    benchmark(lambda: None)


@pytest.mark.parametrize("jobs", [1, 2])
def test_ten_thousand_short_runs_fit_in_little_memory(tmp_path, benchmark, jobs):
    if not Path("/proc/self/status").exists():
        pytest.skip("this system does not tell the most memory a process has had")
    words = [sys.executable, "-c", MEMORY, str(tmp_path), str(jobs)]
    ran = subprocess.run(words, capture_output=True, text=True, env=ENVIRONMENT, check=True)
    total, before, after = json.loads(ran.stdout)
    benchmark.extra_info.update(parent_mb=round(after))
    print(f"\n{total} runs, {jobs} processes: parent {after:.0f} MB, {before:.0f} MB before")
    assert total > 10_000
    goal("MB of the parent", after, most=500)
    benchmark(lambda: None)
