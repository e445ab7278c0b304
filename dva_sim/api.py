"""Python interface to the commands: `import dva_sim; dva_sim.run(...)`.

A command takes the parameters of the function of its name with their defaults; how they look on a
command line stands in `cli/options.py`, whose help is the first sentence of the words here. The
results are the same bytes. Only `show` prints, so nothing is quiet, verbose or JSON, and
`--dry-run` is a function; mistakes are `DvaSimError`. A script needs no
`if __name__ == "__main__"` around it.

Implementations are imported when called, since every command begins with this module.
"""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dva_sim.kernel.errors import RunsFailed

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from dva_sim.experiments.analysis.compare import Comparison as Comparison
    from dva_sim.experiments.execution.dry_run import DryRun
    from dva_sim.experiments.execution.runner import RunRequest
    from dva_sim.experiments.report.notebook import Episode as Episode
    from dva_sim.experiments.report.notebook import Results as Results
    from dva_sim.experiments.results.results import Results as ResultsData
    from dva_sim.experiments.study.loading import Settings
    from dva_sim.experiments.study.plan import StudyPlan
    from dva_sim.experiments.study.registration import Preregistration
    from dva_sim.experiments.study.tuning import TunedValues

    Folder = ResultsData | str | Path
else:
    _CLASSES = {
        "Comparison": "dva_sim.experiments.analysis.compare",
        "Episode": "dva_sim.experiments.report.notebook",
        "Results": "dva_sim.experiments.report.notebook",
    }

    def __getattr__(name: str) -> Any:
        """The classes of what functions return."""
        if name not in _CLASSES:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        return getattr(import_module(_CLASSES[name]), name)


def episode(
    scenario: str | Path,
    seed: int = 1,
    *,
    set: Settings = (),
    video: str | Path | None = None,
    still: str | Path | None = None,
    strip: str | Path | None = None,
    at: float | str | Sequence[float] | None = None,
    panels: int = 6,
    camera: str | None = None,
    inset: bool = False,
    side_by_side: str | Sequence[str] | None = None,
    record: str | Path | None = None,
    overwrite: bool = False,
) -> Episode:
    """Run one scenario once, and draw or keep it if asked to.

    Args:
        scenario: A scenario by name or path.
        seed: The run's random seed.
        set: Change a key. Or several: a mapping, or `key=value` pairs.
        video: Write a film: `.gif` or `.mp4`.
        still: Draw one moment: `.png`, `.pdf` or `.svg`.
        strip: Draw several moments in one figure: .png, .pdf or .svg.
        at: Time of the still, or times of the strip: 10,20,30. In seconds, also as numbers.
        panels: Number of moments in a strip.
        camera: The still shows what this robot's camera sees.
        inset: Show in the film what a robot's camera sees.
        side_by_side: Run the same seed under two patterns. The episode is that of the first.
        record: Record the run in a file: `.mcap`, for replay and viewers.
        overwrite: Overwrite existing files.

    Raises:
        ConfigError: there is none, it is not valid with these changes, or it cannot be drawn so.
    """
    asked = locals().copy()
    from dva_sim.experiments.report.episode import EpisodeRequest  # late: start-up
    from dva_sim.experiments.report.notebook import episode_of  # late: start-up
    from dva_sim.experiments.study.scenario_mistakes import mistakes_of  # late: start-up

    request = EpisodeRequest.of(**asked)
    with mistakes_of(request.scenario, request.changes, seed):
        runs = [request.play(each) for each in request.scenarios()]
        list(request.write(runs))
    return episode_of(runs[0].scenario, seed, runs[0].tables, runs[0].kept)


def replay(
    file: str | Path,
    *,
    video: str | Path | None = None,
    still: str | Path | None = None,
    strip: str | Path | None = None,
    at: float | str | Sequence[float] | None = None,
    panels: int = 6,
    camera: str | None = None,
    inset: bool = False,
    ros2: str | Path | None = None,
    mcap: str | Path | None = None,
) -> Episode:
    """A recorded run from its file alone, drawn or taken to ROS 2 if asked to.

    Args:
        file: A recording: `.mcap`, or the `.mcap.part` that a killed run left.
        video: Write a film: `.gif` or `.mp4`.
        still: Draw one moment: `.png`, `.pdf` or `.svg`.
        strip: Draw several moments in one figure: .png, .pdf or .svg.
        at: Time of the still, or times of the strip: 10,20,30. In seconds, also as numbers.
        panels: Number of moments in a strip.
        camera: The still shows what this robot's camera sees.
        inset: Show in the film what a robot's camera sees.
        ros2: Write a ROS 2 bag to a new folder.
        mcap: Turn an `.mcap.part` into a complete recording in a new file.

    Raises:
        ConfigError: not a recording, or what is asked for is not in it.
    """
    from dva_sim.experiments.report.episode import open_recording, write_replay  # late: start-up
    from dva_sim.experiments.report.notebook import episode_of  # late: start-up
    from dva_sim.live.recorded_lines import readable  # late: start-up
    from dva_sim.recordings.pictures import Wanted  # late: start-up

    wanted = Wanted.of(video, still, strip, at, panels=panels, camera=camera, inset=inset)
    bag, kept = (None if to is None else Path(to) for to in (ros2, mcap))
    with readable(Path(file), kept) as found:
        opened = open_recording(found, wanted)
        list(write_replay(opened, wanted, bag))
    return episode_of(opened.playback.scenario, opened.playback.seed, opened.tables or {})


