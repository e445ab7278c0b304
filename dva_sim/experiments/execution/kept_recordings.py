"""Runs of a study that are kept as recordings: their choice, and their making.

A run is determined by its configuration and seed, so those chosen are simply run again after the
study. What is chosen hangs on the tables alone: not on processes, interruptions or their order.
"""

from __future__ import annotations

import errno
import math
import os
from collections.abc import Iterable, Mapping
from contextlib import closing, suppress
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any

from dva_sim.experiments.execution import executors, scheduling
from dva_sim.experiments.results.folder_lock import FolderLock
from dva_sim.experiments.results.results import Results
from dva_sim.experiments.results.tables import DESIGN_COLUMNS
from dva_sim.experiments.study.addresses import Address
from dva_sim.experiments.study.cell_grid import StudyJob
from dva_sim.experiments.study.hashing import stable_hash
from dva_sim.experiments.study.plan import Progress, StudyPlan
from dva_sim.experiments.study.study import Study
from dva_sim.kernel.errors import DvaSimError
from dva_sim.simulation.full import simulate
from dva_sim.simulation.labels import measure_called
from dva_sim.simulation.measures.episodes import tables_of
from dva_sim.simulation.models import Tables, model_for
from dva_sim.simulation.scenario import Scenario

FOLDER = "recordings"
_FULL = os.strerror(errno.ENOSPC)

Row = Mapping[str, Any]


def record_study(
    study: Study | StudyPlan,
    out: Path,
    *,
    jobs: int | None = None,
    progress: Progress = lambda *_: None,
    limit_s: float = scheduling.LIMIT_S,
) -> list[str]:
    """Make the recordings that a study asks for and its results folder does not hold yet.

    Args:
        study: A study, or its plan, with all its runs in the folder.
        out: Its results folder.
        jobs: Processes; by default one for each core.
        progress: Called with the number of recordings there are and of all.
        limit_s: A run that takes longer, by the wall clock, has failed.

    Returns:
        What went wrong, a line for each recording that could not be made; of a full disk one
        line for all of them.

    Raises:
        ConfigError: no results there.
        FolderInUse: another process writes into the folder.
        DvaSimError: the folder cannot be written.
        KeyboardInterrupt: after tidying up; its message says what has been done.
    """
    plan = StudyPlan.of(study)
    if plan.study.record is None:
        return []
    with FolderLock(out):
        rows = rows_of(Results.load(out))
        job_by_name = {name_of(job): job for job in chosen(plan, rows)}
        folder = _tidied(out / FOLDER, job_by_name)
        rest = [job for name, job in job_by_name.items() if not (folder / name).exists()]
        measures = {measure.about.name for measure in plan.measures.values()}
        prints = {name_of(job): _fingerprint(job, rows[job.address], measures) for job in rest}
        done = len(job_by_name) - len(rest)
        total = len(job_by_name)
        progress(done, total)
        problems = []
        rerun = Rerun(folder, prints)
        try:
            with (
                executors.local(jobs) as workers,
                closing(scheduling.run_all(rest, rerun, workers, limit_s)) as batches,
            ):
                for outcome in (outcome for batch in batches for outcome in batch):
                    done += outcome.error is None
                    problems += [] if outcome.error is None else [outcome.error]
                    progress(done, total)
                    if (outcome.error or "").endswith(_FULL):
                        made = f"{done} of {total} are made: free space, then again"
                        return [f"{outcome.error}; {made}"]
        except KeyboardInterrupt:
            raise KeyboardInterrupt(f"{done} of {total} recordings are made") from None
        return sorted(problems)


def chosen(plan: StudyPlan, rows: Mapping[Address, Row]) -> list[StudyJob]:
    """Return the runs to record, in the order of the design.

    Args:
        plan: Plan of a study that records all runs, the worst of each cell, or a sample of each.
        rows: The runs that were carried out and did not fail.
    """
    study = plan.study
    every = [
        job
        for job in plan.jobs
        if job.address in rows and not job.is_repeat and model_for(job.scenario).is_recorded
    ]
    if study.record == "all":
        return every
    in_cells = (list(group) for _, group in groupby(every, key=lambda job: job.address[:2]))
    if study.record == "sample" or study.answer is None:
        return [runs[0] for runs in in_cells]
    measure = study.answer.measure
    return [max(runs, key=lambda job: badness(measure, rows[job.address])) for runs in in_cells]


def name_of(job: StudyJob) -> str:
    """Return the name of a run's file."""
    return f"{job.address}.mcap"


def rows_of(results: Results) -> dict[Address, Row]:
    """Return the rows of the table of runs, by address."""
    return {Address.of(row): row for row in results.runs.to_rows()}


def badness(measure: str, row: Row) -> float:
    """Rank a run by a measure: larger is worse, a missing value worst."""
    value = row.get(measure)
    if value is None or math.isnan(value):
        return math.inf
    return -float(value) if measure_called(measure).better == "large" else float(value)


def _tidied(folder: Path, recordings: Iterable[str]) -> Path:
    """Return the folder, cleared of files of earlier choices and killed processes."""
    try:
        folder.mkdir(exist_ok=True)
        names = set(recordings)
        for path in folder.glob("*.mcap"):
            if path.name not in names:
                path.unlink()
        for path in folder.glob(".*.mcap.*"):
            if not _is_running(path.suffix[1:]):
                path.unlink(missing_ok=True)
    except OSError as error:
        raise DvaSimError(f"{folder} cannot be written: {error.strerror}") from None
    return folder


def _is_running(pid: str) -> bool:
    with suppress(ValueError, ProcessLookupError):
        os.kill(int(pid), 0)
        return True
    return False


@dataclass(frozen=True)
class Rerun:
    """An episode that is kept as a file, and has no tables of its own.

    Args:
        folder: Folder for the files.
        prints: Fingerprint of what each run came to in the study, by name of file.
    """

    folder: Path
    prints: Mapping[str, str]

    def __call__(self, job: StudyJob) -> Tables:
        """Run it again and keep it.

        Raises:
            DvaSimError: the file cannot be written, or the run is not what it was.
        """
        from dva_sim.recordings.writing import write_recording  # late: start-up

        assert isinstance(job.scenario, Scenario)
        name = name_of(job)
        run = simulate(job.scenario, job.seed, keep_traffic=True)
        tables = tables_of(run)
        if _print_of(tables["runs"][0]) != self.prints[name]:
            raise DvaSimError(f"{name}: the run is not what the study has: another version made it")
        write_recording(
            run,
            self.folder / name,
            tables=tables,
            about={
                "part": job.part,
                "cell": str(job.cell),
                "person": str(job.person),
                "trial": str(job.trial),
                "config": job.config,
                **{f"factor {name}": str(level) for name, level in job.levels.items()},
            },
        )
        return {}


def _fingerprint(job: StudyJob, row: Row, measures: Iterable[str]) -> str:
    """Hash of a run's measures, without its design columns and the user's measures."""
    inputs = {*DESIGN_COLUMNS, *job.levels, *measures}
    return _print_of({name: value for name, value in row.items() if name not in inputs})


def _print_of(row: Row) -> str:
    """Hash a row, the same for the row of a run and for that of a table."""
    filled = {name: v for name, v in row.items() if v is not None and v == v}
    return stable_hash({n: v if isinstance(v, str) else float(v) for n, v in filled.items()})
