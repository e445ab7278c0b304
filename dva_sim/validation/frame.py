"""Jobs of all validations, spread over processes."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from contextlib import closing
from typing import Any, cast

from dva_sim.experiments.execution import executors
from dva_sim.experiments.execution.scheduling import run_all
from dva_sim.experiments.study.cell_grid import StudyJob
from dva_sim.kernel.errors import RunsFailed
from dva_sim.simulation.models import AnyScenario, Tables

Row = dict[str, Any]
Key = tuple[str, int]
Progress = Callable[[int], None]


def make_job(
    name: str, seed: int, scenario: object, *, person: int = 0, **asked: str | int
) -> StudyJob:
    """Return a job of a validation.

    Args:
        name: Name of the job, unique together with its seed.
        seed: Random seed.
        scenario: Scenario to run; a job without one has everything in `asked`.
        person: Person of the job.
        asked: Further input for the program of the job.
    """
    return StudyJob(
        part=name,
        cell=0,
        levels=asked,
        person=person,
        trial=0,
        seed=seed,
        config=name,
        scenario=cast(AnyScenario, scenario),
    )


def play_jobs(
    jobs: Sequence[StudyJob],
    program: Callable[[StudyJob], Tables],
    workers: int,
    failed: str,
    progress: Progress = lambda done: None,
    count: Callable[[list[Row]], int] = lambda rows: 1,
) -> dict[Key, list[Row]]:
    """Return the rows of each job by its key.

    Args:
        program: Plays one; all its rows are in a table `rows`.
        workers: Processes.
        failed: Message about a failed job, with a place for its name.
        progress: Callback with the progress.
        count: For how much the rows of a job count there.

    Raises:
        RunsFailed: one of them failed.
    """
    rows: dict[Key, list[Row]] = {}
    with executors.local(workers) as here, closing(run_all(jobs, program, here)) as batches:
        for batch in batches:
            for outcome in batch:
                if outcome.error is not None:
                    raise RunsFailed(f"{failed.format(outcome.key[0])}: {outcome.error}")
                rows[outcome.key] = json.loads(outcome.tables or "")["rows"]
            progress(sum(map(count, rows.values())))
    return rows
