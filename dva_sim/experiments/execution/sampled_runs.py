"""A few runs of a study, and their digests: enough to tell whether the program still gives them.

The first person runs as many configurations of each part as cover every level of every factor.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import Any, NamedTuple

from dva_sim.experiments.execution.scheduling import run_job
from dva_sim.experiments.study.cell_grid import StudyJob, cells, jobs
from dva_sim.experiments.study.plan import StudyPlan
from dva_sim.experiments.study.study import Study

Digests = dict[str, str]
"""SHA-256 of all rows of a run's tables, by `PART/INDEX/CONFIG/SEED`."""


def sampled_jobs(study: Study) -> Iterator[tuple[int, StudyJob]]:
    """The few runs, each with its place in its part.

    There are none of a study whose runs are measured in real time.
    """
    if StudyPlan.of(study).is_real_time:
        return
    first = [job for job in jobs(study, cells(study)) if job.person == 0 and job.trial == 0]
    for part in dict.fromkeys(job.part for job in first):
        of_part = [job for job in first if job.part == part]
        for index in _covering([set(job.cell) for job in of_part]):
            yield index, of_part[index]


def _covering(cells: Sequence[set[tuple[str, Any]]]) -> list[int]:
    """The first cell and, one by one, those with the most levels that none before has."""
    chosen = [0]
    left = set().union(*cells) - cells[0]
    while left:
        chosen.append(max(range(len(cells)), key=lambda n: (len(cells[n] & left), -n)))
        left -= cells[chosen[-1]]
    return sorted(chosen)


class SampledRun(NamedTuple):
    """One of the few runs.

    Attributes:
        digest: SHA-256 of all rows of its tables.
        row: Its row of the table `runs`.
    """

    digest: str
    row: Mapping[str, Any]


SampledRuns = dict[str, SampledRun]
"""Runs by `PART/INDEX/CONFIG/SEED`."""


def run_sampled(job: StudyJob) -> SampledRun:
    """Run one of the few."""
    tables = run_job(job)
    rows = json.dumps(tables, sort_keys=True, default=str).encode()
    return SampledRun(hashlib.sha256(rows).hexdigest(), next(iter(tables["runs"]), {}))


def sampled_runs(studies: Mapping[str, Study], processes: int) -> Iterator[tuple[str, SampledRuns]]:
    """The few runs of some studies by their names, in the order given, as they come.

    Args:
        studies: The studies.
        processes: Number of runs at a time.
    """
    with ProcessPoolExecutor(processes, mp_context=get_context("forkserver")) as pool:
        asked = {
            name: [
                (f"{job.part}/{index}/{job.config}/{job.seed}", pool.submit(run_sampled, job))
                for index, job in sampled_jobs(study)
            ]
            for name, study in studies.items()
        }
        for name, runs in asked.items():
            yield name, {key: run.result() for key, run in runs}
