"""Options that several commands have: one name, one form, one meaning and one completion for each.

Numbers are read here too, so that a wrong one is told with what would be right. Nothing heavy is
imported: every command begins here.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

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


def count(help: str, *names: str, metavar: str = "N", least: int = 0, most: int = MOST_SEED) -> Any:
    """An option that takes a whole number."""
    return Option(*names, metavar=metavar, parser=whole(least, most), help=help)


def choice(*words: str, help: str) -> Any:
    """An option that takes one of some words."""
    return Option(metavar="|".join(words), autocompletion=one_of(*words), help=help)


def file(help: str) -> Any:
    """An option that takes a file."""
    return Option(metavar="FILE", help=help)


def folder(help: str) -> Any:
    """An option that takes a folder."""
    return Option(metavar="FOLDER", help=help)


MOST_JOBS = 1024

StudyName = Annotated[
    str, Argument(metavar="STUDY", autocompletion=STUDIES, help="A study by name or path.")
]
ScenarioName = Annotated[
    str, Argument(metavar="SCENARIO", autocompletion=SCENARIOS, help="A scenario by name or path.")
]
ResultsFolder = Annotated[Path, Argument(metavar="FOLDER", help="A results folder.")]

Sets = Annotated[
    list[str] | None,
    Option("--set", metavar="KEY=VALUE", help="Change one key; may be given again."),
]
Jobs = Annotated[
    int | None,
    count(
        "How many processes; default: one for each core.", "-j", "--jobs", least=1, most=MOST_JOBS
    ),
]
Overwrite = Annotated[bool, Option("--overwrite", help="Replace what is there.")]
Quiet = Annotated[bool, Option("-q", "--quiet", help="Print mistakes alone.")]
Verbose = Annotated[bool, Option("-v", "--verbose", help="Print more than usual.")]
Json = Annotated[bool, Option("--json", help="Print JSON, for other programs.")]
RunSeed = Annotated[int, count("The run's random seed.", "--seed")]
Results = Annotated[
    Path | None,
    Option("-o", "--out", metavar="FOLDER", help="Results folder; default: results/STUDY."),
]

Video = Annotated[Path | None, file("Write a film: .gif or .mp4.")]
Still = Annotated[Path | None, file("Draw one moment: .png, .pdf or .svg.")]
Strip = Annotated[Path | None, file("Draw several moments in one figure, likewise.")]
At = Annotated[
    str | None,
    Option(metavar="SECONDS", help="Moment of --still, or moments of --strip: 10,20,30."),
]
Panels = Annotated[int, count("How many moments a strip has.", least=1, most=24)]
Camera = Annotated[
    str | None,
    Option(metavar="ROBOT", help="--still shows what this robot's camera sees."),
]
Inset = Annotated[bool, Option("--inset", help="Show in --video what a robot's camera sees.")]
