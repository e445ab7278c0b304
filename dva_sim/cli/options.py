"""Options as a command line has them: made from where they are declared.

Numbers are read here too, so that a wrong one is refused with the range that is allowed. Nothing
heavy is imported: every command starts here.
"""

from __future__ import annotations

import inspect
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import is_dataclass
from inspect import Parameter
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import typer
from typer import Argument, Option

from dva_sim.options.forms import MAX_SEED, OptionForm, make_forms, split

Json = Annotated[bool, OptionForm("Print JSON, for other programs.", names=("--json",))]
Quiet = Annotated[bool, OptionForm("Print only errors.", names=("-q", "--quiet"))]
Verbose = Annotated[bool, OptionForm("Print more detail.", names=("-v", "--verbose"))]

_NUMBER = re.compile(r"[+-]?([0-9]+(\.[0-9]*)?|\.[0-9]+)(e[+-]?[0-9]+)?", re.IGNORECASE)


def from_words(command: Callable[..., None]) -> Callable[..., None]:
    """Return a command in the form that Typer needs: with one parameter for each option.

    A parameter of `command` is a class of options, or a single option `Annotated` with its form.
    """
    hints = get_type_hints(command, include_extras=True)
    classes: dict[str, Any] = {name: of for name, of in hints.items() if is_dataclass(of)}
    parameters: list[Parameter] = []
    for name, parameter in inspect.signature(command).parameters.items():
        if name in classes:
            parameters += _make_parameters(classes[name])
            continue
        of, form = split(hints[name])
        parameters.append(
            parameter.replace(annotation=hints[name], kind=Parameter.KEYWORD_ONLY)
            if form is None  # as Typer itself describes it
            else _option(name, of, form, parameter.default)
        )

    def call(**words: Any) -> None:
        values = {name: tuple(v) if isinstance(v, list) else v for name, v in words.items()}
        made = {
            name: of(**{each: values.pop(each) for each in make_forms(of) if each in values})
            for name, of in classes.items()
        }
        command(**made, **values)

    call.__doc__ = command.__doc__
    vars(call)["__signature__"] = inspect.Signature(parameters)
    return call


def _make_parameters(options: type) -> list[Parameter]:
    """Return parameters for the options of a class, except options only for programs."""
    forms = make_forms(options)
    return [
        _option(name, forms[name][0], form, parameter.default)
        for name, parameter in inspect.signature(options).parameters.items()
        if (form := forms[name][1]).help
    ]


def _option(name: str, of: Any, form: OptionForm, default: Any) -> Parameter:
    """Return an option as a parameter that Typer understands."""
    kinds = get_args(of) if isinstance(of, UnionType) else (of,)
    kind = get_args(kinds[0])[0] if get_origin(kinds[0]) in (tuple, Mapping) else kinds[0]
    is_optional = NoneType in kinds
    about: dict[str, Any] = {"help": form.help, "metavar": form.metavar or _METAVARS.get(kind)}
    if form.words or form.folders:
        about["autocompletion"] = _completer(form)
    if kind is int:
        about["parser"] = _whole(form.least, form.most)
    elif kind is float:
        about["parser"] = _number(form.above)
    if form.is_argument:
        described = Argument(**about)
    else:
        described = Option(*(form.names or (f"--{name.rstrip('_').replace('_', '-')}",)), **about)
    taken: Any = kind | None if is_optional else kind
    if form.is_repeated:
        taken = list.__class_getitem__(kind)
    annotation = Annotated[taken, described]
    return Parameter(name, Parameter.KEYWORD_ONLY, annotation=annotation, default=default)


_METAVARS: dict[Any, str] = {str: "NAME", int: "N", float: "SECONDS", Path: "FILE"}


def _completer(form: OptionForm) -> Callable[[str], list[str]]:
    """Return what completes a word, or the name of a file in the folders of the option."""

    def complete(incomplete: str) -> list[str]:
        from dva_sim.kernel.resources import available  # late: start-up

        names = [
            f"{'tasks/' if folder.endswith('/tasks') else ''}{name}"
            for folder in form.folders
            for name in available(folder)
        ]
        return [name for name in (*form.words, *sorted(names)) if name.startswith(incomplete)]

    return complete


def _whole(least: int, most: int) -> Callable[[int | str], int]:
    def read(text: int | str) -> int:
        written = str(text)
        if re.fullmatch(r"[+-]?[0-9]{1,19}", written) and least <= int(written) <= most:
            return int(written)
        within = f"of at least {least}" if most == MAX_SEED else f"from {least} to {most}"
        raise typer.BadParameter(f"{written!r} should be a whole number {within}")

    return read


def _number(above: float) -> Callable[[float | str], float]:
    def read(text: float | str) -> float:
        value = float(text) if _NUMBER.fullmatch(str(text)) else math.nan
        if math.isfinite(value) and value > above:
            return value
        raise typer.BadParameter(f"{str(text)!r} should be a number above {above:g}")

    return read
