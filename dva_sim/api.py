"""Python interface to the commands: `import dva_sim; dva_sim.run(...)`.

A function takes the options of the command of its name, each as a keyword; what they mean is
declared once, in `dva_sim.options`. The results are the same bytes. Only `show` prints, so nothing
is quiet, verbose or JSON, and `--dry-run` is a function; mistakes are `DvaSimError`. A script needs
no `if __name__ == "__main__"` around it.

Implementations are imported when called, since every command begins with this module.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar, cast

from dva_sim.kernel.errors import ConfigError, RunsFailed
from dva_sim.kernel.retired import use_now
from dva_sim.options.forms import documented, make_signature
from dva_sim.options.runs import EpisodeOptions, ReplayOptions
from dva_sim.options.studies import (
    CompareOptions,
    ExportOptions,
    Folder,
    NewOptions,
    RegisterOptions,
    ReportOptions,
    RunOptions,
    ShowOptions,
    TuneOptions,
)

if TYPE_CHECKING:
    from dva_sim.experiments.analysis.compare import Comparison as Comparison
    from dva_sim.experiments.execution.dry_run import DryRun
    from dva_sim.experiments.report.notebook import Episode as Episode
    from dva_sim.experiments.report.notebook import Results as Results
    from dva_sim.experiments.results.results import Results as ResultsData
    from dva_sim.experiments.study.registration import Preregistration
    from dva_sim.experiments.study.tuning import TunedValues
else:
    _CLASSES = {
        "Comparison": "dva_sim.experiments.analysis.compare",
        "Episode": "dva_sim.experiments.report.notebook",
        "Results": "dva_sim.experiments.report.notebook",
    }

    def __getattr__(name: str) -> Any:
        """Return the classes of what functions return."""
        if name not in _CLASSES:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        return getattr(import_module(_CLASSES[name]), name)


P = ParamSpec("P")
Options = TypeVar("Options")
T = TypeVar("T")


def _with(options: Callable[P, Options]) -> Callable[[Callable[[Options], T]], Callable[P, T]]:
    """Give a function of a class of options the parameters of that class, and their words.

    A retired one is refused as on the command line: with what to use now.
    """

    def give(function: Callable[[Options], T]) -> Callable[P, T]:
        @wraps(function)
        def called(*args: P.args, **kwargs: P.kwargs) -> T:
            for name in kwargs:
                if instead := use_now("option", f"--{name}"):
                    raise ConfigError(instead)
            return function(options(*args, **kwargs))

        about: Any = called
        about.__doc__ = documented(function.__doc__ or "", options)
        about.__signature__ = make_signature(options, function.__annotations__["return"])
        return called

    return give


@_with(EpisodeOptions)
def episode(options: EpisodeOptions) -> Episode:
    """Run one scenario once, and draw or keep it if asked to.

    Raises:
        ConfigError: there is none, it is not valid with these changes, or it cannot be drawn so.
    """
    from dva_sim.experiments.report.episode import EpisodeRequest  # late: start-up
    from dva_sim.experiments.report.notebook import episode_of  # late: start-up
    from dva_sim.experiments.study.scenario_mistakes import mistakes_of  # late: start-up

    request = EpisodeRequest(options)
    seed = options.seed
    with mistakes_of(request.scenario, request.changes, seed):
        runs = [request.play(each) for each in request.scenarios()]
        list(request.write(runs))
    return episode_of(runs[0].scenario, seed, runs[0].tables, runs[0].kept)


@_with(ReplayOptions)
def replay(options: ReplayOptions) -> Episode:
    """Play a recorded run from its file alone; draw it or take it to ROS 2 if asked to.

    Raises:
        ConfigError: not a recording, or what is asked for is not in it.
    """
    from dva_sim.experiments.report.episode import open_recording, write_replay  # late: start-up
    from dva_sim.experiments.report.notebook import episode_of  # late: start-up
    from dva_sim.live.recorded_lines import readable  # late: start-up
    from dva_sim.recordings.pictures import Wanted  # late: start-up

    pictures = Wanted.of(options)
    bag, recording_copy = (None if to is None else Path(to) for to in (options.ros2, options.mcap))
    with readable(Path(options.file), recording_copy) as recording:
        opened = open_recording(recording, pictures)
        list(write_replay(opened, pictures, bag))
    return episode_of(opened.playback.scenario, opened.playback.seed, opened.tables or {})


@_with(RunOptions)
def run(options: RunOptions) -> Results:
    """Run or resume a study and write its report.

    Returns:
        What came out; `failures` tells of runs that failed.

    Raises:
        DvaSimError: invalid arguments, a disk that is full, or runs that should be
            kept as recordings and could not.
        KeyboardInterrupt: the finished runs are kept, and the same call goes on.
    """
    from dva_sim.experiments.runner import run_study  # late: start-up

    outcome = run_study(options)
    results = load(outcome.results.folder)
    if outcome.unrecorded:
        problems = "; ".join(outcome.unrecorded)
        raise RunsFailed(f"{results.folder}: {problems}; the results are complete")
    return results


@_with(RunOptions)
def dry_run(options: RunOptions) -> DryRun:
    """Preview `run` and its duration; if no run is done yet, a few are tried.

    Raises:
        DvaSimError: invalid arguments.
    """
    from dva_sim.experiments.execution.dry_run import dry_run as preview  # late: start-up
    from dva_sim.experiments.execution.scheduling import run_job  # late: start-up
    from dva_sim.experiments.runner import StudyListener, planned_study  # late: start-up

    plan = planned_study(options, StudyListener())
    jobs = options.jobs if options.scheduler is None else 1  # nobody knows how many are free there
    return preview(plan, options.results_folder, jobs=jobs, probe=run_job)


@_with(NewOptions)
def new(options: NewOptions) -> Path:
    """Write a template study that runs as it stands; return its file.

    Raises:
        DvaSimError: there is such a file, or it cannot be written.
    """
    from dva_sim.experiments.study.loading import write_study  # late: start-up

    return write_study(str(options.name))


@_with(RegisterOptions)
def register(options: RegisterOptions) -> Preregistration:
    """Fix a study's hypotheses and size before it is run; the run then confirms or refutes them.

    Raises:
        DvaSimError: nothing to register, a size left open, or a registration that is there.
    """
    from dva_sim.experiments.study import registration  # late: start-up
    from dva_sim.experiments.study.file_kinds import open_study  # late: start-up

    study = open_study(options.study, version="full" if options.full else None)
    registration.register(study, options.again)
    registered = registration.registration_of(study)
    assert registered is not None
    return registered


@_with(TuneOptions)
def tune(options: TuneOptions) -> TunedValues:
    """Tune what a study leaves to be tuned, on persons of their own, and save the choice.

    Raises:
        DvaSimError: the study tunes nothing, or runs failed.
    """
    from dva_sim.experiments import trials  # late: start-up
    from dva_sim.experiments.study.file_kinds import open_study  # late: start-up
    from dva_sim.experiments.study.tuning import folder_of_tuning, save_tuned  # late: start-up

    study = open_study(options.study)
    folder = Path(options.out or folder_of_tuning(str(options.study)))
    tuned = trials.tune(study, folder, jobs=options.jobs, progress=options.progress)
    save_tuned(study, tuned)
    return tuned


@_with(ReportOptions)
def report(options: ReportOptions) -> Path:
    """Write the report of a results folder again, also of a running study; return its page.

    Raises:
        DvaSimError: no results there, no browser that prints, or a disk that cannot
            be written.
    """
    from dva_sim.experiments.report.report import write_report  # late: start-up

    folder = options.folder
    path = Path(folder) if isinstance(folder, str | Path) else folder.folder
    return write_report(path, options.pdf)


@_with(ShowOptions)
def show(options: ShowOptions) -> ResultsData:
    """Print the answer and every cell of results, a table, or its columns; return the results.

    For a running study, the results so far are shown.

    Raises:
        ConfigError: no results there, or no such table.
    """
    from dva_sim.experiments.execution.checkpoint import load_so_far  # late: start-up
    from dva_sim.experiments.report import terminal  # late: start-up

    folder = options.folder
    results = load_so_far(folder) if isinstance(folder, str | Path) else cast("ResultsData", folder)
    terminal.show(results, options.table, options.columns, options.rows)
    return results


@_with(ExportOptions)
def export(options: ExportOptions) -> list[Path]:
    """Write tables of results for other programs, with what their columns mean; the files.

    Raises:
        DvaSimError: no such table or format, a file that is there, or one that cannot be written.
    """
    from dva_sim.experiments.results import export  # late: start-up

    results = _results(options.folder)
    out = Path(options.out)
    tables = [options.table] if isinstance(options.table, str) else options.table
    return export.export(results, out, tables, options.format, options.overwrite)


def load(folder: str | Path) -> Results:
    """Open a results folder.

    Raises:
        ConfigError: it is not one, or its study has not been completed.
    """
    from dva_sim.experiments.execution.kept_run import complete  # late: start-up
    from dva_sim.experiments.report.notebook import Results  # late: start-up

    complete(Path(folder))
    return Results.load(folder)


@_with(CompareOptions)
def compare(options: CompareOptions) -> Comparison:
    """Return two results, or their folders, side by side: what the second has otherwise.

    `frame(measure, by)` tells it as columns, and `judge(fail_if)` what a gate makes of it.

    Raises:
        ConfigError: one is no results folder, or they have no configuration in common.
    """
    from dva_sim.experiments.analysis.compare import Comparison  # late: start-up

    return Comparison(_results(options.first), _results(options.second))


def _results(folder: Folder) -> ResultsData:
    return load(folder) if isinstance(folder, str | Path) else cast("ResultsData", folder)
