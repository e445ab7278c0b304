"""Compare the results of two versions of the program, byte for byte.

    python tests/same_bytes.py                      print a line for each run of this version
    python tests/same_bytes.py --against COMMIT     run that version as well; exit 1 if they differ

Of every shipped study the first, the middle and the last configuration of each part are run, and
two runs are written as recordings. Each version runs its own copy of this file, so COMMIT must
have one; `make same-bytes AGAINST=COMMIT` does this with the environment of the project.
"""

import argparse
import hashlib
import os
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

from helpers.paths import ROOT
from helpers.processes.other_version import end_with_signals, output, version

import dva_sim
from dva_sim.experiments.execution.sampled_runs import run_sampled, sampled_jobs
from dva_sim.experiments.study.loading import load_study

RECORDED = ("drive-to-event", "fire-drill")


def line_of_run(name, job):
    """One line: which run, its configuration and seed, and the hash of all rows of its tables."""
    where = f"{name} {job.address}: config {job.config}, seed {job.seed}"
    return f"{where}, tables {run_sampled(job).digest}"


def digest_of_recording(name):
    """One line: the hash of a scenario's recording."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "run.mcap"
        dva_sim.episode(name, seed=1, record=file)
        return f"{name}: recording {hashlib.sha256(file.read_bytes()).hexdigest()}"


def digests():
    """All lines, as they are made."""
    with ProcessPoolExecutor(mp_context=get_context("forkserver")) as pool:
        reports = [pool.submit(digest_of_recording, name) for name in RECORDED]
        for file in sorted((ROOT / "experiments").glob("*.yaml")):
            if file.name.endswith(".registration.yaml"):
                continue
            reports += [
                pool.submit(line_of_run, file.stem, job) for job in sampled_jobs(load_study(file))
            ]
        for line in reports:
            yield line.result()


def lines_of(root):
    """The lines that the version in a folder prints."""
    environment = os.environ | {"PYTHONPATH": str(root), "PYTHONHASHSEED": "0"}
    program = [sys.executable, str(root / "tests/same_bytes.py")]
    return output(program, env=environment, cwd=root).splitlines()


def compare(commit):
    """Tell every line that differs; the exit code."""
    with version(commit) as other:
        theirs, ours = lines_of(other), lines_of(ROOT)
    found = {line.partition(": ")[2] for line in ours}  # whatever they are called
    different = [line for line in theirs if line.partition(": ")[2] not in found]
    for line in different:
        print(f"not the same as in {commit}: {line.split(':')[0]}")
    print(f"{len(theirs) - len(different)} of {len(theirs)} runs have the same bytes in {commit}")
    return 1 if different or not theirs else 0


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--against", metavar="COMMIT")
    asked = parser.parse_args()
    end_with_signals()
    if asked.against:
        sys.exit(compare(asked.against))
    for line in digests():
        print(line, flush=True)
