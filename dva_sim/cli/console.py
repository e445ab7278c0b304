"""Where commands print for people."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from rich.console import Console
from rich.markup import escape

console = Console(highlight=False)
say = partial(console.print, soft_wrap=True)  # one line stays one line, also in a file


def warn(doubts: Sequence[str], where: Console = console) -> None:
    """Say what does not go together, a line for each."""
    for doubt in doubts:
        where.print(f"[yellow]warning:[/yellow] {escape(doubt)}", soft_wrap=True)
