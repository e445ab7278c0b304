"""Runs of a study until they are done or interrupted: its workers, journal, lock and tables.

A kill loses no run that is in the journal, two processes never write into one folder, a file that
changes under way ends the study, and a Ctrl-C says how far it came.
"""

from __future__ import annotations

import json
import shutil
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack, closing, contextmanager
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any

from dva_sim.experiments.execution import executors, scheduling
from dva_sim.experiments.execution.checkpoint import Checkpoint
from dva_sim.experiments.execution.dask_cluster import workers_at
from dva_sim.experiments.execution.executors import Workers, WorkersLost
from dva_sim.experiments.execution.scheduling import Simulate, run_job
from dva_sim.experiments.results.folder_lock import FolderLock
from dva_sim.experiments.results.manifest import failures, machine, manifest_of, write_json
from dva_sim.experiments.results.results import (
    JOURNAL,
    MACHINE,
    MANIFEST,
    TABLES,
    Frame,
    digests,
    frame_of,
)
from dva_sim.experiments.results.tables import design_row, write_tables
from dva_sim.experiments.study.cell_grid import StudyJob
from dva_sim.experiments.study.hashing import edited_files, files_of, folders_of_files
from dva_sim.experiments.study.plan import Progress, StudyPlan
from dva_sim.kernel.errors import ConfigError, DvaSimError
from dva_sim.kernel.read_once import Version, read_version
from dva_sim.kernel.streams import derive_seed
from dva_sim.options.studies import RunOptions

_RESUME = "run the same command again to resume"


@contextmanager
def open_session(
    plan: StudyPlan, options: RunOptions, progress: Progress, episode: Simulate | None = None
) -> Iterator[StudySession]:
    """Open the results folder of a study, and the workers that make its runs.

    Args:
        plan: Plan of the study.
        options: The folder, the workers, and how long a run may take.
        progress: Called with the number of runs done and of all runs, as they finish.
        episode: Function that makes the tables of one run; by default a simulation.

    Raises:
        ConfigError: the folder holds another study, or the cluster does not exist.
        FolderInUse: another process writes into the folder.
        DvaSimError: the disk is full, another program holds the journal, or the cluster is lost.
        KeyboardInterrupt: after tidying up; its message says how many runs are kept.
    """
    folder = options.results_folder
    watch = FileWatch(lambda: (*files_of(plan.input_names), *edited_files()), folders_of_files)
    manifest = manifest_of(plan)  # later: what it hashes is watched
    with ExitStack() as stack:
        workers = stack.enter_context(_workers(plan, options.jobs, options.scheduler))
        stack.enter_context(FolderLock(folder))
        journal = stack.enter_context(_opened(folder, manifest["hash"]))
        journal.describe(manifest)
        session = StudySession(plan, manifest, journal, workers, watch, progress)
        session.limit_s = options.limit_s
        if episode is not None:
            session.episode = episode
        try:
            yield session
        except WorkersLost as lost:
            raise WorkersLost(
                f"{lost}; {session.count} of {plan.runs} runs are kept; {_RESUME}, also with "
                "another --scheduler or with --jobs"
            ) from None
        except KeyboardInterrupt:
            raise KeyboardInterrupt(
                f"interrupted after {session.count} of {plan.runs} runs, which are kept; {_RESUME}"
            ) from None


class StudySession:
    """Session of a study: the runs in its results folder, and workers for the missing ones.

    Attributes:
        count: Number of runs that are kept.
        episode: Function that makes the tables of one run.
        limit_s: A run that takes longer, by the wall clock, has failed.
    """

    def __init__(
        self,
        plan: StudyPlan,
        manifest: dict[str, Any],
        journal: Checkpoint,
        workers: Workers,
        watch: FileWatch,
        progress: Progress,
    ) -> None:
        self._started = datetime.now(UTC)
        self._clock = time.perf_counter()
        self._plan = plan
        self._manifest = manifest
        self.journal = journal
        self._workers = workers
        self._watch = watch
        self._progress = progress
        measures = tuple(plan.measures)
        self.episode: Simulate = partial(run_job, measures=measures) if measures else run_job
        self.limit_s = scheduling.LIMIT_S
        self.count = len({job.key for job in plan.jobs} & journal.done())
        progress(self.count, plan.runs)

    def left(self, batch: Sequence[StudyJob]) -> list[StudyJob]:
        """Return the runs of a batch that are not done yet, each once, person by person.

        So what is known on the way is known of whole persons, in all cells. Where the machine may
        change meanwhile, the cells of each come in random order, the same in every session.
        """
        done = self.journal.done()
        rest = [job for key, job in {job.key: job for job in batch}.items() if key not in done]
        if self._plan.is_real_time:
            rest.sort(key=_at_random)
        return sorted(rest, key=lambda job: (job.person, job.trial))

    @property
    def is_budget_spent(self) -> bool:
        """True if the study's time is over, counted over all sessions."""
        budget = self._plan.study.budget_s
        return budget is not None and self.journal.wall_s >= budget

    def run(self, jobs: Sequence[StudyJob]) -> None:
        """Make some runs; each batch is in the journal before it is counted."""
        clock = time.perf_counter()
        batches = scheduling.run_all(jobs, self.episode, self._workers, self.limit_s)
        with closing(batches):
            for batch in batches:
                self._watch.refuse_changes()  # these runs may have read either
                now = time.perf_counter()
                self.journal.add(batch, now - clock)
                clock = now
                self.count += len(batch)
                self._progress(self.count, self._plan.runs)

    def in_order(self, batches: Sequence[Sequence[StudyJob]]) -> list[StudyJob]:
        """Return the runs of some batches in the order of the design."""
        ids = {id(job) for batch in batches for job in batch}
        return [job for job in self._plan.jobs if id(job) in ids]

    def table(self, batches: Sequence[Sequence[StudyJob]]) -> Frame:
        """Return the table `runs` of some batches, without repeats."""
        originals = [job for job in self.in_order(batches) if not job.is_repeat]
        tables = ((job, self.journal.tables(job.key) or {}) for job in originals)
        rows = (
            design_row(job) | row
            for job, run_tables in tables
            for row in run_tables.get("runs", ())
        )
        return frame_of(list(rows))

    def write(self, batches: Sequence[Sequence[StudyJob]], stopped: dict[str, Any]) -> None:
        """Write the tables of some batches, the manifest, and the cost on this machine.

        Tables and manifest are the same bytes wherever the runs were made.

        Args:
            batches: The batches that the study has, whole.
            stopped: Why it has no more, for the manifest.
        """
        jobs = self.in_order(batches)
        if stopped["rounds"] < stopped["of"]:
            self._progress(self.count, self.count)  # no more will be run
        folder = self.journal.path.parent
        with self.journal.alone():
            _tidy(folder)
            manifest = self._manifest | {
                "runs": len({job.key for job in jobs}),
                "stopped": stopped,
                "failures": failures(jobs, self.journal.failures()),
            }
            if not _is_written(folder, manifest):
                write_tables(folder, jobs, self.journal.tables)
                manifest["tables"] = digests(folder / TABLES)
                write_json(folder / MANIFEST, manifest)
        facts = {
            "cores": executors.cores(),
            "jobs": self._workers.width,
            "started": self._started.isoformat(),
            "wall_s": time.perf_counter() - self._clock,
        }
        write_json(folder / MACHINE, machine(jobs, self.journal.costs()) | facts)


