"""Errors that a caller may handle; everything else is a bug and keeps its traceback."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar

from dva_sim.exit_codes import ExitCode


class DvaSimError(Exception):
    """Base of all errors a user can cause and mend.

    Attributes:
        exit_code: What the command line ends with.
    """

    exit_code: ClassVar[ExitCode] = ExitCode.MISTAKE


class RunsFailed(DvaSimError):
    """Runs failed, so there is nothing to go on with; the input was as it should be."""

    exit_code = ExitCode.RUNS_FAILED


class ConfigError(DvaSimError):
    """Bad input: one line that says where, what, and what would be right.

    Args:
        problem: What is wrong and what would be right, without a trailing full stop.
        file: The file that holds the mistake, if one does.
        line: Line in that file, counted from 1.
        column: Column in that line, counted from 1.
        keys: Which of the keys that were changed are at fault, if the file alone is valid.
    """

    def __init__(
        self,
        problem: str,
        file: str | Path | None = None,
        line: int | None = None,
        column: int | None = None,
        keys: tuple[str, ...] = (),
    ) -> None:
        self.keys = keys
        self.problem = problem
        self.file = None if file is None else str(file)
        self.line = line
        self.column = column
        super().__init__(problem)

    def __str__(self) -> str:
        place = ":".join(str(p) for p in (self.file, self.line, self.column) if p is not None)
        return f"{place}: {self.problem}" if place else self.problem

    def __reduce__(self) -> tuple[object, ...]:
        return type(self), (self.problem, self.file, self.line, self.column, self.keys)


ERROR = "error: "
_LONGEST = 160  # characters of a word


def error_line(problem: object) -> str:
    """A mistake as the command line says it: one line, whatever a name or a file in it holds."""
    words = (
        word if len(word) <= _LONGEST else f"{word[:_LONGEST]}..." for word in str(problem).split()
    )
    text = " ".join(words)
    return ERROR + "".join(
        c if c.isprintable() else c.encode("unicode_escape").decode() for c in text
    )
