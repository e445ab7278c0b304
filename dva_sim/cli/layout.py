"""How help is laid out: examples below the options, commands in groups, exit codes at the end."""

from __future__ import annotations

import inspect
from typing import Any

from typer.core import TyperCommand, TyperGroup

from dva_sim.cli.mistakes import name_of
from dva_sim.errors import DvaSimError
from dva_sim.exit_codes import ExitCode
from dva_sim.guesses import hint

HELP = {"help_option_names": ["-h", "--help"]}
_EXAMPLES = "\nExamples:\n"


class Command(TyperCommand):
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


class Group(TyperGroup):
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


class Program(Group):
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
