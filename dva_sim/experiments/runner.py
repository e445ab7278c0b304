"""The way of a study, from its file to its report; what guards it lies below, in `execution`."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from dva_sim.experiments.analysis.stopping import widest
from dva_sim.experiments.execution.kept_recordings import record_study
from dva_sim.experiments.execution.scheduling import Simulate
from dva_sim.experiments.execution.session import open_session
from dva_sim.experiments.results.results import Results
from dva_sim.experiments.study.cell_grid import StudyJob
from dva_sim.experiments.study.factor_levels import cells_of_repeats, size
from dva_sim.experiments.study.file_kinds import open_study
from dva_sim.experiments.study.loading import pairs_of
from dva_sim.experiments.study.plan import Progress, StudyPlan, checked_plan
from dva_sim.experiments.study.study import Study
from dva_sim.options.studies import RunOptions


class StudyListener:
    """Listener to the steps of a study; this one ignores them."""

    def opened(self, study: Study) -> None:
        """Note that its file has been read."""

    def planned(self, plan: StudyPlan) -> None:
        """Note that its runs are known, and its cells have no mistakes."""

    def ran(self, results: Results) -> None:
        """Note that its tables are written."""

    def recorded(self, problems: list[str]) -> None:
        """Note that its recordings are made, but for these."""

    @contextmanager
    def progress(self, step: str, total: int) -> Iterator[Progress]:
        """Show a step that takes some time: checking, running, recording or reporting.

        Args:
            step: Name of the step.
            total: Number of things to do, as far as it is known.
        """
        yield lambda *_: None


class StudyOutcome(NamedTuple):
    """A study that was run.

    Attributes:
        results: Its tables and manifest; `failures` tells of runs that failed.
        unrecorded: Problems with recordings, a line for each.
        report: Page of the report; None if none was asked for.
    """

    results: Results
    unrecorded: list[str]
    report: Path | None


def run_study(
    options: RunOptions,
    listener: StudyListener | None = None,
    *,
    study: Study | None = None,
    episode: Simulate | None = None,
) -> StudyOutcome:
    """Run or resume a study, from its file to its report.

    Tables, manifest and report are the same bytes wherever the runs are made and after any
    interruption. Runs that fail are listed in the manifest and tried again the next time.

    Args:
        options: The study, its variant, its folder, and the processes.
        listener: Object that hears of each step.
        study: Study to be run as it is, in place of the one that the options name.
        episode: Function that makes the tables of one run; by default a simulation.

    Raises:
        ConfigError: the study is not valid, the folder holds another one, a file that runs read
            has changed meanwhile, or the cluster does not exist.
        FolderInUse: another process writes into the folder.
        DvaSimError: the disk is full, another program holds the journal, or the cluster is lost.
        KeyboardInterrupt: the finished runs are kept, and the same call goes on.
    """
    listener = listener or StudyListener()
    folder = options.results_folder

    # Load and check: cells x persons x trials, of which one run of every cell is built.
    plan = planned_study(options, listener) if study is None else StudyPlan.of(study)
    study = plan.study

    # Run what the folder does not hold yet, batch after batch of persons, until it is enough. The
    # rule looks at whole batches, which are the same wherever and however often it was interrupted.
    finished: list[list[StudyJob]] = []
    reached = math.inf
    why = None
    with (
        listener.progress("running", plan.runs) as show,
        open_session(plan, options, options.progress or show, episode) as session,
    ):
        for batch in plan.rounds:
            left = session.left(batch)
            if left and finished and session.is_budget_spent:
                why = "budget"
                break
            session.run(left)
            finished.append(batch)
            if study.stop is not None:
                reached = widest(study, study.stop, session.table(finished))
                if reached <= study.stop.half_width:
                    why = "enough"
                    break
        stopped: dict[str, Any] = {"rounds": len(finished), "of": len(plan.rounds), "why": why}
        if study.stop is not None:
            stopped["why"] = why or "limit"
            stopped["half_width"] = reached if math.isfinite(reached) else None
        session.write(finished, stopped)
    results = Results.load(folder)
    listener.ran(results)

    # Run again, with everything kept, those that the study wants as recordings.
    problems: list[str] = []
    if study.record is not None:
        with listener.progress("recording", 0) as show:
            problems = record_study(
                plan, folder, jobs=options.jobs, progress=show, limit_s=options.limit_s
            )
        listener.recorded(problems)

    # Analyse the tables, and report: the answer, the figures and the page.
    page = None
    if options.report:
        from dva_sim.experiments.report.report import write_page  # late: start-up
        from dva_sim.experiments.report.summary import Reading  # late: start-up

        with listener.progress("reporting", 1):
            analysed = Reading(results)
            page = write_page(analysed)
    return StudyOutcome(results, problems, page)


def planned_study(options: RunOptions, listener: StudyListener) -> StudyPlan:
    """Load a study with its changes, plan its runs, and build one run of every cell.

    Raises:
        ConfigError: the study is not valid, or not for this machine.
    """
    study = open_study(
        options.study,
        pairs_of(options.set, options.seed),
        version=options.version,
        pilot=options.pilot,
    )
    listener.opened(study)
    cells = size(study) * len(study.parts) + cells_of_repeats(study)
    with listener.progress("checking", cells) as show:
        plan = checked_plan(study, show)
    listener.planned(plan)
    return plan
