"""The page of all commands: usage, arguments, options and examples, as `--help` shows them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from typer import Context
from typer.main import get_command

from dva_sim.cli.commands import name_of
from dva_sim.cli.program import app
from generators.markdown import code, paragraphs, prose, sentence, shell, table
from generators.markdown import page as page_of

_HEAD = """\
`dva-sim COMMAND --help` prints the same text. The functions of the
[Python API](python.md) take the same options under the same names, and
[exit codes](exit-codes.md) say how a command ended."""


def page() -> str:
    """Return the page in Markdown."""
    program: Any = get_command(app)
    context = _context(program, "dva-sim")
    blocks = [_HEAD, "## dva-sim", prose(program.help or ""), _options(program, context)]
    for title, commands in program.panels.items():
        blocks.append(f"## {title}")
        for name in commands:
            blocks += _command(program.get_command(context, name), f"dva-sim {name}")
    return page_of("Command line", *blocks)


def _context(command: Any, path: str) -> Context:
    return Context(command, info_name=path)


def _command(command: Any, path: str) -> Iterator[str]:
    """Yield the blocks of a command, or of each command of a group."""
    context = _context(command, path)
    yield f"### {path}"
    if hasattr(command, "panels"):
        yield prose(command.help or "")
        for name in command.list_commands(context):
            yield from _subcommand(command.get_command(context, name), f"{path} {name}")
        return
    yield from _body(command, context)


def _subcommand(command: Any, path: str) -> Iterator[str]:
    yield f"#### {path}"
    yield from _body(command, _context(command, path))


def _body(command: Any, context: Context) -> Iterator[str]:
    yield paragraphs(command.help or "")
    yield shell([f"{context.info_name} {' '.join(command.collect_usage_pieces(context))}"])
    yield _options(command, context)
    if examples := getattr(command, "examples", ()):
        calls = (f"$ {call}" + f"  # {does}" * bool(does) for call, does in examples)
        yield "\n".join(["```console", *calls, "```"])


def _options(command: Any, context: Context) -> str:
    rows = [_row(param, context) for param in command.get_params(context)]
    return table(["argument or option", "meaning", "default"], [row for row in rows if row])


def _row(param: Any, context: Context) -> list[str]:
    if getattr(param, "hidden", False):
        return []
    meaning = sentence(getattr(param, "help", "") or "")
    if param.param_type_name == "argument":
        return [code(name_of(param)), meaning, "required" * param.required]
    record = param.get_help_record(context)
    default = param.default if isinstance(param.default, (int, float, str)) else ""
    shown = "" if param.is_flag else code(default)
    return [code(record[0]), meaning, "required" if param.required else shown]
