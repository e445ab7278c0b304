"""`dva-sim run` and `tune`: say what will run, run it, show how far it is, write the report."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, TextColumn
from rich.progress import Progress as Bars
from typing_extensions import override

from dva_sim.cli.console import console, say, warn
from dva_sim.cli.verbosity import WRITTEN, detail, is_verbose, tell_cells, tell_files
from dva_sim.experiments.execution.dry_run import DryRun, contradictions_in, dry_run
from dva_sim.experiments.execution.scheduling import Simulate, run_job
from dva_sim.experiments.results.results import Results
from dva_sim.experiments.runner import StudyListener, planned_study, run_study
from dva_sim.experiments.study.answerable import coverage_remarks, why_unanswered
from dva_sim.experiments.study.factor_levels import runs_of
from dva_sim.experiments.study.file_kinds import open_study
from dva_sim.experiments.study.plan import Progress, StudyPlan
from dva_sim.experiments.study.screening import file_of as file_of_screening
from dva_sim.experiments.study.screening import folder_of_screening, screened, screening_study
from dva_sim.experiments.study.study import Study
from dva_sim.experiments.study.tuning import folder_of_tuning, save_tuned, tuning_study
from dva_sim.kernel.errors import ExitCode, error_line
from dva_sim.kernel.wording import capital
from dva_sim.options.studies import RunOptions, TuneOptions

_LISTED_FAILURES = 5  # maximum failures that are listed one by one
_SLOW_TO_CHECK = 500  # configurations that take some seconds to check
_MANY_RUNS = 100_000  # runs whose list takes seconds
_LINE_S = 30.0  # interval between two lines of progress in a file
_MINUTE_S = 60
_SURE_AFTER_S = 10.0  # before this time and share, the first runs say little about the others
_SURE_SHARE = 0.05


def run(options: RunOptions) -> ExitCode:
    """Run a study and show how far it is, then write its report; the exit code."""
    results, unrecorded, report = run_study(options, _Shown(options))
    distrusted = results.distrusted
    for part, entry in distrusted.items():
        problem = f"in part {part} {entry}: no contrast of it is shown"
        print(error_line(problem), file=sys.stderr)
    tell_files(results.folder, *WRITTEN)
    detail(f"{results.machine.get('cpu_s', 0):.1f} s of CPU time in all runs")
    say(f"Report: {report}")
    failed = results.failures or unrecorded or distrusted
    return ExitCode.RUNS_FAILED if failed else ExitCode.OK


def tune(options: TuneOptions) -> ExitCode:
    """Tune a study's setting, and write the result beside the study; return the exit code."""
    from dva_sim.experiments.trials import tune as try_all  # late: start-up

    study = open_study(options.study)
    jobs = options.jobs
    trials = tuning_study(study)
    folder = Path(options.out or folder_of_tuning(str(options.study)))
    say(f"[bold]{escape(trials.question)}[/bold]")
    before = dry_run(trials, folder, jobs=jobs)
    say(_plan(before, folder))
    with _bar("trying", before.runs) as show:
        tuned = try_all(study, folder, jobs=jobs, progress=show)
    for trial in tuned.seen:
        when = ", ".join(f"{name} {level}" for name, level in trial.when.items())
        detail(f"  {when}, {tuned.tuning.key} {trial.value:g}: {trial.mean:.4g}")
    for choice in tuned.chosen:
        when = ", ".join(f"{name} {level}" for name, level in choice.when.items())
        say(f"{when}: {tuned.tuning.key} {choice.value:g}")
    say(f"Kept in {save_tuned(study, tuned)}")
    return ExitCode.OK


