"""The commands that make results: demo, run, new, register, tune."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Annotated

import typer
from typer import Option

from dva_sim.cli.options import Jobs, Quiet, Results, Sets, StudyName, Verbose, count, number
from dva_sim.cli.verbosity import loudness


def demo(
    out: Annotated[
        Path,
        Option("-o", "--out", metavar="FOLDER", help="Where pictures, film and report go."),
    ] = Path("results/demo"),
    jobs: Jobs = None,
) -> None:
    """See in about a minute what delay and a messaging pattern do.

    It shows one drive under two patterns, as a picture, a story and a film, then runs the small
    version of the main study and writes its report.

    Examples:
        dva-sim demo -o first  # into a folder of your own, in place of results/demo
    """
    from dva_sim.cli.demo import demo as show_it  # late: start-up

    raise typer.Exit(show_it(out, jobs))


def run(
    study: StudyName,
    out: Results = None,
    set_: Sets = None,
    seed: Annotated[int | None, count("Random seed of the whole study.", "--seed")] = None,
    jobs: Jobs = None,
    scheduler: Annotated[
        str | None,
        Option(metavar="tcp://HOST:PORT", help="Use a dask.distributed cluster instead."),
    ] = None,
    limit: Annotated[
        float,
        Option(metavar="SECONDS", parser=number(), help="A run that takes longer has failed."),
    ] = 600,
    quick: Annotated[bool, Option("--quick", help="The study's small version.")] = False,
    full: Annotated[bool, Option("--full", help="The study's larger version.")] = False,
    pilot: Annotated[
        int | None,
        count("Only so many persons, with a random seed of their own.", metavar="PERSONS", least=1),
    ] = None,
    dry_run: Annotated[bool, Option("--dry-run", help="Only say what would run.")] = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Run a study, or go on with it, and write its report.

    A study that was interrupted goes on where it stopped: finished runs are kept in its folder.

    Examples:
        dva-sim run req-rep-vs-pub-sub --dry-run  # what would run, and how long it would take
        dva-sim run req-rep-vs-pub-sub --quick  # its small version: an answer in a minute
        dva-sim run req-rep-vs-pub-sub --set persons=4 -j 2 -o small  # smaller, two processes
        dva-sim run mine.yaml --set 'link.delay_s=[0, 0.5]'  # other levels of a factor
    """
    from dva_sim.cli import study_runs  # late: start-up
    from dva_sim.experiments.execution.runner import RunRequest  # late: start-up

    request = RunRequest(
        study,
        out,
        changes=[*(set_ or []), *([f"seed={seed}"] if seed is not None else [])],
        quick=quick,
        full=full,
        pilot=pilot,
        jobs=jobs,
        scheduler=scheduler,
        limit_s=limit,
    )
    with loudness(quiet, verbose):
        if dry_run:
            study_runs.plan(request)
            return
        code = study_runs.run(request)
    raise typer.Exit(code)


def new(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Name or path of the new study.")],
) -> None:
    """Write a study to begin with, which runs as it stands.

    Comments in it say what can be changed.

    Examples:
        dva-sim new mine  # writes mine.yaml here
    """
    from dva_sim.experiments.study.loading import write_study  # late: start-up

    typer.echo(told(write_study(name)))


def register(
    study: StudyName,
    full: Annotated[bool, Option("--full", help="The study's larger version.")] = False,
    again: Annotated[
        bool,
        Option("--again", help="In place of an earlier registration; the report will say so."),
    ] = False,
) -> None:
    """Fix a study's hypotheses and size before it is run.

    The run then confirms or refutes the hypotheses.

    Examples:
        dva-sim register mine.yaml  # writes mine.registration.yaml beside it
    """
    from dva_sim.experiments.study.registration import register as write_down  # late: start-up
    from dva_sim.testing.file_kinds import open_study  # late: start-up

    typer.echo(write_down(open_study(study, version="full" if full else None), again))


def tune(
    study: StudyName,
    out: Results = None,
    jobs: Jobs = None,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Choose the values that a study has tuned.

    They are tried on persons who take no part in the study, and kept beside it.

    Examples:
        dva-sim tune filters  # writes tuned/filters.yaml beside it
    """
    from dva_sim.cli import study_runs  # late: start-up

    with loudness(quiet, verbose):
        code = study_runs.tune(study, out, jobs)
    raise typer.Exit(code)


def told(path: Path) -> str:
    """What to do next with a new study."""
    steps = (
        ("check", "finds mistakes"),
        ("run --dry-run", "how many runs that is, and how long they take"),
        ("register", "fixes its hypotheses, so that the run confirms or refutes them"),
        ("run", "makes the runs and the report"),
    )
    commands = [" ".join(["dva-sim", *_with_file(step, path)]) for step, _ in steps]
    width = max(map(len, commands))
    lines = [f"  {c:{width}}  # {why}" for c, (_, why) in zip(commands, steps, strict=True)]
    ready = f"Wrote {path}. It works as it stands; its comments say what can be changed. Next:"
    return "\n".join([ready, *lines])


def _with_file(step: str, path: Path) -> list[str]:
    """The words of a command, the file behind the first."""
    verb, *options = step.split()
    return [verb, shlex.quote(str(path)), *options]
