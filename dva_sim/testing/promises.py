"""What came of trying something that users bring, and problems that were found in a file."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

from dva_sim.kernel.plugins import FAILURES

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


class BrokenPromises(AssertionError):
    """Something breaks what all of its kind promise; a line for each promise.

    Attributes:
        outcome: All that came of trying it.
    """

    def __init__(self, outcome: Outcome) -> None:
        super().__init__("\n".join(outcome.broken))
        self.outcome = outcome


def kept(outcome: Outcome) -> Outcome:
    """What came of it, if all promises were kept.

    Raises:
        BrokenPromises: they were not.
    """
    if outcome.broken:
        raise BrokenPromises(outcome)
    return outcome


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


@dataclass(frozen=True, order=True)
class Problem:
    """One mistake.

    Attributes:
        line: Line in the file, from 1.
        column: Column in that line, from 1, in characters.
        text: What is wrong; what would be right.
        file: The file that holds it, if not the one that was checked.
    """

    line: int
    column: int
    text: str
    file: str | None = None


def at(data: bytes, offset: int, text: str) -> Problem:
    """The mistake at a byte of a text in UTF-8, whichever way its lines end."""
    before = data[:offset].decode("utf-8", "replace").replace("\r\n", "\n").replace("\r", "\n")
    line_start = before.rfind("\n") + 1
    return Problem(before.count("\n") + 1, len(before) - line_start + 1, text)


def not_text(data: bytes) -> Problem | None:
    """The first byte that text in UTF-8 cannot have, if there is one."""
    zero = data.find(0)
    try:
        data.decode("utf-8")
    except UnicodeDecodeError as error:
        if zero < 0 or error.start < zero:
            found = f"byte 0x{data[error.start]:02X} is not text in UTF-8"
            return at(data, error.start, f"{found}; the file should be in UTF-8")
    return (
        at(data, zero, "a zero byte is not text; the file should be in UTF-8")
        if zero >= 0
        else None
    )
