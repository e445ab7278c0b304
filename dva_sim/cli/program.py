"""The program: all commands in their groups, and how each of them ends."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Sequence
from typing import Annotated, NoReturn

import typer

from dva_sim.cli import files, results, runs, site, studies
from dva_sim.cli.layout import HELP, Command, Group, Program, ReaderGone
from dva_sim.cli.mistakes import UsageError, in_a_line
from dva_sim.errors import DvaSimError, error_line
from dva_sim.exit_codes import ExitCode

_PANELS: dict[str, tuple[Callable[..., None], ...]] = {
    "Studies": (studies.demo, studies.run, studies.new, studies.register, studies.tune),
    "Results": (results.report, results.show, results.export, results.compare),
    "Single runs": (runs.episode, runs.replay, runs.live, runs.keys),
    "Names, files and evidence": (
        files.list_,
        files.plugins,
        files.check,
        files.schema,
        files.validate,
    ),
}


def _typer(cls: type[Group], help: str) -> typer.Typer:
    return typer.Typer(
        cls=cls,
        help=help,
        no_args_is_help=True,
        add_completion=cls is Program,
        context_settings=HELP,
        rich_markup_mode=None,  # a third of the time that help takes
        pretty_exceptions_enable=False,
    )


def _print_version(wanted: bool) -> None:
    if wanted:
        from dva_sim import __version__

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
    program = _typer(Program, "")
    program.callback()(_program)
    for panel, commands in _PANELS.items():
        for command in commands:
            name = command.__name__.rstrip("_")
            program.command(name, cls=Command, rich_help_panel=panel, context_settings=HELP)(
                command
            )
    sites = _typer(Group, "Draw a site, or write it as files to edit.")
    for command in (site.show, site.export):
        sites.command(cls=Command, context_settings=HELP)(command)
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