def run(
    study: str | Path,
    out: str | Path | None = None,
    *,
    set: Settings = (),
    seed: int | None = None,
    jobs: int | None = None,
    scheduler: str | None = None,
    limit_s: float = 600,
    quick: bool = False,
    full: bool = False,
    pilot: int | None = None,
    progress: Callable[[int, int], object] | None = None,
    report: bool = True,
) -> Results:
    """Run or resume a study and write its report.

    Args:
        study: A study, by name or path.
        out: Results folder; default: `results/STUDY`.
        set: Change a key. Or several: a mapping, or `key=value` pairs.
        seed: Random seed of the whole study. In place of its own.
        jobs: Number of processes; default: one for each core.
        scheduler: Use a dask.distributed cluster instead. Its address; recordings are made here.
        limit_s: Treat a run that takes longer as failed. By the wall clock [s].
        quick: The study's small version.
        full: The study's larger version.
        pilot: Run only this many persons, with a random seed of their own. The study never uses it.
        progress: Called with the number of runs done and of all runs, as they finish.
        report: True to write the report.

    Returns:
        What came out; `failures` tells of runs that failed.

    Raises:
        DvaSimError: a mistake in what was asked for, a disk that is full, or runs that should be
            kept as recordings and could not.
        KeyboardInterrupt: the finished runs are kept, and the same call goes on.
    """
    asked = locals().copy()
    from dva_sim.experiments.execution.runner import RunRequest  # late: start-up
    from dva_sim.experiments.report.figures.registry import load_figures  # late: start-up
    from dva_sim.experiments.report.report import write_report  # late: start-up

    del asked["progress"], asked["report"]
    request = RunRequest(**asked)
    plan = _rehearsed(request)
    figures = load_figures(plan.study.figures, plan.study.folder)
    request.run(plan, progress)
    problems = request.record(plan)
    results = load(request.folder)
    if report:
        write_report(request.folder, figures=figures)
    if problems:
        raise RunsFailed(f"{request.folder}: {'; '.join(problems)}; the results are complete")
    return results


def dry_run(
    study: str | Path,
    out: str | Path | None = None,
    *,
    set: Settings = (),
    seed: int | None = None,
    jobs: int | None = None,
    quick: bool = False,
    full: bool = False,
    pilot: int | None = None,
) -> DryRun:
    """Preview `run` and its duration; if no run is done yet, a few are tried.

    Raises:
        DvaSimError: a mistake in what was asked for.
    """
    asked = locals().copy()
    from dva_sim.experiments.execution.runner import RunRequest  # late: start-up
    from dva_sim.experiments.execution.scheduling import run_job  # late: start-up

    request = RunRequest(**asked)
    return request.dry_run(_rehearsed(request), run_job)


def _rehearsed(request: RunRequest) -> StudyPlan:
    """The plan of a study without mistakes."""
    from dva_sim.experiments.execution.dry_run import rehearse_all  # late: start-up
    from dva_sim.experiments.study.file_kinds import open_study  # late: start-up

    return rehearse_all(
        open_study(request.study, request.changes, version=request.version, pilot=request.pilot)
    )


def new(name: str | Path) -> Path:
    """Write a study to begin with, which runs as it stands; its file.

    Args:
        name: Name or path of the new study.

    Raises:
        DvaSimError: there is such a file, or it cannot be written.
    """
    from dva_sim.experiments.study.loading import write_study  # late: start-up

    return write_study(str(name))