def _at_random(job: StudyJob) -> int:
    return derive_seed(job.seed, "order", job.config)


@contextmanager
def _workers(plan: StudyPlan, jobs: int | None, scheduler: str | None) -> Iterator[Workers]:
    if plan.is_real_time:
        if scheduler is not None or jobs not in (None, 1):
            raise ConfigError(
                "this study measures in real time, one run at a time on this machine: leave out "
                "--jobs and --scheduler"
            )
        jobs = 1
    with workers_at(scheduler, jobs) as workers:
        yield workers


def _opened(out: Path, identity: str) -> Checkpoint:
    """Return the journal of a results folder, which must be this study's or new."""
    try:
        if not (out / JOURNAL).exists() and (out / MANIFEST).exists():
            held_identity = json.loads((out / MANIFEST).read_text(encoding="utf-8")).get("hash")
            if held_identity != identity:
                raise ConfigError(
                    f"{out} holds another study ({held_identity}); give another folder"
                )
    except OSError as error:
        raise DvaSimError(f"{out} cannot be read: {error.strerror}") from None
    except ValueError:
        raise ConfigError(f"{out} holds something else; give another folder") from None
    return Checkpoint(out, identity)


def _is_written(out: Path, manifest: dict[str, Any]) -> bool:
    """Return True if this very program wrote the tables of these runs, and they are unchanged.

    The tables of a run never change once kept. So the same runs, with the same failures,
    make the same tables; only a program that is being changed may write them in another way.
    """
    try:
        written = json.loads((out / MANIFEST).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return False
    expected = json.loads(json.dumps({**manifest, "tables": digests(out / TABLES)}))
    return bool(written == expected and not manifest["versions"]["dirty"])


def _tidy(out: Path) -> None:
    """Remove files left by a runner that was killed while writing."""
    for path in out.glob(".tables-*"):
        shutil.rmtree(path, ignore_errors=True)
    for name in (MANIFEST, MACHINE):
        for path in out.glob(f".{Path(name).stem}.*"):
            path.unlink(missing_ok=True)


Files = Callable[[], Iterable[tuple[str, Path]]]


class FileWatch:
    """Remembers the versions of files, and refuses runs made after a change.

    A check takes 0.2 ms while no file, and no folder that may get a new one, has changed.

    Args:
        files: Returns the files' names for messages, and their paths as runs would find them now.
        folders: Returns the folders in which a new file could hide one of them.
    """

    def __init__(self, files: Files, folders: Callable[[], Iterable[Path]]) -> None:
        self._files = files
        self._folders = folders
        self._places: tuple[Path, ...] = ()
        self._seen: tuple[Version, ...] = ()
        self._begun = self._look()

    def refuse_changes(self) -> None:
        """Do nothing while the files are as they were.

        A file that was changed and restored also counts: some runs may have read the change.

        Raises:
            ConfigError: a file was written or deleted, or a new one hides it.
        """
        if tuple(map(read_version, self._places)) == self._seen:
            return
        now = self._look()
        changed = [
            name for name in {**self._begun, **now} if self._begun.get(name) != now.get(name)
        ]
        if changed:
            raise ConfigError(
                f"{changed[0]} has changed since the study began, so the runs under way were "
                "discarded; run the same command again to resume, or give another folder with -o"
            )

    def _look(self) -> dict[str, Version]:
        """Return the version of each file by name."""
        folders = list(self._folders())
        folder_versions = tuple(map(read_version, folders))
        files = dict(self._files())
        versions = {name: read_version(path) for name, path in files.items()}
        self._places = (*folders, *files.values())
        self._seen = (*folder_versions, *versions.values())
        return versions
