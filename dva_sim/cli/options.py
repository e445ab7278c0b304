"""Options of commands: those of a function of `dva_sim`, and others that several commands have.

A function declares name, type, default and words of an option, once. `FORMS` is what only a command
line has of it: short name, placeholder, range and completion. Numbers are read here too, so that a
wrong one is told with what would be right. Nothing heavy is imported: every command begins here.
"""

from __future__ import annotations

import inspect
import math
import re
from collections.abc import Callable, Sequence
from functools import cache
from inspect import Parameter
from typing import Annotated, Any, TypeVar, get_args

import typer
from typer import Argument, Option

from dva_sim import api

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

# By the name in a function. Units are placeholders here, so that `limit_s` is `--limit SECONDS`.
FORMS: dict[str, dict[str, Any]] = {
    "at": {"metavar": "SECONDS"},
    "camera": {"metavar": "ROBOT"},
    "export.out": {"metavar": "PATH"},
    "figure": {"metavar": "FILE:CLASS"},
    "first": {"metavar": "A"},
    "format": {"metavar": "csv|parquet"},
    "jobs": {"names": ("-j", "--jobs"), "parser": whole(1, MOST_JOBS)},
    "limit_s": {"names": ("--limit",), "metavar": "SECONDS"},
    "mcap": {"metavar": "FILE"},
    "out": {"names": ("-o", "--out"), "metavar": "FOLDER"},
    "panels": {"parser": whole(1, 24)},
    "pilot": {"metavar": "PERSONS", "parser": whole(1)},
    "ros2": {"metavar": "FOLDER"},
    "rows": {"parser": whole(1)},
    "scenario": {"autocompletion": SCENARIOS},
    "scheduler": {"metavar": "tcp://HOST:PORT"},
    "second": {"metavar": "B"},
    "set": {"metavar": "KEY=VALUE"},
    "side_by_side": {"metavar": "PATTERN,PATTERN"},
    "study": {"autocompletion": STUDIES},
}
# All else is as its type has it, by the first of these words in that.
_USUAL: dict[str, tuple[Any, dict[str, Any]]] = {
    "several": (list[str], {"metavar": "NAME"}),
    "bool": (bool, {}),
    "Path": (str, {"metavar": "FILE"}),
    "str": (str, {"metavar": "NAME"}),
    "int": (int, {"metavar": "N", "parser": whole()}),
    "float": (float, {"metavar": "NUMBER", "parser": number()}),
}
Command = TypeVar("Command", bound=Callable[..., Any])


def takes(function: Callable[..., Any], but: Sequence[str] = ()) -> Callable[[Command], Command]:
    """A command that takes what a function takes, by the same names, and what it adds itself.

    It has parameters for what it looks at, and hands over all else that it is given.

    Args:
        function: One of `dva_sim`.
        but: What only programs have.
    """

    def declare(command: Command) -> Command:
        there = inspect.signature(function).parameters.items()
        taken = {name: _as_option(function, p) for name, p in there if name not in but}
        own = inspect.signature(command, eval_str=True).parameters.values()
        added = [p for p in own if p.name not in taken and p.kind is not Parameter.VAR_KEYWORD]
        every = [p.replace(kind=Parameter.KEYWORD_ONLY) for p in (*taken.values(), *added)]
        declared: Any = command
        declared.__signature__ = inspect.Signature(every)
        return command

    return declare


def option_of(function: Callable[..., Any], name: str) -> Any:
    """An option as the command of a function has it, for a command that has no function."""
    parameter = inspect.signature(function).parameters[name]
    return get_args(_as_option(function, parameter).annotation)[1]


def _as_option(function: Callable[..., Any], parameter: Parameter) -> Parameter:
    """A parameter with type, form and words of an option, or of an argument if it has to be given.

    Its annotation is read as text, since what that names is imported later, if at all.
    """
    name, default, several = parameter.name, parameter.default, parameter.default == ()
    form = FORMS.get(name, {}) | FORMS.get(f"{function.__name__}.{name}", {})
    words = _words(function).get(name, "")
    if default is Parameter.empty and "names" not in form:
        place = Argument(**{"metavar": name.upper()} | form, help=words)
        return parameter.replace(annotation=Annotated[str, place])
    told = ["several"] if several else re.findall(r"\w+", str(parameter.annotation))
    kind, usual = next(_USUAL[word] for word in _USUAL if word in told)
    asked = {"names": (f"--{name.replace('_', '-')}",), "help": words} | usual | form
    if several:
        asked["help"] = f"{words.removesuffix('.')}; may be given again."
    option = Option(*asked.pop("names"), **asked)
    return parameter.replace(annotation=Annotated[kind | None if default is None else kind, option])


@cache
def _words(function: Callable[..., Any]) -> dict[str, str]:
    """Of each argument the first sentence that the docstring says of it."""
    text = inspect.getdoc(function) or ""
    told = re.findall(r"^    (\w+): (.+(?:\n {8}.+)*)", text, re.MULTILINE)
    return {name: re.split(r"(?<=\.)\s+(?=[A-Z])", some)[0].replace("`", "") for name, some in told}


# --- of commands that no function stands behind, and what only a terminal has ---------------
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


Jobs = Annotated[int | None, option_of(api.run, "jobs")]
RunSeed = Annotated[int, option_of(api.episode, "seed")]
ScenarioName = Annotated[str, option_of(api.episode, "scenario")]
Sets = Annotated[list[str] | None, option_of(api.episode, "set")]

Overwrite = Annotated[bool, option_of(api.episode, "overwrite")]
Json = Annotated[bool, Option("--json", help="Print JSON, for other programs.")]
Quiet = Annotated[bool, Option("-q", "--quiet", help="Print mistakes alone.")]
Verbose = Annotated[bool, Option("-v", "--verbose", help="Print more than usual.")]


Host = Annotated[str, Option(metavar="HOST", help="Address of this machine to listen on.")]
Port = Annotated[int, count("Port of the page; 0: any that is free.", metavar="PORT", most=65_535)]
NoOpen = Annotated[bool, Option("--no-open", help="Open no browser.")]
NoToken = Annotated[bool, Option("--no-token", help="Let everybody in who reaches the page.")]
