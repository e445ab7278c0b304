"""The program: all commands in their groups, how their help is laid out, and how each of them ends.

A mistake on the command line is reported in one line that says what would be right.
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Callable, Sequence
from typing import Annotated, Any, ClassVar, NoReturn

import typer

from dva_sim import __version__
from dva_sim.cli import answers, files, link, load, results, runs, site, storm, studies, users
from dva_sim.cli.commands import Command, PanelGroup, Panels, make_typer, name_of
from dva_sim.cli.plain_output import replace_what_cannot_be_shown
from dva_sim.kernel import early_stop
from dva_sim.kernel.errors import DvaSimError, ExitCode, error_line
from dva_sim.kernel.retired import use_now
from dva_sim.kernel.suggestions import either, hint


def in_a_line(error: Any) -> str:
    """Describe the mistake in a call, and the correct form."""
    path = error.ctx.command_path if error.ctx is not None else "dva-sim"
    more = f"see {path} --help"
    kind = type(error).__name__
    if kind == "NoSuchOption":
        instead = use_now("option", error.option_name)
        return instead or f"{path} has no option {error.option_name!r}; {_options(error, more)}"
    if kind == "MissingParameter":
        return f"{path} needs {name_of(error.param)}: {_help(error.param)}; {more}"
    if kind == "BadParameter" and error.param is not None:
        return f"{name_of(error.param)} {_plain(error.message)}"
    if kind == "BadOptionUsage":
        takes = "a" if "requires" in error.message else "no"
        return f"{error.option_name} takes {takes} value"
    if extra := re.fullmatch(r"Got unexpected extra argument(?:s|\(s\))? \((.*)\)", error.message):
        return f"{path} does not know what to do with {extra[1]!r}; {more}"
    problem = str(error.format_message()).rstrip(".")
    text = f"{path}: {problem[:1].lower()}{problem[1:]}"
    return text if text.endswith("?") else f"{text}; {more}"


_BOUNDS = {
    "less than or equal to": "at most",
    "greater than or equal to": "at least",
    "less than": "below",
    "greater than": "above",
}


def _plain(message: str) -> str:
    """Return the parser library's bounds on a number in plain words."""
    for theirs, ours in _BOUNDS.items():
        message = message.replace(f"Input should be {theirs}", f"should be {ours}")
    return message


def _help(param: Any) -> str:
    text = str(param.help or "").rstrip(".")
    return text[:1].lower() + text[1:]


def _options(error: Any, more: str) -> str:
    if error.ctx is None:
        return more
    names = [opt for param in error.ctx.command.get_params(error.ctx) for opt in param.opts]
    near = hint(error.option_name, [opt for opt in names if opt.startswith("--")])
    if near.startswith("did you"):
        return near
    keys = _keys(error.option_name.lstrip("-")) if "--set" in names else []
    return f"did you mean {either(f'--set {key}=VALUE' for key in keys)}?" if keys else more


def _keys(name: str) -> list[str]:
    from dva_sim.experiments.study.study import Study  # late: start-up
    from dva_sim.kernel.config import keys_meant  # late: start-up
    from dva_sim.simulation.scenario import Scenario  # late: start-up

    return keys_meant((name.replace("-", "_"),), None, Study, Scenario)


class Stopped(DvaSimError):
    """Somebody stopped a command before its end."""

    exit_code = ExitCode.INTERRUPTED


class ReaderGone(DvaSimError):
    """The reader of a command's output, such as a pipe, has closed it."""

    exit_code = ExitCode.READER_GONE


class SiteGroup(PanelGroup):
    """The commands about one site."""

    panels: ClassVar[Panels] = {"Commands": {"show": site.show, "export": site.export}}


class UsersGroup(PanelGroup):
    """The commands about the users of a console."""

    panels: ClassVar[Panels] = {
        "Commands": {
            "add": users.add,
            "change": users.change,
            "remove": users.remove,
            "lock": users.lock,
            "unlock": users.unlock,
            "list": users.list_,
        }
    }


def _named(*commands: Callable[..., None]) -> dict[str, Command]:
    return {command.__name__.rstrip("_").replace("_", "-"): command for command in commands}


class DvaSimProgram(PanelGroup):
    """The program itself, whose help ends with the exit codes."""

    panels: ClassVar[Panels] = {
        "Studies": _named(
            studies.demo, studies.run, studies.new, studies.register, studies.tune, studies.screen
        ),
        "Results": _named(
            results.report, results.show, results.export, results.compare, answers.answers
        ),
        "Single runs": {
            **_named(runs.episode, runs.replay, runs.live, runs.console),
            **_named(runs.robot, link.link, load.load, runs.keys),
            "users": make_typer(UsersGroup, help="Add, change and lock users of a console."),
        },
        "Listing, checking and validation": {
            **_named(files.list_, files.plugins, files.assumed, files.check),
            **_named(files.phone_log, files.schema, files.validate, storm.storm),
            "site": make_typer(SiteGroup, help="Draw a site, or write it as files to edit."),
        },
    }

    def invoke(self, ctx: Any) -> Any:
        """Tell who ended a command from outside; the parser would end the program by itself."""
        try:
            early_stop.raise_again()
            return super().invoke(ctx)
        except KeyboardInterrupt as stop:
            raise Stopped(str(stop) or early_stop.STOPPED) from None
        except BrokenPipeError:
            raise ReaderGone("nobody reads") from None

    def format_epilog(self, ctx: Any, formatter: Any) -> None:
        """Explain the exit codes."""
        with formatter.section("Exit codes"):
            formatter.write_dl([(str(int(code)), code.meaning) for code in ExitCode])


def _print_version(is_given: bool) -> None:
    if is_given:
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
    """Test surveillance teams of people and teleoperated robots."""


_NO_MEMORY = re.compile("map segment|start new thread|annot allocate memory|ut of memory")
"""Errors of libraries that found none."""

app = make_typer(DvaSimProgram, add_completion=True)
app.callback()(_program)


def call(words: Sequence[str] | None = None) -> int:
    """Run a command line; a mistake ends in one line on standard error.

    Args:
        words: Arguments of the command line, without the program's name; by default those of the
            process.

    Returns:
        The exit code.
    """
    replace_what_cannot_be_shown()
    try:
        code = app(words, prog_name="dva-sim", standalone_mode=False)
        sys.stdout.flush()
        return code if isinstance(code, int) else ExitCode.OK
    except (ReaderGone, BrokenPipeError):
        # What is still buffered would fail again when Python ends.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return ExitCode.READER_GONE
    except DvaSimError as error:
        return _report(error, error.exit_code)
    except typer.TyperException as error:
        if type(error).__name__ != "NoArgsIsHelpError":
            return _report(in_a_line(error), ExitCode.MISTAKE)
        typer.echo(error)
        return ExitCode.OK
    except OSError as error:
        where = f"{error.filename}: " if error.filename is not None else ""
        return _report(f"{where}{error.strerror or error}", ExitCode.MISTAKE)
    except Exception as error:
        if not isinstance(error, MemoryError) and not _NO_MEMORY.search(str(error)):
            raise
        problem = "out of memory; what is finished is kept: free some, then run the command again"
        return _report(problem, ExitCode.RUNS_FAILED)


def _report(problem: object, code: int) -> int:
    print(error_line(problem), file=sys.stderr)
    return code


def main() -> NoReturn:
    """Run the command line of the process, and end the process."""
    sys.exit(call())
