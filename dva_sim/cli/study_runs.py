"""`dva-sim run` and `tune`: say what will run, run it, show how far it is, write the report."""

from __future__ import annotations

import shlex
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TextColumn

from dva_sim.cli.console import console, say, warn
from dva_sim.cli.verbosity import WRITTEN, detail, is_verbose, tell_cells, tell_files
from dva_sim.experiments.execution.dry_run import DryRun, contradictions_in, dry_run, rehearse_all
from dva_sim.experiments.execution.runner import RunRequest
from dva_sim.experiments.execution.scheduling import Simulate, run_job
from dva_sim.experiments.results.results import Results
from dva_sim.experiments.study import coverage
from dva_sim.experiments.study.answerable import why_unanswered
from dva_sim.experiments.study.factor_levels import cells_of_repeats, runs_of, size
from dva_sim.experiments.study.file_kinds import open_study
from dva_sim.experiments.study.plan import StudyPlan
from dva_sim.experiments.study.screening import file_of as file_of_screening
from dva_sim.experiments.study.screening import folder_of_screening, screened, screening_study
from dva_sim.experiments.study.study import Study
from dva_sim.experiments.study.tuning import folder_of_tuning, save_tuned, tuning_study
from dva_sim.kernel.errors import ExitCode, error_line
from dva_sim.kernel.wording import capital
from dva_sim.options.studies import TuneOptions

_FEW = 5  # failures that are told one by one
_MANY = 500  # configurations, which take some seconds to check
_MANY_RUNS = 100_000  # whose list takes seconds, too
_LINE_S = 30.0  # between two lines of progress in a file
_MINUTE_S = 60
_HOUR_S = 3600
_SURE_AFTER_S, _SURE_SHARE = 10.0, 0.05  # before both, the first runs say little of the others


def run(request: RunRequest) -> ExitCode:
    """Run a study and show how far it is, then write its report; the exit code."""
    from dva_sim.experiments.report.report import write_report  # late: start-up

    try:
        plan = _loaded(request)
        before = _planned(request, plan)
        folder = request.folder
        with _shown("running", before.runs) as show:
            request.run(plan, show)
        results = Results.load(folder)
        failures = _report_failures(results) + _recorded(request, plan)
        with console.status("Writing the report ..."):
            report = write_report(folder)
            distrusted = results.distrusted
        for part, entry in distrusted.items():
            problem = f"in part {part} {entry}: no contrast of it is shown"
            print(error_line(problem), file=sys.stderr)
        tell_files(folder, *WRITTEN)
        detail(f"{results.machine.get('cpu_s', 0):.1f} s of CPU time in all runs")
    except KeyboardInterrupt as stopped:
        return _stopped(stopped)
    say(f"Report: {report}")
    return ExitCode.RUNS_FAILED if failures or distrusted else ExitCode.OK


def tune(options: TuneOptions) -> ExitCode:
    """Choose what a study has tuned, and write it beside the study; the exit code."""
    from dva_sim.experiments.analysis.tuning import tune as try_all  # late: start-up

    asked = open_study(options.study)
    jobs = options.jobs
    trials = tuning_study(asked)
    folder = Path(options.out or folder_of_tuning(str(options.study)))
    say(f"[bold]{escape(trials.question)}[/bold]")
    before = dry_run(trials, folder, jobs=jobs)
    say(_plan(before, folder))
    try:
        with _shown("trying", before.runs) as show:
            tuned = try_all(asked, folder, jobs=jobs, progress=show)
    except KeyboardInterrupt as stopped:
        return _stopped(stopped)
    for seen in tuned.seen:
        when = ", ".join(f"{name} {level}" for name, level in seen.when.items())
        detail(f"  {when}, {tuned.tuning.key} {seen.value:g}: {seen.mean:.4g}")
    for choice in tuned.chosen:
        when = ", ".join(f"{name} {level}" for name, level in choice.when.items())
        say(f"{when}: {tuned.tuning.key} {choice.value:g}")
    say(f"Kept in {save_tuned(asked, tuned)}")
    return ExitCode.OK


def screen(study: str, out: str | None, jobs: int | None, only_plan: bool) -> ExitCode:
    """Vary the assumed numbers behind a study's answer, and draw what moves it; the exit code."""
    from dva_sim.experiments.analysis.screening import TABLE  # late: start-up
    from dva_sim.experiments.analysis.screening import screen as run_all  # late: start-up
    from dva_sim.experiments.report.figures.screening import draw_screening  # late: start-up

    asked = open_study(study)
    trials = screening_study(asked)
    folder = Path(out or folder_of_screening(study))
    say(f"[bold]{escape(trials.question)}[/bold]")
    say(f"{len(screened(asked))} assumed numbers, each within its band")
    before = dry_run(trials, folder, jobs=jobs, probe=run_job if only_plan else None)
    say(_plan(before, folder))
    if only_plan:
        say(escape(_time(before)))
        return ExitCode.OK
    try:
        with _shown("screening", before.runs) as show:
            found = run_all(asked, folder, jobs=jobs, progress=show)
    except KeyboardInterrupt as stopped:
        return _stopped(stopped)
    for line in draw_screening(asked, found, folder):
        say(escape(line))
    tell_files(folder, found.write(folder / TABLE).name)
    say(f"Kept in {found.write(file_of_screening(asked))}, which the reports of other studies cite")
    return ExitCode.OK


