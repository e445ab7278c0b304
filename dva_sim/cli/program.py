"""The program: all commands in their groups, how their help is laid out, and how each of them ends.

A mistake in the words of a call is told in one line that says what would be right.
"""

from __future__ import annotations

import inspect
import os
import re
import sys
from collections.abc import Callable, Sequence
from typing import Annotated, Any, NoReturn

import typer
from typer.core import TyperCommand, TyperGroup

from dva_sim import __version__
from dva_sim.cli import files, results, runs, site, studies
from dva_sim.kernel.errors import DvaSimError, ExitCode, error_line
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


HELP = {"help_option_names": ["-h", "--help"]}
_EXAMPLES = "\nExamples:\n"


class CommandWithExamples(TyperCommand):
    """A command whose docstring ends in examples, each `call  # what it does`.

    Attributes:
        examples: The calls, with what they do.
    """

    def __init__(self, *args: Any, help: str | None = None, **others: Any) -> None:
        text, _, examples = inspect.cleandoc(help or "").partition(_EXAMPLES)
        super().__init__(*args, help=text.strip(), **others)
        self.examples = [
            (call.strip(), told.strip())
            for call, _, told in (line.partition("  # ") for line in examples.splitlines())
            if call.strip()
        ]

    def collect_usage_pieces(self, ctx: Any) -> list[str]:
        """Options, then what has to be given, and in brackets what may be."""
        given = [p for p in self.get_params(ctx) if p.param_type_name == "argument"]
        names = [name_of(p) if p.required else f"[{name_of(p)}]" for p in given]
        return ["[OPTIONS]", *names]

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Arguments by the words of the usage, then options."""
        given = [p for p in self.get_params(ctx) if p.param_type_name == "argument"]
        if given:
            with formatter.section("Arguments"):
                formatter.write_dl([(name_of(p), getattr(p, "help", "")) for p in given])
        records = [p.get_help_record(ctx) for p in self.get_params(ctx) if p not in given]
        with formatter.section("Options"):
            formatter.write_dl([record for record in records if record is not None])

    def format_epilog(self, ctx: Any, formatter: Any) -> None:
        """The examples as they are, since rewrapped ones cannot be copied."""
        super().format_epilog(ctx, formatter)
        if not self.examples:
            return
        with formatter.section("Examples"):
            for call, told in self.examples:
                if told:
                    formatter.write(f"  # {told}\n")
                formatter.write(f"  {call}\n")


class PanelGroup(TyperGroup):
    """A group whose commands stand under the headings of their panels."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """As ever; of a command that there is not, the nearest is named."""
        name = args[0]
        if not ctx.resilient_parsing and self.get_command(ctx, name) is None and name[0] != "-":
            ctx.fail(f"{name!r} is no command; {hint(name, self.list_commands(ctx))}")
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """One list for each panel, in the order in which they were added."""
        named = [(name, self.get_command(ctx, name)) for name in self.list_commands(ctx)]
        shown = [(name, command) for name, command in named if command and not command.hidden]
        widest = max(len(name) for name, _ in shown)
        panels: dict[str, list[tuple[str, str]]] = {}
        for name, command in shown:
            told = command.get_short_help_str(formatter.width - widest - 4)
            title = getattr(command, "rich_help_panel", None) or "Commands"
            panels.setdefault(title, []).append((name.ljust(widest), told))
        for title, rows in panels.items():
            with formatter.section(title):
                formatter.write_dl(rows)


class Stopped(DvaSimError):
    """Somebody stopped a command before its end."""

    exit_code = ExitCode.INTERRUPTED


class ReaderGone(DvaSimError):
    """Nobody reads what a command prints."""

    exit_code = ExitCode.READER_GONE


class DvaSimProgram(PanelGroup):
    """The program itself, whose help ends with the exit codes."""

    def invoke(self, ctx: Any) -> Any:
        """Tell who ended a command from outside; the parser would end the program by itself."""
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            raise Stopped("stopped by Ctrl-C") from None
        except BrokenPipeError:
            raise ReaderGone("nobody reads") from None

    def format_epilog(self, ctx: Any, formatter: Any) -> None:
        """What each number means that a command can end with."""
        with formatter.section("Exit codes"):
            formatter.write_dl([(str(int(code)), code.meaning) for code in ExitCode])


_PANELS: dict[str, tuple[Callable[..., None], ...]] = {
    "Studies": (studies.demo, studies.run, studies.new, studies.register, studies.tune),
    "Results": (results.report, results.show, results.export, results.compare),
    "Single runs": (runs.episode, runs.replay, runs.live, runs.console, runs.keys),
    "Names, files and evidence": (
        files.list_,
        files.plugins,
        files.check,
        files.phone_log,
        files.schema,
        files.validate,
    ),
}


def _typer(cls: type[PanelGroup], help: str) -> typer.Typer:
    return typer.Typer(
        cls=cls,
        help=help,
        no_args_is_help=True,
        add_completion=cls is DvaSimProgram,
        context_settings=HELP,
        rich_markup_mode=None,  # a third of the time that help takes
        pretty_exceptions_enable=False,
    )


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"dva-sim {__version__}")
        raise typer.Exit(ExitCode.OK)


def _program(
    version: Annotated[
        bool,
        typer.Option(
            "--version", is_eager=True, callback=_print_version, help="Print the version and exit."
        ),
    ] = False,
) -> None:
    """A test bench for surveillance teams of people and teleoperated robots."""


def _assembled() -> typer.Typer:
    program = _typer(DvaSimProgram, "")
    program.callback()(_program)
    for panel, commands in _PANELS.items():
        for command in commands:
            name = command.__name__.rstrip("_").replace("_", "-")
            program.command(
                name, cls=CommandWithExamples, rich_help_panel=panel, context_settings=HELP
            )(command)
    sites = _typer(PanelGroup, "Draw a site, or write it as files to edit.")
    for command in (site.show, site.export):
        sites.command(cls=CommandWithExamples, context_settings=HELP)(command)
    program.add_typer(sites, name="site", rich_help_panel=panel)
    return program


app = _assembled()


def call(words: Sequence[str] | None = None) -> int:
    """Do what the words ask for; a mistake ends in one line on standard error.

    Args:
        words: As on the command line, without the program's name; by default those of the process.

    Returns:
        The exit code.
    """
    try:
        code = app(words, prog_name="dva-sim", standalone_mode=False)
        sys.stdout.flush()
        return code if isinstance(code, int) else ExitCode.OK
    except (ReaderGone, BrokenPipeError):
        # What is still buffered would fail again when Python ends.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return ExitCode.READER_GONE
    except DvaSimError as error:
        return _told(error, error.exit_code)
    except UsageError as error:
        return _told_of_words(error)
    except OSError as error:
        where = f"{error.filename}: " if error.filename is not None else ""
        return _told(f"{where}{error.strerror or error}", ExitCode.MISTAKE)


def _told_of_words(error: Exception) -> int:
    if type(error).__name__ != "NoArgsIsHelpError":
        return _told(in_a_line(error), ExitCode.MISTAKE)
    typer.echo(error)
    return ExitCode.OK


def _told(problem: object, code: int) -> int:
    print(error_line(problem), file=sys.stderr)
    return code


def main() -> NoReturn:
    """Entry point: `dva-sim`."""
    sys.exit(call())
