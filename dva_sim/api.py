"""What the command line does, for programs and notebooks: `import dva_sim; dva_sim.run(...)`.

Commands and options have the same names, and the results are the same bytes; a limit in seconds
is `limit_s`, and `--dry-run` a function. Only `show` prints, so nothing is quiet, verbose or JSON;
mistakes are `DvaSimError`. A script needs no `if __name__ == "__main__"` around it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dva_sim.experiments.analysis.compare import Comparison as Comparison
from dva_sim.experiments.execution.checkpoint import load_so_far
from dva_sim.experiments.execution.dry_run import rehearse_all
from dva_sim.experiments.execution.scheduling import run_job
from dva_sim.experiments.results.results import Frame, frame_of, plain
from dva_sim.experiments.results.results import Results as ResultsData
from dva_sim.experiments.study.loading import Settings, pairs_of, write_study
from dva_sim.experiments.study.registration import register as write_down
from dva_sim.experiments.study.registration import registration_of
from dva_sim.experiments.study.tuning import folder_of_tuning, save_tuned
from dva_sim.kernel.errors import RunsFailed
from dva_sim.kernel.suggestions import listed
from dva_sim.simulation.full import Recording
from dva_sim.simulation.full.measures import track_rows
from dva_sim.simulation.models import AnyScenario, Tables, model_for
from dva_sim.testing.file_kinds import mistakes_of, open_study

if TYPE_CHECKING:
    from collections.abc import Callable

    from dva_sim.experiments.analysis.answer import Answer
    from dva_sim.experiments.execution.dry_run import DryRun
    from dva_sim.experiments.execution.runner import RunRequest
    from dva_sim.experiments.report.summary import Reading
    from dva_sim.experiments.study.cell_grid import DesignCell
    from dva_sim.experiments.study.registration import Preregistration
    from dva_sim.experiments.study.study import Study
    from dva_sim.experiments.study.tuning import TunedValues
    from dva_sim.recordings.pictures import Wanted


@dataclass(frozen=True)
class Episode:
    """One run of one scenario.

    Attributes:
        scenario: As it was run.
        seed: Of its luck.
        tables: Its rows as columns, by table: `runs`, `events`, ...
    """

    scenario: AnyScenario
    seed: int
    tables: dict[str, Frame]

    @property
    def warnings(self) -> list[str]:
        """What in the scenario does not go together, each in a sentence."""
        return model_for(self.scenario).contradictions(self.scenario)

    @property
    def measures(self) -> dict[str, Any]:
        """The one row of the table of runs."""
        return {name: values.tolist()[0] for name, values in self.tables["runs"].items()}

    def __repr__(self) -> str:
        """What came out of it, and what to ask it for."""
        told = {name: plain(value) for name, value in self.measures.items()}
        some = listed(f"{name} {value}" for name, value in told.items() if value)
        tables = ", ".join(f"{name} ({table.rows})" for name, table in self.tables.items())
        head = f"Episode of a {self.scenario.model} scenario, seed {self.seed}"
        return "\n".join((head, f"measures: {some}", f"tables: {tables}"))

    def _repr_html_(self) -> str:
        meaning = {c.name: c.meaning for c in model_for(self.scenario).columns["runs"]}
        rows = [
            f"<tr><td>{escape(name)}</td><td>{escape(plain(value))}</td>"
            f"<td>{escape(meaning.get(name, ''))}</td></tr>"
            for name, value in self.measures.items()
        ]
        return f"<table>{''.join(rows)}</table>"


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
        scenario: By name or path.
        seed: Of its luck.
        set: Keys to change, as a mapping or as `key=value` pairs.
        video: Write a film: `.gif` or `.mp4`.
        still: Write one moment: `.png`, `.pdf` or `.svg`.
        strip: Write several moments in one figure, likewise.
        at: Moment of the still, or moments of the strip [s].
        panels: Moments in a strip.
        camera: The still shows what this robot's camera sees.
        inset: Show in the film what a robot's camera sees.
        side_by_side: Run and draw the same seed under two patterns; the episode is that of the
            first.
        record: Keep the run as a file: `.mcap`.
        overwrite: Replace a recording that is there.

    Raises:
        ConfigError: there is none, it is not valid with these changes, or it cannot be drawn so.
    """
    from dva_sim.experiments.report.episode import EpisodeRequest  # late: start-up

    pairs = pairs_of(set)
    with mistakes_of(str(scenario), pairs, seed):
        request = EpisodeRequest(
            str(scenario),
            seed,
            pairs,
            side_by_side=None if side_by_side is None else _joined(side_by_side),
            pictures=_wanted(video, still, strip, at, panels, camera, inset),
            record=None if record is None else Path(record),
            overwrite=overwrite,
        )
        runs = [request.play(each) for each in request.scenarios()]
        list(request.write(runs))
    run, kept = runs[0], runs[0].kept
    tracks = {"tracks": track_rows(kept)} if isinstance(kept, Recording) else {}
    return _episode(run.scenario, seed, run.tables | tracks)