def plan(request: RunRequest) -> None:
    """Say what `run` would do."""
    say(escape(_time(_planned(request, _loaded(request), run_job))))


def _loaded(request: RunRequest) -> StudyPlan:
    """The plan of a study without mistakes."""
    study = request.open()
    say(f"[bold]{escape(study.question)}[/bold]")
    plan = _checked(study)
    tell_cells(study, plan.cells)
    return plan


def _checked(study: Study) -> StudyPlan:
    """Find mistakes before the first run; print a note if that takes a while."""
    count = size(study) * len(study.parts) + cells_of_repeats(study)
    if count < _MANY:
        plan = rehearse_all(study)
    else:
        say("Checking every configuration before the first run ...")
        with _shown("checking", count, "configurations") as show:
            plan = rehearse_all(study, show)
    warn([*study.lost, *why_unanswered(study), *contradictions_in(plan.cells)])
    return plan


def _planned(request: RunRequest, plan: StudyPlan, probe: Simulate | None = None) -> DryRun:
    """Say what will run."""
    if (most := runs_of(plan.study)) > _MANY_RUNS:
        say(f"Making the list of up to {most:,} runs ...")
    found = request.dry_run(plan, probe)
    if found.remark:
        say(f"[yellow]{escape(found.remark)}[/yellow]")
    say(escape(_plan(found, request.folder)))
    for remark in coverage.remarks(plan.study):
        say(escape(capital(remark)))
    return found


def _plan(found: DryRun, folder: Path) -> str:
    done = f", {found.done} of them done already" if found.done else ""
    most = f"at most {found.runs}" if found.rounds > 1 else f"{found.runs}"
    rounds = f" and up to {found.rounds} rounds" if found.rounds > 1 else ""
    return f"{most} runs in {found.cells} configurations{rounds}{done}; into {folder}"


def _time(found: DryRun) -> str:
    """Describe how long it will take, and how that was estimated."""
    if found.runs == found.done:
        return "nothing is left to run"
    failed = f"a run that was tried failed: {found.failed}" if found.failed else ""
    if found.estimate_s is None:
        return f"no estimate of the time: {failed or 'no run is done yet, and none was tried'}"
    runs = f"{_counted(found.tried, 'run')} tried now" if found.tried else "the runs done already"
    about = "more than" if found.is_least else "about"
    who = _counted(found.workers, "process", "processes")
    cpu = f" ({duration(found.cpu_s)} of CPU time)" if found.cpu_s else ""
    text = f"{about} {duration(found.estimate_s)} to go with {who}{cpu}, judged by {runs}"
    text += "; the last was stopped before its end" if found.is_least else ""
    return f"{text}; {failed}" if failed else text


def _counted(number: int, one: str, many: str | None = None) -> str:
    return f"{number} {one if number == 1 else many or f'{one}s'}"


def _report_failures(results: Results) -> int:
    failures = results.failures
    for f in failures if is_verbose() else failures[:_FEW]:
        where = f"{f['part']}, cell {f['cell']}, person {f['person']}, trial {f['trial']}"
        say(f"[red]failed:[/red] {where}: {escape(str(f['error']).splitlines()[-1])}")
    if failures:
        failed = _counted(len(failures), "run")
        problem = f"{failed} failed; repeat the same command to retry"
        print(error_line(problem), file=sys.stderr)
    return len(failures)


def _recorded(request: RunRequest, plan: StudyPlan) -> int:
    """Make the recordings that the study asks for; how many could not be made."""
    if plan.study.record is None:
        return 0
    if request.options.scheduler is not None:
        say("Recordings are made on this machine, from the same seeds")
    with _shown("recording", 0) as show:
        problems = request.record(plan, show)
    for problem in problems if is_verbose() else problems[:_FEW]:
        say(f"[red]not recorded:[/red] {escape(problem)}")
    if problems:
        failed = _counted(len(problems), "run")
        print(error_line(f"{failed} could not be recorded"), file=sys.stderr)
    return len(problems)


def _stopped(how: KeyboardInterrupt) -> ExitCode:
    """Say what was done, and the command that goes on."""
    say(f"Stopped: {how}" if str(how) else "Stopped.")
    say(f"To resume: {escape(shlex.join(['dva-sim', *sys.argv[1:]]))}")
    return ExitCode.INTERRUPTED


# --- progress --------------------------------------------------------------------------
@contextmanager
def _shown(what: str, total: int, things: str = "runs") -> Iterator[Callable[[int, int], None]]:
    """A bar on a terminal; elsewhere a line now and then."""
    pace = RunPace(time.monotonic, things)
    if not console.is_terminal:
        yield _Lines(console, pace).show
        return
    columns = (TextColumn(what), BarColumn(), TextColumn("{task.fields[pace]}"))
    with Progress(*columns, console=console) as bar:
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
    """In the units that people would say it in."""
    if seconds < 90:
        return f"{seconds:.0f} s"
    if seconds < 90 * _MINUTE_S:
        return f"{seconds / _MINUTE_S:.0f} min"
    hours, rest = divmod(round(seconds / _MINUTE_S), _MINUTE_S)
    return f"{hours} h {rest} min"
