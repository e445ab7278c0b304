"""Run a study: what is not done yet, wherever it is run, kept as it comes, then as tables.

`RunRequest` is what the command line, or a program, asks of a study.
"""

from __future__ import annotations

import json
import math
import shutil
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any

from dva_sim.experiments.execution import dry_run, executors, kept_recordings, scheduling
from dva_sim.experiments.execution.checkpoint import Checkpoint
from dva_sim.experiments.execution.dask_cluster import DaskCluster
from dva_sim.experiments.execution.executors import Workers, WorkersLost
from dva_sim.experiments.execution.scheduling import Simulate, run_job
from dva_sim.experiments.results.folder_lock import FolderLock
from dva_sim.experiments.results.manifest import failures, machine, manifest_of, write_json
from dva_sim.experiments.results.results import JOURNAL, MACHINE, MANIFEST, TABLES, digests
from dva_sim.experiments.results.tables import design_row, write_tables
from dva_sim.experiments.study.cell_grid import StudyJob
from dva_sim.experiments.study.file_kinds import open_study
from dva_sim.experiments.study.file_watch import FileWatch
from dva_sim.experiments.study.hashing import edited_files, files_of, folders_of_files
from dva_sim.experiments.study.loading import pairs_of
from dva_sim.experiments.study.plan import StudyPlan
from dva_sim.experiments.study.stopping import is_enough, rounds, widest
from dva_sim.experiments.study.study import Study, Version
from dva_sim.kernel.errors import ConfigError, DvaSimError
from dva_sim.kernel.streams import derive_seed
from dva_sim.options.studies import RunOptions

Progress = Callable[[int, int], object]


def run_study(
    asked: Study | StudyPlan,
    out: str | Path,
    *,
    jobs: int | None = None,
    scheduler: str | None = None,
    episode: Simulate | None = None,
    progress: Progress | None = None,
    limit_s: float = scheduling.LIMIT_S,
) -> Path:
    """Run what the results folder does not hold yet, then write its tables and manifest.

    The tables and the manifest are the same bytes wherever the runs are made and after any
    interruption; times and costs are apart, in `machine.json`. Runs that fail are listed in
    the manifest (`Results.failures`) and tried again the next time.

    Args:
        asked: From `load_study`, or its plan if that has been made.
        out: Results folder, made if need be.
        jobs: Processes of this machine; by default one for each core.
        scheduler: Address of a dask.distributed cluster to use instead.
        episode: Function that makes the tables of one run; by default a simulation.
        progress: Called with the number of runs done and of all runs, as they finish.
        limit_s: A run that takes longer, by the wall clock, has failed.

    Returns:
        The results folder.

    Raises:
        ConfigError: the study is not valid, the folder holds another one, a file that runs read
            has changed meanwhile, or the cluster does not exist.
        FolderInUse: another process writes into the folder.
        DvaSimError: the disk is full, another program holds the checkpoint, or the cluster is lost.
        KeyboardInterrupt: after tidying up; its message says what has been done.
    """
    out = Path(out)
    started = datetime.now(UTC)
    clock = time.perf_counter()
    plan = StudyPlan.of(asked)
    watch = FileWatch(lambda: (*files_of(plan.input_names), *edited_files()), folders_of_files)
    manifest = manifest_of(plan)  # later: what it hashes is watched
    with ExitStack() as stack:
        workers = stack.enter_context(_workers(plan, jobs, scheduler))
        stack.enter_context(FolderLock(out))
        checkpoint = stack.enter_context(_opened(out, manifest["hash"]))
        checkpoint.describe(manifest)
        own = tuple(plan.measures)
        simulate = episode or (partial(run_job, measures=own) if own else run_job)
        session = _Session(
            plan, checkpoint, workers, simulate, progress=progress, limit_s=limit_s, watch=watch
        )
        with session.explained_ends():
            carried_out, stopped = _run_rounds(plan.study, plan.jobs, session)
            with checkpoint.alone():
                _tidy(out)
                manifest["runs"] = len({job.key for job in carried_out})
                manifest["stopped"] = stopped
                manifest["failures"] = failures(carried_out, checkpoint.failures())
                if not _is_written(out, manifest):
                    write_tables(out, carried_out, checkpoint.tables)
                    manifest["tables"] = digests(out / TABLES)
                    write_json(out / MANIFEST, manifest)
        facts = {"cores": executors.cores(), "jobs": workers.width, "started": started.isoformat()}
        facts |= {"wall_s": time.perf_counter() - clock}
        write_json(out / MACHINE, machine(carried_out, checkpoint.costs()) | facts)
    return out