def screen(study: str, out: str | None, jobs: int | None, only_plan: bool) -> ExitCode:
    """Vary the assumed numbers behind a study's answer, and draw what moves it; the exit code."""
    from dva_sim.experiments.analysis.screening import TABLE  # late: start-up
    from dva_sim.experiments.report.figures.screening import draw_screening  # late: start-up
    from dva_sim.experiments.trials import screen as run_all  # late: start-up

    loaded = open_study(study)
    trials = screening_study(loaded)
    folder = Path(out or folder_of_screening(study))
    say(f"[bold]{escape(trials.question)}[/bold]")
    say(f"{len(screened(loaded))} assumed numbers, each within its band")
    before = dry_run(trials, folder, jobs=jobs, probe=run_job if only_plan else None)
    say(_plan(before, folder))
    if only_plan:
        say(escape(_time(before)))
        return ExitCode.OK
    with _bar("screening", before.runs) as show:
        screening = run_all(loaded, folder, jobs=jobs, progress=show)
    for line in draw_screening(loaded, screening, folder):
        say(escape(line))
    tell_files(folder, screening.write(folder / TABLE).name)
    say(
        f"Kept in {screening.write(file_of_screening(loaded))}, which the reports of other studies "
        "cite"
    )
    return ExitCode.OK


def plan(options: RunOptions) -> None:
    """Print the runs that `run` would make, and their cost."""
    progress = _Shown(options, run_job)
    planned_study(options, progress)
    say(escape(_time(progress.preview)))


class _Shown(StudyListener):
    """Prints the progress of a study.

    Args:
        options: Options that it is run with.
        probe: Function that makes the tables of a run that is tried for the estimate of the time.

    Attributes:
        preview: Number and cost of the runs, once they are planned.
    """

    preview: DryRun

    def __init__(self, options: RunOptions, probe: Simulate | None = None) -> None:
        self._options = options
        self._probe = probe

    @override
    def opened(self, study: Study) -> None:
        say(f"[bold]{escape(study.question)}[/bold]")

    @override
    def planned(self, plan: StudyPlan) -> None:
        study = plan.study
        warn([*study.lost, *why_unanswered(study), *contradictions_in(plan.cells)])
        tell_cells(study, plan.cells)
        if (most := runs_of(study)) > _MANY_RUNS:
            say(f"Making the list of up to {most:,} runs ...")
        folder = self._options.results_folder
        # With a scheduler nobody knows how many processes are free there.
        jobs = self._options.jobs if self._options.scheduler is None else 1
        self.preview = dry_run(plan, folder, jobs=jobs, probe=self._probe)
        if self.preview.remark:
            say(f"[yellow]{escape(self.preview.remark)}[/yellow]")
        say(escape(_plan(self.preview, folder)))
        for remark in coverage_remarks(study):
            say(escape(capital(remark)))

    @override
    def ran(self, results: Results) -> None:
        failures = results.failures
        for f in failures if is_verbose() else failures[:_LISTED_FAILURES]:
            where = f"{f['part']}, cell {f['cell']}, person {f['person']}, trial {f['trial']}"
            say(f"[red]failed:[/red] {where}: {escape(str(f['error']).splitlines()[-1])}")
        if failures:
            failed = _counted(len(failures), "run")
            problem = f"{failed} failed; repeat the same command to retry"
            print(error_line(problem), file=sys.stderr)

    @override
    def recorded(self, problems: list[str]) -> None:
        for problem in problems if is_verbose() else problems[:_LISTED_FAILURES]:
            say(f"[red]not recorded:[/red] {escape(problem)}")
        if problems:
            failed = _counted(len(problems), "run")
            print(error_line(f"{failed} could not be recorded"), file=sys.stderr)

    @override
    @contextmanager
    def progress(self, step: str, total: int) -> Iterator[Progress]:
        if step == "reporting":
            with console.status("Writing the report ..."):
                yield lambda *_: None
        elif step == "checking" and total < _SLOW_TO_CHECK:
            yield lambda *_: None
        else:
            if step == "checking":
                say("Checking every configuration before the first run ...")
            if step == "recording" and self._options.scheduler is not None:
                say("Recordings are made on this machine, from the same seeds")
            with _bar(step, total, "configurations" if step == "checking" else "runs") as show:
                yield show


