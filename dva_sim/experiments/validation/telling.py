"""How validations speak to the terminal."""

from __future__ import annotations

from functools import partial

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

WIDTH = 110  # of a table at least, also in a file

console = Console(highlight=False)
say = partial(console.print, soft_wrap=True)


def progress_bar() -> Progress:
    """A bar that says what is under way, how much of it is done, and for how long."""
    words = TextColumn("{task.description}")
    return Progress(words, BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), console=console)