def _opened(out: Path, identity: str) -> Checkpoint:
    """The checkpoint of a results folder, which must be this study's or new."""
    try:
        if not (out / JOURNAL).exists() and (out / MANIFEST).exists():
            found = json.loads((out / MANIFEST).read_text(encoding="utf-8")).get("hash")
            if found != identity:
                raise ConfigError(f"{out} holds another study ({found}); give another folder")
    except OSError as error:
        raise DvaSimError(f"{out} cannot be read: {error.strerror}") from None
    except ValueError:
        raise ConfigError(f"{out} holds something else; give another folder") from None
    return Checkpoint(out, identity)


class _Session:
    """One go at a study: runs what is asked for and is not done, and counts."""

    def __init__(
        self,
        plan: StudyPlan,
        checkpoint: Checkpoint,
        workers: Workers,
        episode: Simulate,
        *,
        progress: Progress | None,
        limit_s: float,
        watch: FileWatch,
    ) -> None:
        self.checkpoint = checkpoint
        self._workers = workers
        self._episode = episode
        self._limit_s = limit_s
        self._watch = watch
        self._tell = progress or (lambda *_: None)
        self._place = _at_random if plan.is_real_time else _as_designed
        keys = {job.key for job in plan.jobs}
        self._total = len(keys)
        self._count = len(keys & checkpoint.done())
        self._tell(self._count, self._total)

    def left(self, batch: Sequence[StudyJob]) -> list[StudyJob]:
        """Runs of a batch not done yet, each once, person by person.

        So what is known on the way is known of whole persons, in all cells. Where the machine may
        change meanwhile, the cells of each come in random order.
        """
        done = self.checkpoint.done()
        rest = [job for key, job in {job.key: job for job in batch}.items() if key not in done]
        return sorted(rest, key=lambda job: (job.person, job.trial, self._place(job)))

    def run(self, rest: Sequence[StudyJob]) -> None:
        """Run some; what comes together is in the checkpoint before it is counted."""
        clock = time.perf_counter()
        batches = scheduling.run_all(rest, self._episode, self._workers, self._limit_s)
        with closing(batches):
            for batch in batches:
                self._watch.refuse_changes()  # these runs may have read either
                now = time.perf_counter()
                self.checkpoint.add(batch, now - clock)
                clock = now
                self._count += len(batch)
                self._tell(self._count, self._total)

    def end(self) -> None:
        """No more will be run, even if not all have been."""
        self._tell(self._count, self._count)

    @contextmanager
    def explained_ends(self) -> Iterator[None]:
        """Say with a Ctrl-C, or when all workers are lost, how far it had come."""
        go_on = "run the same command again to resume"
        try:
            yield
        except WorkersLost as lost:
            raise WorkersLost(
                f"{lost}; {self._count} of {self._total} runs are kept; {go_on}, also with "
                "another --scheduler or with --jobs"
            ) from None
        except KeyboardInterrupt:
            raise KeyboardInterrupt(
                f"interrupted after {self._count} of {self._total} runs, which are kept; {go_on}"
            ) from None


def _as_designed(_: StudyJob) -> int:
    return 0


def _at_random(job: StudyJob) -> int:
    """The place of a run among those of its person: random, and the same in every session."""
    return derive_seed(job.seed, "order", job.config)


def _run_rounds(
    study: Study, todo: Sequence[StudyJob], session: _Session
) -> tuple[list[StudyJob], dict[str, Any]]:
    """Round after round until the study has enough; the jobs it then has, and what ended it.

    The stopping rule is applied to whole rounds only, which are the same wherever and however
    often the study was interrupted. A round that is done counts even if the budget is spent.
    """
    batches = rounds(study, todo)
    chosen: list[StudyJob] = []
    why = None
    number = 0
    for number, batch in enumerate(batches, 1):
        rest = session.left(batch)
        is_spent = study.budget_s is not None and session.checkpoint.wall_s >= study.budget_s
        if rest and chosen and is_spent:
            why = "budget"
            number -= 1
            break
        session.run(rest)
        chosen.extend(batch)
        if number < len(batches) and is_enough(study, _rows(todo, chosen, session.checkpoint)):
            why = "enough"
            break
    if why is not None:
        session.end()
    stopped: dict[str, Any] = {"rounds": number, "of": len(batches), "why": why}
    if study.stop is not None:
        reached = widest(study, study.stop, _rows(todo, chosen, session.checkpoint))
        stopped["why"] = why or ("enough" if reached <= study.stop.half_width else "limit")
        stopped["half_width"] = reached if math.isfinite(reached) else None
    return _in_order(todo, chosen), stopped


