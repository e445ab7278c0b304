"""What is asked of a study that is to be run: by the command line or by a program."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from dva_sim.experiments.execution import dry_run, kept_recordings, runner
from dva_sim.experiments.execution.scheduling import LIMIT_S, Simulate
from dva_sim.experiments.study.cell_grid import DesignCell
from dva_sim.experiments.study.study import Study, Version
from dva_sim.kernel.errors import ConfigError

Progress = Callable[[int, int], object]


@dataclass(frozen=True)
class RunRequest:
    """A study, which variant of it, where to, and on which processes.

    Attributes:
        study: By name or path.
        out: Results folder; None for `results/` and the study's name.
        changes: Keys to change, as `key=value`.
        quick: The study's small version.
        full: The study's larger version.
        pilot: Only so many persons, with a random seed of their own.
        jobs: Processes of this machine; by default one for each core.
        scheduler: Address of a dask.distributed cluster to use instead.
        limit_s: A run that takes longer, by the wall clock, has failed.
    """

    study: str | Path
    out: Path | None = None
    changes: Sequence[str] = ()
    quick: bool = False
    full: bool = False
    pilot: int | None = None
    jobs: int | None = None
    scheduler: str | None = None
    limit_s: float = LIMIT_S

    @property
    def version(self) -> Version | None:
        """The small or the larger version; None for the study as its file says.

        Raises:
            ConfigError: both are asked for.
        """
        if self.quick and self.full:
            raise ConfigError("--quick and --full are two versions of a study; give one of them")
        return "quick" if self.quick else "full" if self.full else None

    @property
    def folder(self) -> Path:
        """Where results go; if nobody says, each variant of a study has its own folder."""
        marks = [Path(self.study).stem, self.version, None if self.pilot is None else "pilot"]
        return self.out or Path("results") / "-".join(filter(None, marks))

    def plan(
        self, study: Study, cells: Sequence[DesignCell], probe: Simulate | None = None
    ) -> dry_run.DryRun:
        """What `run` would do; see `dry_run`."""
        jobs = self.jobs if self.scheduler is None else 1  # who knows how many are free there
        return dry_run.dry_run(study, self.folder, jobs=jobs, probe=probe, cells=cells)

    def run(
        self, study: Study, cells: Sequence[DesignCell], progress: Progress | None = None
    ) -> None:
        """Run what the folder does not hold yet; see `run_study`."""
        runner.run_study(
            study,
            self.folder,
            jobs=self.jobs,
            scheduler=self.scheduler,
            progress=progress,
            limit_s=self.limit_s,
            cells=cells,
        )

    def record(self, study: Study, progress: Progress | None = None) -> list[str]:
        """Make the recordings that the study asks for; see `record_study`."""
        return kept_recordings.record_study(
            study, self.folder, jobs=self.jobs, progress=progress, limit_s=self.limit_s
        )