def _episode(scenario: AnyScenario, seed: int, tables: Tables) -> Episode:
    return Episode(scenario, seed, {name: frame_of(rows) for name, rows in tables.items()})


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
) -> Episode:
    """A recorded run from its file alone, drawn or taken to ROS 2 if asked to; see `episode`.

    Raises:
        ConfigError: not a recording, or what is asked for is not in it.
    """
    from dva_sim.experiments.report.episode import open_recording, write_replay  # late: start-up

    wanted = _wanted(video, still, strip, at, panels, camera, inset)
    opened = open_recording(Path(file), wanted)
    list(write_replay(opened, wanted, None if ros2 is None else Path(ros2)))
    return _episode(opened.playback.scenario, opened.playback.seed, opened.tables or {})


def _wanted(
    video: str | Path | None,
    still: str | Path | None,
    strip: str | Path | None,
    at: float | str | Sequence[float] | None,
    panels: int,
    camera: str | None,
    inset: bool,
) -> Wanted:
    from dva_sim.recordings.pictures import Wanted  # late: start-up

    film, moment, moments = (None if p is None else Path(p) for p in (video, still, strip))
    times = None if at is None else _joined(at)
    return Wanted(film, moment, moments, times, panels, camera, inset)


def _joined(words: object) -> str:
    """One word or number, or several, as on the command line."""
    several = words if isinstance(words, list | tuple) else [words]
    return ",".join(map(str, several))


class Results(ResultsData):
    """What a study left behind, and what it says."""

    _offers = "answer, failures, machine, report()"

    @cached_property
    def reading(self) -> Reading:
        """What the runs say, in words and tables."""
        from dva_sim.experiments.report.summary import Reading  # late: start-up

        return Reading(self)

    @property
    def answer(self) -> Answer:
        """The answer to the question in words, with its interval, and what must be known of it."""
        return self.reading.answer

    def report(self) -> Path:
        """Make `report.html` and `figures/` in the folder.

        Raises:
            DvaSimError: the disk is full or refuses to be written.
        """
        return report(self)

    def _repr_html_(self) -> str:
        """What a notebook shows: question, answer, and how many runs stand behind it."""
        depends = (f"{about}: {words}" for about, words in self.answer.depends.items())
        notes = "".join(f"<p>{escape(note)}</p>" for note in (*depends, *self.answer.notes))
        failed = f", {len(self.failures)} failed" if self.failures else ""
        runs = f"<p>{self.runs.rows} runs{failed}, in {escape(str(self.folder))}</p>"
        lead = f"<p><b>{escape(self.answer.lead)}</b></p>"
        return f"<h3>{escape(self.question)}</h3>{lead}{notes}{runs}"


Folder = ResultsData | str | Path


def run(
    study: str | Path,
    out: str | Path | None = None,
    *,
    set: Settings = (),
    seed: int | None = None,
    quick: bool = False,
    full: bool = False,
    pilot: int | None = None,
    jobs: int | None = None,
    scheduler: str | None = None,
    limit_s: float = 600.0,
    progress: Callable[[int, int], object] | None = None,
    report: bool = True,
) -> Results:
    """Run a study, or go on with one that was interrupted, and write its report.

    Args:
        study: By name or path.
        out: Results folder; by default `results/` and the study's name.
        set: Keys to change, as a mapping or as `key=value` pairs.
        seed: Of the whole study, instead of its own.
        quick: The study's small version.
        full: The study's larger version.
        pilot: Only so many persons, with random seeds that the study itself never uses.
        jobs: Processes of this machine; by default one for each core.
        scheduler: Address of a dask.distributed cluster to use instead; recordings are made here.
        limit_s: A run that takes longer, by the wall clock, has failed.
        progress: Called with the number of runs done and of all runs, as they finish.
        report: Whether to write the report.

    Returns:
        What came out; `failures` tells of runs that failed.

    Raises:
        DvaSimError: a mistake in what was asked for, a disk that is full, or runs that should be
            kept as recordings and could not.
        KeyboardInterrupt: the finished runs are kept, and the same call goes on.
    """
    from dva_sim.experiments.report.figures.registry import load_figures  # late: start-up
    from dva_sim.experiments.report.report import write_report  # late: start-up

    request = _request(
        study,
        out,
        pairs_of(set, seed),
        quick=quick,
        full=full,
        pilot=pilot,
        jobs=jobs,
        scheduler=scheduler,
        limit_s=limit_s,
    )
    asked, cells = _rehearsed(request)
    figures = load_figures(asked.figures, asked.folder)
    request.run(asked, cells, progress)
    problems = request.record(asked)
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
    quick: bool = False,
    full: bool = False,
    pilot: int | None = None,
    jobs: int | None = None,
) -> DryRun:
    """What `run` would do, and how long it would take; a few runs are tried if none is done yet.

    Raises:
        DvaSimError: a mistake in what was asked for.
    """
    request = _request(
        study, out, pairs_of(set, seed), quick=quick, full=full, pilot=pilot, jobs=jobs
    )
    asked, cells = _rehearsed(request)
    return request.plan(asked, cells, run_job)


