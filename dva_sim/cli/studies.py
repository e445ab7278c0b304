"""The commands that make results: demo, run, new, register, tune."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Annotated

import typer

from dva_sim.cli.options import Quiet, Verbose
from dva_sim.cli.verbosity import loudness
from dva_sim.options.forms import Jobs, out_form
from dva_sim.options.studies import (
    STUDY,
    DryRun,
    NewOptions,
    RegisterOptions,
    RunOptions,
    TuneOptions,
)


def demo(
    out: Annotated[Path, out_form("Where pictures, film and report go.")] = Path("results/demo"),
    jobs: Jobs = None,
) -> None:
    """Show what delay and messaging do to driving.

    It shows one drive under two patterns, as a picture, a story and a film, then runs the small
    version of the main study and writes its report.

    Examples:
        dva-sim demo -o first  # into a folder of your own, in place of results/demo
    """
    from dva_sim.cli.demo import demo as show_it  # late: start-up

    raise typer.Exit(show_it(out, jobs))


def run(
    options: RunOptions,
    dry_run: DryRun = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Run or resume a study and write its report.

    An interrupted study resumes where it stopped: finished runs are kept in its folder.

    Examples:
        dva-sim run req-rep-vs-pub-sub --dry-run  # what would run, and how long it would take
        dva-sim run req-rep-vs-pub-sub --quick  # its small version: an answer in a minute
        dva-sim run req-rep-vs-pub-sub --set persons=4 -j 2 -o small  # smaller, two processes
        dva-sim run mine.yaml --set 'link.delay_s=[0, 0.5]'  # other levels of a factor
    """
    from dva_sim.cli import study_runs  # late: start-up

    with loudness(quiet, verbose):
        if dry_run:
            study_runs.plan(options)
            return
        code = study_runs.run(options)
    raise typer.Exit(code)


def new(options: NewOptions) -> None:
    """Write a new study that runs as it is, to be edited.

    Its comments explain what can be changed.

    Examples:
        dva-sim new mine  # writes mine.yaml here
    """
    from dva_sim.experiments.study.loading import write_study  # late: start-up

    typer.echo(next_steps(write_study(str(options.name))))


def register(options: RegisterOptions) -> None:
    """Fix a study's hypotheses and size before running it.

    The run then confirms or refutes the hypotheses.

    Examples:
        dva-sim register mine.yaml  # writes mine.registration.yaml beside it
    """
    from dva_sim.experiments.study.file_kinds import open_study  # late: start-up
    from dva_sim.experiments.study.registration import register as write_down  # late: start-up

    study = open_study(options.study, version="full" if options.full else None)
    typer.echo(write_down(study, options.again))


def tune(options: TuneOptions, quiet: Quiet = False, verbose: Verbose = False) -> None:
    """Choose the values of a study's tuned key.

    Candidates are tried on persons who take no part in the study. The chosen values are saved
    beside it.

    Examples:
        dva-sim tune filters  # writes tuned/filters.yaml beside it
    """
    from dva_sim.cli import study_runs  # late: start-up

    with loudness(quiet, verbose):
        code = study_runs.tune(options)
    raise typer.Exit(code)


def screen(
    study: Annotated[str, STUDY],
    out: Annotated[
        str | None, out_form("Results folder; default: results/STUDY-screening.")
    ] = None,
    jobs: Jobs = None,
    dry_run: DryRun = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Find the assumed numbers that move an answer most.

    Each is varied within its band. An interrupted screening resumes where it stopped.

    Examples:
        dva-sim screen req-rep-vs-pub-sub --dry-run  # how many runs, and how long they take
        dva-sim screen req-rep-vs-pub-sub  # a table, and a figure of the five that move it most
    """
    from dva_sim.cli import study_runs  # late: start-up

    with loudness(quiet, verbose):
        code = study_runs.screen(study, out, jobs, dry_run)
    raise typer.Exit(code)


def next_steps(path: Path) -> str:
    """Return the next steps for a new study."""
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
    """Return the words of a command, the file behind the first."""
    verb, *options = step.split()
    return [verb, shlex.quote(str(path)), *options]
