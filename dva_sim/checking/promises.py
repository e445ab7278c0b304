"""How something that users bring kept what all of its kind promise."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

from dva_sim.plugins import FAILURES

Case = tuple[str, str]  # a promise in words, and what happened


@dataclass(frozen=True)
class Outcome:
    """What came of trying it.

    Attributes:
        broken: One line for each promise that it broke, with the first case.
        warnings: The same of what is made good when it runs, or what is only slow.
        tries: How often it was tried.
        slowest: Its longest answer [s].
    """

    broken: tuple[str, ...]
    warnings: tuple[str, ...]
    tries: int
    slowest: float


def part_by_part(parts: Iterable[Callable[[], Iterable[Case]]]) -> Iterator[Case]:
    """What the first part finds broken that finds anything: each builds on those before it."""
    for part in parts:
        try:
            broken = list(part())
        except FAILURES as error:
            broken = [("raises", said(error))]
        yield from broken
        if broken:
            return


def line(promise: str, cases: Sequence[str]) -> str:
    """A promise with the first case in which it was broken."""
    more = f"; and {len(cases) - 1} times more" if len(cases) > 1 else ""
    return f"{promise}: {cases[0]}{more}"


def said(error: BaseException) -> str:
    """An error in one line, with the line of the file that it comes from."""
    frame = traceback.extract_tb(error.__traceback__)[-1]
    text = " ".join(f"{type(error).__name__}: {error}".split())
    return f"{text} ({frame.filename.rsplit('/', 1)[-1]}:{frame.lineno})"