def _request(
    study: str | Path, out: str | Path | None, pairs: list[str], **options: Any
) -> RunRequest:
    from dva_sim.experiments.execution.runner import RunRequest  # late: start-up

    return RunRequest(study, None if out is None else Path(out), pairs, **options)


def _rehearsed(request: RunRequest) -> tuple[Study, list[DesignCell]]:
    """A study without mistakes, and its configurations."""
    asked = open_study(request.study, request.changes, version=request.version, pilot=request.pilot)
    return asked, rehearse_all(asked)


def new(name: str | Path) -> Path:
    """Write a study to begin with, which runs as it stands; its file.

    Raises:
        DvaSimError: there is such a file, or it cannot be written.
    """
    return write_study(str(name))


def register(study: str | Path, *, full: bool = False, again: bool = False) -> Preregistration:
    """Fix a study's hypotheses and size before it is run; the run then confirms or refutes them.

    Args:
        study: By name or path.
        full: Its larger version.
        again: In place of an earlier registration; it will be told.

    Raises:
        DvaSimError: nothing to register, a size left open, or a registration that is there.
    """
    asked = open_study(study, version="full" if full else None)
    write_down(asked, again)
    found = registration_of(asked)
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

    Raises:
        DvaSimError: the study tunes nothing, or runs failed.
    """
    from dva_sim.experiments.analysis.tuning import tune as try_all  # late: start-up

    asked = open_study(study)
    folder = Path(out) if out is not None else folder_of_tuning(str(study))
    tuned = try_all(asked, folder, jobs=jobs, progress=progress)
    save_tuned(asked, tuned)
    return tuned


def report(folder: Folder, *, pdf: bool = False, figure: str | Sequence[str] = ()) -> Path:
    """Make the report of a results folder again, or of a study under way so far; its page.

    Args:
        folder: Of the results.
        pdf: Make `report.pdf` too.
        figure: A figure of one's own, such as `mine.py:Mine`, or several.

    Raises:
        DvaSimError: no results there, no such figure, or a disk that cannot be written.
    """
    from dva_sim.experiments.report.figures.registry import load_figures  # late: start-up
    from dva_sim.experiments.report.report import write_report  # late: start-up

    path = folder.folder if isinstance(folder, ResultsData) else Path(folder)
    wanted = [figure] if isinstance(figure, str) else figure
    return write_report(path, pdf, figures=load_figures(wanted))


def show(
    folder: Folder, *, table: str | None = None, rows: int = 20, columns: bool = False
) -> None:
    """Print what results hold: the answer and every cell, a table, or what columns mean.

    Of a study under way it is what is known so far.

    Raises:
        ConfigError: no results there, or no such table.
    """
    from dva_sim.experiments.report import terminal  # late: start-up

    terminal.show(_so_far(folder), table, columns, rows)


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
        folder: Of the results.
        out: `X.csv` or `X.parquet` for one table, or a folder.
        table: Only this one, or these.
        format: `csv` or `parquet`, in a folder.
        overwrite: Replace what is there.

    Raises:
        DvaSimError: no such table or format, a file that is there, or one that cannot be written.
    """
    from dva_sim.experiments.results.export import export as write  # late: start-up

    tables = [table] if isinstance(table, str) else table
    return write(_results(folder), Path(out), tables, format, overwrite)


def load(folder: str | Path) -> Results:
    """Open a results folder.

    Raises:
        ConfigError: it is not one, or its study has not been completed.
    """
    return Results.load(folder)


def compare(first: Folder, second: Folder) -> Comparison:
    """Two results, or their folders, side by side: what the second has otherwise.

    `frame(measure, by)` tells it as columns, and `judge(fail_if)` what a gate makes of it.

    Raises:
        ConfigError: one is no results folder, or they have no configuration in common.
    """
    return Comparison(_results(first), _results(second))


def _so_far(folder: Folder) -> ResultsData:
    return folder if isinstance(folder, ResultsData) else load_so_far(folder)


def _results(folder: Folder) -> ResultsData:
    return folder if isinstance(folder, ResultsData) else load(folder)