def _plan(preview: DryRun, folder: Path) -> str:
    done = f", {preview.done} of them done already" if preview.done else ""
    most = f"at most {preview.runs}" if preview.rounds > 1 else f"{preview.runs}"
    rounds = f" and up to {preview.rounds} rounds" if preview.rounds > 1 else ""
    return f"{most} runs in {preview.cells} configurations{rounds}{done}; into {folder}"


def _time(preview: DryRun) -> str:
    """Describe how long it will take, and how that was estimated."""
    if preview.runs == preview.done:
        return "nothing is left to run"
    failed = f"a run that was tried failed: {preview.failed}" if preview.failed else ""
    if preview.estimate_s is None:
        return f"no estimate of the time: {failed or 'no run is done yet, and none was tried'}"
    runs = (
        f"{_counted(preview.tried, 'run')} tried now" if preview.tried else "the runs done already"
    )
    about = "more than" if preview.is_least else "about"
    who = _counted(preview.workers, "process", "processes")
    cpu = f" ({duration(preview.cpu_s)} of CPU time)" if preview.cpu_s else ""
    text = f"{about} {duration(preview.estimate_s)} to go with {who}{cpu}, judged by {runs}"
    text += "; the last was stopped before its end" if preview.is_least else ""
    return f"{text}; {failed}" if failed else text


def _counted(number: int, one: str, many: str | None = None) -> str:
    return f"{number} {one if number == 1 else many or f'{one}s'}"


# --- progress --------------------------------------------------------------------------
@contextmanager
def _bar(what: str, total: int, things: str = "runs") -> Iterator[Progress]:
    """Yield a bar on a terminal; elsewhere a line now and then."""
    pace = RunPace(time.monotonic, things)
    if not console.is_terminal:
        yield _Lines(console, pace).show
        return
    columns = (TextColumn(what), BarColumn(), TextColumn("{task.fields[pace]}"))
    with Bars(*columns, console=console) as bar:
        task = bar.add_task(what, total=total, pace="")

        def show(done: int, total: int) -> None:
            bar.update(task, completed=done, total=total, pace=pace.line(done, total))

        yield show


class _Lines:
    """Progress in a file: the first line, the last, and one now and then."""

    def __init__(self, where: Console, pace: RunPace) -> None:
        self._where = where
        self._pace = pace
        self._last = -_LINE_S

    def show(self, done: int, total: int) -> None:
        line = self._pace.line(done, total)
        if done == total or time.monotonic() - self._last >= _LINE_S:
            self._where.print(line, soft_wrap=True)
            self._last = time.monotonic()


class RunPace:
    """Rate at which runs are completed, since the first look.

    Args:
        clock: Seconds of a clock that only goes forward.
        things: Word for what is counted.
    """

    def __init__(self, clock: Callable[[], float], things: str = "runs") -> None:
        self._clock = clock
        self._things = things
        self._first: tuple[int, float] | None = None

    def line(self, done: int, total: int) -> str:
        """Runs that are done, their rate, and once that says something, the time left at it."""
        now = self._clock()
        self._first = self._first or (done, now)
        made = done - self._first[0]
        took = now - self._first[1]
        if not made or not took:
            return f"{done}/{total} {self._things}"
        rate = made / took
        is_sure = done < total and (took >= _SURE_AFTER_S or made >= _SURE_SHARE * total)
        left = f", {duration((total - done) / rate)} left" if is_sure else ""
        often = f"{rate:.1f} {self._things}/s"
        if rate < 1:
            often = f"{rate * _MINUTE_S:.1f} {self._things}/min"
        return f"{done}/{total} {self._things}, {often}{left}"


def duration(seconds: float) -> str:
    """Return a duration in the units that people would say it in."""
    if seconds < 90:
        return f"{seconds:.0f} s"
    if seconds < 90 * _MINUTE_S:
        return f"{seconds / _MINUTE_S:.0f} min"
    hours, rest = divmod(round(seconds / _MINUTE_S), _MINUTE_S)
    return f"{hours} h {rest} min"
