"""Terminal on which commands print for people."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import partial

from rich.console import Console
from rich.markup import escape

console = Console(highlight=False)
say = partial(console.print, soft_wrap=True)  # one line stays one line, also in a file


def print_lines(lines: Iterable[str], where: Console = console) -> None:
    """Print each in a line, however long it is."""
    for line in lines:
        where.print(line, soft_wrap=True)


def warn(doubts: Sequence[str], where: Console = console) -> None:
    """Say what does not go together, a line for each."""
    print_lines((f"[yellow]warning:[/yellow] {escape(doubt)}" for doubt in doubts), where)
