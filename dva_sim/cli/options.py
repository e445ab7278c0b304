"""Options of commands: names, placeholders, ranges, completion and help.

A command that stands for a function of `dva_sim` takes its parameters with their defaults
(`takes`), each in the form of its entry in `OPTIONS`. Numbers are read here too, so that a wrong
one is refused with the range that is allowed. Nothing heavy is imported: every command starts
here.
"""

from __future__ import annotations

import inspect
import math
import re
from collections.abc import Callable, Mapping, Sequence
from inspect import Parameter
from pathlib import Path
from typing import Annotated, Any, TypeVar

import typer
from typer import Argument, Option

Completer = Callable[[str], list[str]]


def names_in(*folders: str) -> Completer:
    """Completes the names of files in some folders, wherever those lie."""

    def complete(incomplete: str) -> list[str]:
        from dva_sim.kernel.resources import available  # late: start-up

        found = [
            f"{'tasks/' if folder.endswith('/tasks') else ''}{name}"
            for folder in folders
            for name in available(folder)
        ]
        return sorted(name for name in found if name.startswith(incomplete))

    return complete


def one_of(*words: str) -> Completer:
    """Completes one of some words."""
    return lambda incomplete: [word for word in words if word.startswith(incomplete)]


STUDIES = names_in("experiments")
SCENARIOS = names_in("experiments/scenarios", "experiments/scenarios/tasks")
SITES = names_in("worlds")
ROBOTS = names_in("agents/robots")


MOST_SEED = 2**63 - 1
_NUMBER = re.compile(r"[+-]?([0-9]+(\.[0-9]*)?|\.[0-9]+)(e[+-]?[0-9]+)?", re.IGNORECASE)


def whole(least: int = 0, most: int = MOST_SEED) -> Callable[[int | str], int]:
    """Reads whole numbers from `least` to `most`."""

    def read(text: int | str) -> int:
        written = str(text)
        if re.fullmatch(r"[+-]?[0-9]{1,19}", written) and least <= int(written) <= most:
            return int(written)
        raise typer.BadParameter(f"{written!r} should be a whole number {_within(least, most)}")

    return read


def number(above: float = 0.0) -> Callable[[float | str], float]:
    """Reads numbers above `above`."""

    def read(text: float | str) -> float:
        value = float(text) if _NUMBER.fullmatch(str(text)) else math.nan
        if math.isfinite(value) and value > above:
            return value
        raise typer.BadParameter(f"{str(text)!r} should be a number above {above:g}")

    return read


def _within(least: int, most: int) -> str:
    return f"of at least {least}" if most == MOST_SEED else f"from {least} to {most}"


MOST_JOBS = 1024
Command = TypeVar("Command", bound=Callable[..., Any])


def argument(help: str, metavar: str, completer: Completer | None = None, of: Any = str) -> Any:
    """An argument, given by its position; required where it has no default."""
    return Annotated[of, Argument(metavar=metavar, autocompletion=completer, help=help)]


def text(help: str, *names: str, metavar: str = "NAME", of: Any = str | None) -> Any:
    """An option that takes some text, such as the path of a file."""
    return Annotated[of, Option(*names, metavar=metavar, help=help)]


def several(help: str, metavar: str = "NAME", *names: str) -> Any:
    """An option that takes some text, and may be given again."""
    return Annotated[list[str], Option(*names, metavar=metavar, help=help)]


def flag(name: str, help: str) -> Any:
    """An option without a value, which cannot be switched off again."""
    return Annotated[bool, Option(name, help=help)]


def count(
    help: str, *names: str, metavar: str = "N", least: int = 0, most: int = MOST_SEED, of: Any = int
) -> Any:
    """An option that takes a whole number; `of` says so where it may be left out."""
    return Annotated[of, Option(*names, metavar=metavar, parser=whole(least, most), help=help)]


def seconds(help: str, *names: str, of: Any = float | None) -> Any:
    """An option that takes a time above zero."""
    return Annotated[of, Option(*names, metavar="SECONDS", parser=number(), help=help)]


def choice(*words: str, help: str, of: Any = str) -> Any:
    """An option that takes one of some words; `of` says so where it may be left out."""
    return Annotated[of, Option(metavar="|".join(words), autocompletion=one_of(*words), help=help)]


def file(help: str, *names: str, metavar: str = "FILE", of: Any = Path | None) -> Any:
    """An option that takes a file."""
    return Annotated[of, Option(*names, metavar=metavar, help=help)]


def folder(help: str, *names: str) -> Any:
    """An option that takes a folder."""
    return file(help, *names, metavar="FOLDER")


_JOBS = "Number of processes; default: one for each core."
Jobs = count(_JOBS, "-j", "--jobs", least=1, most=MOST_JOBS, of=int | None)
RunSeed = count("The run's random seed.")
ScenarioName = argument("A scenario by name or path.", "SCENARIO", SCENARIOS)
Sets = Annotated[
    list[str] | None,
    Option("--set", metavar="KEY=VALUE", help="Change a key; may be given again."),
]
Overwrite = Annotated[bool, Option("--overwrite", help="Overwrite existing files.")]
Json = Annotated[bool, Option("--json", help="Print JSON, for other programs.")]
Quiet = Annotated[bool, Option("-q", "--quiet", help="Print only errors.")]
Verbose = Annotated[bool, Option("-v", "--verbose", help="Print more detail.")]

