"""A few runs of a study, and their digests: enough to tell whether the program still gives them.

The first person runs as many configurations of each part as cover every level of every factor.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from itertools import groupby
from typing import Any, NamedTuple

from dva_sim.experiments.execution.executors import LocalProcesses
from dva_sim.experiments.execution.scheduling import run_job
from dva_sim.experiments.study.cell_grid import StudyJob
from dva_sim.experiments.study.plan import StudyPlan
from dva_sim.experiments.study.study import Study

Digests = dict[str, str]
"""SHA-256 of all rows of a run's tables, by `CONFIG/SEED`."""


class SampledRun(NamedTuple):
    """Run whose digest is kept, to be compared with the same run of another version.

    Attributes:
        job: The run.
        digest: SHA-256 of all rows of its tables.
        row: Its row of the table `runs`.
    """

    job: StudyJob
    digest: str
    row: Mapping[str, Any]


def sampled_jobs(study: Study) -> Iterator[StudyJob]:
    """Yield a sample of the study's runs, part by part.

    A study whose runs are measured in real time has no sample.
    """
    plan = StudyPlan.of(study)
    if plan.is_real_time:
        return
    first = [job for job in plan.jobs if job.person == 0 and job.trial == 0]
    for _, group in groupby(first, key=lambda job: job.part):
        of_part = list(group)
        yield from (of_part[n] for n in _covering([{*job.levels.items()} for job in of_part]))


def _covering(cells: Sequence[set[tuple[str, Any]]]) -> list[int]:
    """Return the first cell and, one by one, those with the most levels that none before has."""
    chosen = [0]
    left = set().union(*cells) - cells[0]
    while left:
        chosen.append(max(range(len(cells)), key=lambda n: (len(cells[n] & left), -n)))
        left -= cells[chosen[-1]]
    return sorted(chosen)


def run_sampled(job: StudyJob) -> SampledRun:
    """Run one of the few."""
    tables = run_job(job)
    rows = json.dumps(tables, sort_keys=True, default=str).encode()
    return SampledRun(job, hashlib.sha256(rows).hexdigest(), next(iter(tables["runs"]), {}))


def sampled_runs(
    studies: Mapping[str, Study], processes: int
) -> Iterator[tuple[str, list[SampledRun]]]:
    """Yield the few runs of some studies by their names, in the order given, as they come.

    Args:
        studies: The studies.
        processes: Number of runs at a time.
    """
    with (
        LocalProcesses(processes) as workers,
        workers.executor(processes, run_sampled) as pool,
    ):
        samples = {
            name: pool.map(run_sampled, sampled_jobs(study)) for name, study in studies.items()
        }
        for name, runs in samples.items():
            yield name, list(runs)


def digests_of(runs: Sequence[SampledRun]) -> Digests:
    """Return the digest of each run, by `CONFIG/SEED`."""
    return {f"{run.job.config}/{run.job.seed}": run.digest for run in runs}
