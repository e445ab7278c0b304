"""Run a study: what is not done yet, spread over processes, kept as it comes, then as tables."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from dva_sim.errors import ConfigError, DvaSimError
from dva_sim.experiments import design, pool
from dva_sim.experiments.design import Job, Key
from dva_sim.experiments.journal import FILE, Journal
from dva_sim.experiments.manifest import failures, machine, manifest_of, write_json
from dva_sim.experiments.pool import Episode
from dva_sim.experiments.results import MACHINE, MANIFEST
from dva_sim.experiments.study import Study
from dva_sim.experiments.tables import write_tables
from dva_sim.experiments.tuned import load_tuned

Progress = Callable[[int, int], object]


@dataclass(frozen=True)
class DryRun:
    """What running a study would mean.

    Attributes:
        runs: Different runs in all.
        done: How many of them the results folder already holds.
        cells: Configurations, with the reference runs' own.
        estimate_s: Time for the rest [s], if runs done before tell their cost.
        remark: What is doubtful about tuned values; empty if nothing is.
    """

    runs: int
    done: int
    cells: int
    estimate_s: float | None
    remark: str = ""


def run_study(
    study: Study,
    out: str | Path,
    *,
    jobs: int | None = None,
    episode: Episode | None = None,
    progress: Progress | None = None,
    limit_s: float = pool.LIMIT_S,
) -> Path:
    """Run what the results folder does not hold yet, then write its tables and manifest.

    The tables and the manifest are the same bytes with any number of processes and after any
    interruption; times and costs are apart, in `machine.json`. Runs that fail are listed in
    the manifest (`Results.failures`) and tried again the next time.

    Args:
        study: From `load_study`.
        out: Results folder, made if need be.
        jobs: Processes; by default one for each core.
        episode: Makes the tables of one run; by default a simulation.
        progress: Called with the number of runs done and of all runs, as they finish.
        limit_s: A run that takes longer, by the wall clock, has failed.

    Returns:
        The results folder.

    Raises:
        ConfigError: the study is not valid, or the folder holds another one.
        DvaSimError: the disk is full, or another program holds the journal.
        KeyboardInterrupt: after tidying up; its message says how to go on.
    """
    out, workers = Path(out), cores() if jobs is None else jobs
    if workers < 1:
        raise ConfigError(f"number of processes should be at least 1, not {workers}")
    cells = design.cells(study)
    todo = design.jobs(study, cells)
    manifest = manifest_of(study, cells, todo)
    started, clock = datetime.now(UTC), time.perf_counter()
    with _open(out, manifest) as journal:
        _run_rest(todo, journal, episode or _simulation(), workers, progress, limit_s)
        write_tables(out, todo, journal)
        manifest["failures"] = failures(todo, journal)
        write_json(out / MANIFEST, manifest)
        session = {"cores": cores(), "jobs": workers, "started": started.isoformat()}
        session["wall_s"] = time.perf_counter() - clock
        write_json(out / MACHINE, machine(todo, journal) | session)
    return out


def dry_run(study: Study, out: str | Path, *, jobs: int | None = None) -> DryRun:
    """What `run_study` would do, without doing it.

    Raises:
        ConfigError: the study is not valid, or the folder holds another one.
    """
    cells = design.cells(study)
    todo = design.jobs(study, cells)
    keys = {job.key for job in todo}
    costs: dict[Key, float] = {}
    if (Path(out) / FILE).exists():
        with _open(Path(out), manifest_of(study, cells, todo)) as journal:
            costs = journal.costs()
    left = len(keys - costs.keys())
    mean = sum(costs.values()) / len(costs) if costs else None
    estimate = None if mean is None else mean * left / (jobs or cores())
    return DryRun(len(keys), len(keys) - left, len(cells), estimate, _remark(study))


def cores() -> int:
    """How many processes can run at the same time here."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _run_rest(
    todo: Sequence[Job],
    journal: Journal,
    episode: Episode,
    workers: int,
    progress: Progress | None,
    limit_s: float,
) -> None:
    """Run what is not done; each batch is in the journal before it is counted."""
    distinct = {job.key: job for job in todo}
    done = journal.done()
    rest = [job for key, job in distinct.items() if key not in done]
    count, total = len(distinct) - len(rest), len(distinct)
    tell = progress or (lambda *_: None)
    tell(count, total)
    try:
        with closing(pool.run_all(rest, episode, min(workers, len(rest)), limit_s)) as batches:
            for batch in batches:
                journal.add(batch)
                count += len(batch)
                tell(count, total)
    except KeyboardInterrupt:
        raise KeyboardInterrupt(
            f"interrupted after {count} of {total} runs; the same command goes on from there"
        ) from None


def _simulation() -> Episode:
    from dva_sim.experiments.episode import run_job

    return run_job


def _open(out: Path, manifest: dict[str, Any]) -> Journal:
    """The journal of the folder, which must be this study's or new."""
    identity = manifest["hash"]
    try:
        out.mkdir(parents=True, exist_ok=True)
        if not (out / FILE).exists() and (out / MANIFEST).exists():
            found = json.loads((out / MANIFEST).read_text(encoding="utf-8")).get("hash")
            if found != identity:
                raise ConfigError(f"{out} holds another study ({found}); give another folder")
    except FileExistsError:
        raise ConfigError(f"{out} is a file; give a folder for the results") from None
    except OSError as error:
        raise DvaSimError(f"{out} cannot be written: {error.strerror}") from None
    except ValueError:
        raise ConfigError(f"{out} holds something else; give another folder") from None
    return Journal(out, identity)


def _remark(study: Study) -> str:
    if not design.is_tuned(study):
        return ""
    return load_tuned(study).remark(design.basis_of_tuning(study))