REQUIRED: Any = Parameter.empty
PAGE: dict[str, tuple[Any, Any]] = {
    "host": (text("Address to listen on.", metavar="HOST", of=str), "127.0.0.1"),
    "port": (count("Port of the page; 0: any free port.", metavar="PORT", most=65_535), 8765),
    "no_open": (flag("--no-open", "Do not open a browser."), False),
    "no_token": (
        flag("--no-token", "Disable the access token: anyone who can reach the page gets in."),
        False,
    ),
}
"""Options of commands that serve a page, with their defaults."""
RUN: dict[str, tuple[Any, Any]] = {"seed": (RunSeed, 1), "set_": (Sets, None)}
"""Options of commands that run a scenario in real time."""

_PILOT = "Run only this many persons, with a random seed of their own."
OPTIONS: dict[str, Any] = {
    "again": flag("--again", "Replace an earlier registration; the report will say so."),
    "at": text("Time of the still, or times of the strip: 10,20,30.", metavar="SECONDS"),
    "camera": text("The still shows what this robot's camera sees.", metavar="ROBOT"),
    "columns": flag("--columns", "Explain the columns of one table or all."),
    "figure": several("Add a figure of your own; may be given again.", metavar="FILE:CLASS"),
    "file": argument("A recording: .mcap, or the .mcap.part that a killed run left.", "FILE"),
    "first": argument("A results folder.", "A"),
    "folder": argument("A results folder.", "FOLDER"),
    "format": text("Format of tables in a folder; default: csv.", metavar="csv|parquet"),
    "full": flag("--full", "The study's larger version."),
    "inset": flag("--inset", "Show in the film what a robot's camera sees."),
    "jobs": Jobs,
    "limit_s": seconds("Treat a run that takes longer as failed.", "--limit", of=float),
    "mcap": text("Turn an .mcap.part into a complete recording in a new file.", metavar="FILE"),
    "name": argument("Name or path of the new study.", "NAME"),
    "overwrite": Overwrite,
    "panels": count("Number of moments in a strip.", least=1, most=24),
    "pdf": flag("--pdf", "Also print it as PDF, using Chromium."),
    "pilot": count(_PILOT, metavar="PERSONS", least=1, of=int | None),
    "quick": flag("--quick", "The study's small version."),
    "record": text("Record the run in a file: .mcap, for replay and viewers.", metavar="FILE"),
    "ros2": text("Write a ROS 2 bag to a new folder.", metavar="FOLDER"),
    "rows": count("Number of rows to print.", least=1),
    "scenario": ScenarioName,
    "scheduler": text("Use a dask.distributed cluster instead.", metavar="tcp://HOST:PORT"),
    "second": argument("The results folder to compare with it.", "B"),
    "seed": RunSeed,
    "set": Sets,
    "side_by_side": text("Run the same seed under two patterns.", metavar="PATTERN,PATTERN"),
    "still": text("Draw one moment: .png, .pdf or .svg.", metavar="FILE"),
    "strip": text("Draw several moments in one figure: .png, .pdf or .svg.", metavar="FILE"),
    "study": argument("A study, by name or path.", "STUDY", STUDIES),
    "table": text("Show the rows of a table."),
    "video": text("Write a film: .gif or .mp4.", metavar="FILE"),
    # What is another option in one command.
    "export.out": Annotated[
        str,
        Option(
            "-o", "--out", metavar="PATH", help="X.csv or X.parquet for one table, or a folder."
        ),
    ],
    "export.table": several("Export only this table; may be given again."),
    "run.out": text("Results folder; default: results/STUDY.", "-o", "--out", metavar="FOLDER"),
    "run.seed": count("Random seed of the whole study.", of=int | None),
    "tune.out": text(
        "Folder of the trials; default: results/STUDY-tuning.", "-o", "--out", metavar="FOLDER"
    ),
}
"""By the name of the parameter, or by those of function and parameter."""


def takes(function: Callable[..., Any], but: Sequence[str] = ()) -> Callable[[Command], Command]:
    """A command that takes what a function takes, by the same names, and what it adds itself.

    It has parameters for what it looks at, and hands over all else that it is given.

    Args:
        function: One of `dva_sim`.
        but: Parameters that only programs have.
    """

    def declare(command: Command) -> Command:
        there = inspect.signature(function).parameters.items()
        taken = {
            name: parameter.replace(annotation=_form(function.__name__, name))
            for name, parameter in there
            if name not in but
        }
        return _declared(command, taken)

    return declare


def asks(**options: tuple[Any, Any]) -> Callable[[Command], Command]:
    """A command that asks for these options, each with its form and its default.

    It has parameters for what it looks at, and hands over all else that it is given.
    """
    asked = {
        name: Parameter(name, Parameter.KEYWORD_ONLY, annotation=form, default=default)
        for name, (form, default) in options.items()
    }
    return lambda command: _declared(command, asked)


def _declared(command: Command, asked: Mapping[str, Parameter]) -> Command:
    """The command with these parameters, and then those that it adds itself."""
    own = inspect.signature(command, eval_str=True).parameters.values()
    added = [p for p in own if p.name not in asked and p.kind is not Parameter.VAR_KEYWORD]
    every = [p.replace(kind=Parameter.KEYWORD_ONLY) for p in (*asked.values(), *added)]
    declared: Any = command
    declared.__signature__ = inspect.Signature(every)
    return command


def _form(function: str, name: str) -> Any:
    return OPTIONS[f"{function}.{name}" if f"{function}.{name}" in OPTIONS else name]
