"""Mistakes in the words of a call, each in one line that says what would be right."""

from __future__ import annotations

import re
from typing import Any

import typer

from dva_sim.kernel.suggestions import hint

UsageError: type[Exception] = typer.BadParameter.__mro__[1]
"""What the parser of the command line raises, whichever library it is from."""


def in_a_line(error: Any) -> str:
    """What is wrong with a call, and what would be right."""
    path = error.ctx.command_path if error.ctx is not None else "dva-sim"
    more, kind = f"see {path} --help", type(error).__name__
    if kind == "NoSuchOption":
        return f"{path} has no option {error.option_name!r}; {_options(error, more)}"
    if kind == "MissingParameter":
        return f"{path} needs {name_of(error.param)}: {_help(error.param)}; {more}"
    if kind == "BadParameter" and error.param is not None:
        return f"{name_of(error.param)} {error.message}"
    if kind == "BadOptionUsage":
        takes = "a" if "requires" in error.message else "no"
        return f"{error.option_name} takes {takes} value"
    if extra := re.fullmatch(r"Got unexpected extra argument(?:s|\(s\))? \((.*)\)", error.message):
        return f"{path} does not know what to do with {extra[1]!r}; {more}"
    problem = str(error.format_message()).rstrip(".")
    told = f"{path}: {problem[:1].lower()}{problem[1:]}"
    return told if told.endswith("?") else f"{told}; {more}"


def name_of(param: Any) -> str:
    """An option by its long name, an argument by the word in the usage."""
    if param.param_type_name == "argument":
        return str(param.metavar or param.name.upper())
    return str(max(param.opts, key=len))


def _help(param: Any) -> str:
    told = str(param.help or "").rstrip(".")
    return told[:1].lower() + told[1:]


def _options(error: Any, more: str) -> str:
    if error.ctx is None:
        return more
    known = [opt for param in error.ctx.command.get_params(error.ctx) for opt in param.opts]
    near = hint(error.option_name, [opt for opt in known if opt.startswith("--")])
    return near if near.startswith("did you") else more