def register(study: str | Path, *, full: bool = False, again: bool = False) -> Preregistration:
    """Fix a study's hypotheses and size before it is run; the run then confirms or refutes them.

    Args:
        study: A study, by name or path.
        full: The study's larger version.
        again: Replace an earlier registration; the report will say so.

    Raises:
        DvaSimError: nothing to register, a size left open, or a registration that is there.
    """
    from dva_sim.experiments.study import registration  # late: start-up
    from dva_sim.experiments.study.file_kinds import open_study  # late: start-up

    asked = open_study(study, version="full" if full else None)
    registration.register(asked, again)
    found = registration.registration_of(asked)
    assert found is not None
    return found


def tune(
    study: str | Path,
    out: str | Path | None = None,
    *,
    jobs: int | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> TunedValues:
    """Choose what a study has tuned, on persons who take no part in it, and keep it beside it.

    Args:
        study: A study, by name or path.
        out: Folder of the trials; default: `results/STUDY-tuning`.
        jobs: Number of processes; default: one for each core.
        progress: Called with the number of trials done and of all trials, as they finish.

    Raises:
        DvaSimError: the study tunes nothing, or runs failed.
    """
    from dva_sim.experiments.analysis import tuning  # late: start-up
    from dva_sim.experiments.study.file_kinds import open_study  # late: start-up
    from dva_sim.experiments.study.tuning import folder_of_tuning, save_tuned  # late: start-up

    asked = open_study(study)
    folder = Path(out or folder_of_tuning(str(study)))
    tuned = tuning.tune(asked, folder, jobs=jobs, progress=progress)
    save_tuned(asked, tuned)
    return tuned


def report(folder: Folder, *, pdf: bool = False, figure: str | Sequence[str] = ()) -> Path:
    """Make the report of a results folder again, or of a study under way so far; its page.

    Args:
        folder: A results folder.
        pdf: Also print it as PDF, using Chromium. Chrome works too; no other browser is tried.
        figure: Add a figure of your own. Such as `mine.py:Mine`, or several.

    Raises:
        DvaSimError: no results there, no such figure, no browser that prints, or a disk that cannot
            be written.
    """
    from dva_sim.experiments.report.figures.registry import load_figures  # late: start-up
    from dva_sim.experiments.report.report import write_report  # late: start-up

    path = Path(folder) if isinstance(folder, str | Path) else folder.folder
    return write_report(path, pdf, figures=load_figures(_several(figure)))


def show(
    folder: Folder, *, table: str | None = None, rows: int = 20, columns: bool = False
) -> ResultsData:
    """Print the answer and every cell of results, a table, or its columns; return the results.

    For a running study, the results so far are shown.

    Args:
        folder: A results folder.
        table: Show the rows of a table.
        rows: Number of rows to print.
        columns: Explain the columns of one table or all.

    Raises:
        ConfigError: no results there, or no such table.
    """
    from dva_sim.experiments.execution.checkpoint import load_so_far  # late: start-up
    from dva_sim.experiments.report import terminal  # late: start-up

    results = load_so_far(folder) if isinstance(folder, str | Path) else folder
    terminal.show(results, table, columns, rows)
    return results


def export(
    folder: Folder,
    out: str | Path,
    *,
    table: str | Sequence[str] = (),
    format: str | None = None,
    overwrite: bool = False,
) -> list[Path]:
    """Write tables of results for other programs, with what their columns mean; the files.

    Args:
        folder: A results folder.
        out: `X.csv` or `X.parquet` for one table, or a folder.
        table: Export only this table. Or these.
        format: Format of tables in a folder; default: csv. Or `parquet`.
        overwrite: Overwrite existing files.

    Raises:
        DvaSimError: no such table or format, a file that is there, or one that cannot be written.
    """
    from dva_sim.experiments.results import export  # late: start-up

    return export.export(_results(folder), Path(out), _several(table), format, overwrite)


def load(folder: str | Path) -> Results:
    """Open a results folder.

    Raises:
        ConfigError: it is not one, or its study has not been completed.
    """
    from dva_sim.experiments.execution.kept_run import complete  # late: start-up
    from dva_sim.experiments.report.notebook import Results  # late: start-up

    complete(Path(folder))
    return Results.load(folder)


def compare(first: Folder, second: Folder) -> Comparison:
    """Two results, or their folders, side by side: what the second has otherwise.

    `frame(measure, by)` tells it as columns, and `judge(fail_if)` what a gate makes of it.

    Args:
        first: A results folder.
        second: The results folder to compare with it.

    Raises:
        ConfigError: one is no results folder, or they have no configuration in common.
    """
    from dva_sim.experiments.analysis.compare import Comparison  # late: start-up

    return Comparison(_results(first), _results(second))


def _results(folder: Folder) -> ResultsData:
    return load(folder) if isinstance(folder, str | Path) else folder


def _several(given: str | Sequence[str]) -> Sequence[str]:
    return [given] if isinstance(given, str) else given