def _in_order(todo: Sequence[StudyJob], chosen: Sequence[StudyJob]) -> list[StudyJob]:
    """The chosen ones in the order of the design."""
    ids = {id(job) for job in chosen}
    return [job for job in todo if id(job) in ids]


def _rows(
    todo: Sequence[StudyJob], chosen: Sequence[StudyJob], checkpoint: Checkpoint
) -> list[dict[str, Any]]:
    """The table `runs` of the chosen jobs, but for repeats."""
    own = [job for job in _in_order(todo, chosen) if not job.is_repeat]
    tables = ((job, checkpoint.tables(job.key) or {}) for job in own)
    return [design_row(job) | row for job, found in tables for row in found.get("runs", ())]


@contextmanager
def _workers(plan: StudyPlan, jobs: int | None, scheduler: str | None) -> Iterator[Workers]:
    if plan.is_real_time:
        if scheduler is not None or jobs not in (None, 1):
            raise ConfigError(
                "this study measures in real time, one run at a time on this machine: leave out "
                "--jobs and --scheduler"
            )
        jobs = 1
    if scheduler is None:
        with executors.local(jobs) as processes:
            yield processes
        return
    if jobs is not None:
        raise ConfigError("give the number of processes or a scheduler, not both")
    with DaskCluster(scheduler) as cluster:
        yield cluster


def _is_written(out: Path, manifest: Mapping[str, Any]) -> bool:
    """True if this very program wrote the tables of these runs, and they are unchanged.

    The tables of a run never change once kept. So the same runs, with the same failures,
    make the same tables; only a program that is being changed may write them in another way.
    """
    try:
        found = json.loads((out / MANIFEST).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return False
    asked = json.loads(json.dumps({**manifest, "tables": digests(out / TABLES)}))
    return bool(found == asked and not manifest["versions"]["dirty"])


def _tidy(out: Path) -> None:
    """Remove what a runner left behind that was killed while it wrote."""
    for path in out.glob(".tables-*"):
        shutil.rmtree(path, ignore_errors=True)
    for name in (MANIFEST, MACHINE):
        for path in out.glob(f".{Path(name).stem}.*"):
            path.unlink(missing_ok=True)


@dataclass(frozen=True)
class RunRequest:
    """A study that is asked for: which variant, where to, and on which processes."""

    options: RunOptions

    def open(self) -> Study:
        """The study, with its changes.

        Raises:
            ConfigError: it is not there or not valid.
        """
        asked = self.options
        changes = pairs_of(asked.set, asked.seed)
        return open_study(asked.study, changes, version=self.version, pilot=asked.pilot)

    @property
    def version(self) -> Version | None:
        """The small or the larger version; None for the study as its file says.

        Raises:
            ConfigError: both are asked for.
        """
        if self.options.quick and self.options.full:
            raise ConfigError("--quick and --full are two versions of a study; give one of them")
        return "quick" if self.options.quick else "full" if self.options.full else None

    @property
    def folder(self) -> Path:
        """Folder of the results; by default one for each variant of a study."""
        asked = self.options
        marks = [Path(asked.study).stem, self.version, None if asked.pilot is None else "pilot"]
        return Path(asked.out or Path("results") / "-".join(filter(None, marks)))

    def dry_run(self, plan: StudyPlan, probe: Simulate | None = None) -> dry_run.DryRun:
        """Preview what `run` would do; see `dry_run`."""
        jobs = (
            self.options.jobs if self.options.scheduler is None else 1
        )  # who knows how many are free there
        return dry_run.dry_run(plan, self.folder, jobs=jobs, probe=probe)

    def run(self, plan: StudyPlan, progress: Progress | None = None) -> None:
        """Run what the folder does not hold yet; see `run_study`."""
        run_study(
            plan,
            self.folder,
            jobs=self.options.jobs,
            scheduler=self.options.scheduler,
            progress=progress,
            limit_s=self.options.limit_s,
        )

    def record(self, plan: StudyPlan, progress: Progress | None = None) -> list[str]:
        """Make the recordings that the study asks for; see `record_study`."""
        return kept_recordings.record_study(
            plan,
            self.folder,
            jobs=self.options.jobs,
            progress=progress,
            limit_s=self.options.limit_s,
        )
