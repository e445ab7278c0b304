"""Commands and groups of commands: how they are made, read their words, and look in help.

A call makes the one command that it names: to make all of them takes as long as to load Typer.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from typing import Any, ClassVar

import typer
from typer.core import TyperCommand, TyperGroup
from typer.main import get_command, get_group

from dva_sim.cli.options import from_words
from dva_sim.kernel.suggestions import hint

Command = Callable[..., None] | typer.Typer
Panels = Mapping[str, Mapping[str, Command]]
"""Headings, and below each of them commands by name, or groups of such."""

HELP = {"help_option_names": ["-h", "--help"]}
_EXAMPLES = "\nExamples:\n"


def name_of(param: Any) -> str:
    """Return an option by its long name, an argument by the word in the usage."""
    if param.param_type_name == "argument":
        return str(param.metavar or param.name.upper())
    return str(max(param.opts, key=len))


class CommandWithExamples(TyperCommand):
    """A command whose docstring ends in examples, each `call  # what it does`.

    Attributes:
        examples: The calls, with what they do.
    """

    def __init__(self, *args: Any, help: str | None = None, **others: Any) -> None:
        text, _, examples = inspect.cleandoc(help or "").partition(_EXAMPLES)
        super().__init__(*args, help=text.strip(), **others)
        self.examples = [
            (call.strip(), entry.strip())
            for call, _, entry in (line.partition("  # ") for line in examples.splitlines())
            if call.strip()
        ]

    def collect_usage_pieces(self, ctx: Any) -> list[str]:
        """Write options, then the required arguments, then the optional ones in brackets."""
        arguments = [p for p in self.get_params(ctx) if p.param_type_name == "argument"]
        names = [name_of(p) if p.required else f"[{name_of(p)}]" for p in arguments]
        return ["[OPTIONS]", *names]

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Write arguments by the words of the usage, then options."""
        arguments = [p for p in self.get_params(ctx) if p.param_type_name == "argument"]
        if arguments:
            with formatter.section("Arguments"):
                formatter.write_dl([(name_of(p), getattr(p, "help", "")) for p in arguments])
        records = [p.get_help_record(ctx) for p in self.get_params(ctx) if p not in arguments]
        with formatter.section("Options"):
            formatter.write_dl([record for record in records if record is not None])

    def format_epilog(self, ctx: Any, formatter: Any) -> None:
        """Write the examples unwrapped, since wrapped ones cannot be copied."""
        super().format_epilog(ctx, formatter)
        if not self.examples:
            return
        with formatter.section("Examples"):
            for call, entry in self.examples:
                if entry:
                    formatter.write(f"  # {entry}\n")
                formatter.write(f"  {call}\n")


class PanelGroup(TyperGroup):
    """A group whose commands stand under headings; each is made when it is asked for.

    Attributes:
        panels: Panels with their commands.
    """

    panels: ClassVar[Panels] = {}

    def list_commands(self, ctx: Any) -> list[str]:
        """Return the their names, panel by panel."""
        return [name for commands in self.panels.values() for name in commands]

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Return one of them; None if there is none of that name."""
        for commands in self.panels.values() if cmd_name not in self.commands else ():
            if cmd_name in commands:
                self.add_command(_made(cmd_name, commands[cmd_name]), cmd_name)
        return super().get_command(ctx, cmd_name)

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Resolve a command; for an unknown one, suggest the nearest."""
        name = args[0]
        if not ctx.resilient_parsing and self.get_command(ctx, name) is None and name[0] != "-":
            if name == "help":
                call = " ".join((ctx.command_path, *args[1:], "--help"))
                ctx.fail(f"'help' is not a command; did you mean {call!r}?")
            ctx.fail(f"{name!r} is not a command; {hint(name, self.list_commands(ctx))}")
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write one list for each panel."""
        widest = max(map(len, self.list_commands(ctx)))
        for title, commands in self.panels.items():
            with formatter.section(title):
                room = formatter.width - widest - 4
                rows = [(n.ljust(widest), _in_short(of, room)) for n, of in commands.items()]
                formatter.write_dl(rows)


def _in_short(command: Command, room: int) -> str:
    """Return a command's summary without making the command."""
    text = command.info.help if isinstance(command, typer.Typer) else command.__doc__
    return str(CommandWithExamples("", help=str(text)).get_short_help_str(room))


def _made(name: str, command: Command) -> Any:
    if isinstance(command, typer.Typer):
        return get_group(command)
    alone = make_typer(None)
    alone.command(name, cls=CommandWithExamples, context_settings=HELP)(from_words(command))
    return get_command(alone)


def make_typer(
    cls: type[PanelGroup] | None, help: str = "", add_completion: bool = False
) -> typer.Typer:
    """Return a Typer with our layout, of a group or of one command."""
    return typer.Typer(
        cls=cls,
        help=help,
        no_args_is_help=cls is not None,
        add_completion=add_completion,
        context_settings=HELP,
        rich_markup_mode=None,  # a third of the time that help takes
        pretty_exceptions_enable=False,
    )
