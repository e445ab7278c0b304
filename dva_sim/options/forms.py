"""Description of an option beside it: `name: Annotated[type, OptionForm(...)] = default`."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import fields
from functools import cache
from inspect import Signature, cleandoc, signature
from pathlib import Path
from typing import Annotated, Any, NamedTuple, cast, get_args, get_origin, get_type_hints

MAX_SEED = 2**63 - 1
MAX_JOBS = 1024
MAX_PORT = 65_535
SCENARIOS = "experiments/scenarios", "experiments/scenarios/tasks"


class OptionForm(NamedTuple):
    """Words and bounds of an option; its type and its default are those of what it describes.

    Attributes:
        help: Meaning, as the command line tells it; empty for an option that only programs have.
        also: Meaning that only programs have to know.
        names: Its names on the command line, if it has another than its own or one more.
        metavar: Placeholder of its value; by default one for its type.
        least: Least value of a whole number.
        most: Greatest value of a whole number.
        above: A number has to be above that.
        words: Words among which to choose, for completion.
        folders: Folders with files that may be named, for completion.
        is_argument: True if it is given by its position.
        is_repeated: True if it may be given again.
    """

    help: str = ""
    also: str = ""
    names: tuple[str, ...] = ()
    metavar: str = ""
    least: int = 0
    most: int = MAX_SEED
    above: float = 0.0
    words: tuple[str, ...] = ()
    folders: tuple[str, ...] = ()
    is_argument: bool = False
    is_repeated: bool = False

    @property
    def for_programs(self) -> str:
        """Its meaning, as the docstring of a function tells it."""
        help = self.help.removesuffix("; may be given again.").removesuffix(".")
        return f"{help}. {self.also}".strip() if help else self.also


def argument(
    help: str, metavar: str, *folders: str, words: tuple[str, ...] = (), is_repeated: bool = False
) -> OptionForm:
    """Return the form of an argument, which is given by its position."""
    return OptionForm(
        help,
        metavar=metavar,
        words=words,
        folders=folders,
        is_argument=True,
        is_repeated=is_repeated,
    )


def port_form(help: str, *names: str, most: int = MAX_PORT) -> OptionForm:
    """Return the form of an option for a port of this machine."""
    return OptionForm(help, names=names, metavar="PORT", most=most)


def out_form(help: str, metavar: str = "FOLDER") -> OptionForm:
    """Return the form of the option for a file or folder of results."""
    return OptionForm(help, names=("-o", "--out"), metavar=metavar)


CHANGES = OptionForm(
    "Change a key; may be given again.",
    "Or several: a mapping, or `key=value` pairs.",
    metavar="KEY=VALUE",
    is_repeated=True,
)
JOBS = OptionForm(
    "Number of processes; default: one for each core.",
    names=("-j", "--jobs"),
    least=1,
    most=MAX_JOBS,
)
Changes = Annotated[tuple[str, ...], CHANGES]
Settings = Annotated[Mapping[str, Any] | Iterable[str], CHANGES]
Jobs = Annotated[int | None, JOBS]
Scheduler = Annotated[
    str | None,
    OptionForm("Use a dask.distributed cluster instead.", metavar="tcp://HOST:PORT"),
]
Overwrite = Annotated[bool, OptionForm("Overwrite existing files.")]
RunSeed = Annotated[int, OptionForm("The run's random seed.")]
SCENARIO = argument("A scenario by name or path.", "SCENARIO", *SCENARIOS)
ScenarioName = Annotated[str, SCENARIO]
AnyPath = str | Path | None


@cache
def make_forms(options: Callable[..., Any]) -> dict[str, tuple[Any, OptionForm]]:
    """Return the types of a class's options, and their forms.

    Raises:
        LookupError: one has no form.
    """
    hints = get_type_hints(options, include_extras=True)
    forms = {}
    for field in fields(cast(Any, options)):
        of, form = split(hints[field.name])
        if form is None:
            raise LookupError(f"option {field.name!r} has no form")
        forms[field.name] = of, form
    return forms


def split(hint: Any) -> tuple[Any, OptionForm | None]:
    """Return a type and its form, if it has one."""
    of, *about = get_args(hint) if get_origin(hint) is Annotated else [hint]
    return of, next((each for each in about if isinstance(each, OptionForm)), None)


def make_signature(options: Callable[..., Any], returns: object) -> Signature:
    """Return the signature of a function that takes a class's options, each by its name."""
    forms = make_forms(options)
    parameters = signature(options).parameters.values()
    plain = [each.replace(annotation=forms[each.name][0]) for each in parameters]
    return Signature(plain, return_annotation=returns)


def documented(text: str, options: Callable[..., Any]) -> str:
    """Return a function's docstring with a class's options as its arguments."""
    words = [f"    {name}: {form.for_programs}" for name, (_, form) in make_forms(options).items()]
    about, ends, rest = cleandoc(text).partition("\n\nRaises:")
    about, returns, what = about.partition("\n\nReturns:")
    return "".join([about, "\n\nArgs:\n", "\n".join(words), returns, what, ends, rest])
