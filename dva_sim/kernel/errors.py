"""Exit codes of the program, one for each way in which a command can end.

Errors that a caller may handle; everything else is a bug and keeps its traceback.
"""

from __future__ import annotations

from enum import IntEnum
from pathlib import Path
from typing import ClassVar, Final

from dva_sim.kernel.labels import visible


class ExitCode(IntEnum):
    """Exit code of a command, as a shell and CI see it."""

    OK = 0
    DOES_NOT_HOLD = 1
    MISTAKE = 2
    RUNS_FAILED = 3
    GATE_FAILED = 4
    NOT_JUDGED = 5
    INTERRUPTED = 130
    READER_GONE = 141

    @property
    def meaning(self) -> str:
        """In a few words, as help and the documentation say it."""
        return _MEANINGS[self]


_MEANINGS: Final = {
    ExitCode.OK: "done",
    ExitCode.DOES_NOT_HOLD: "a check failed, or a live run broke a safety rule",
    ExitCode.MISTAKE: "usage error, invalid file, or a file that cannot be read or written",
    ExitCode.RUNS_FAILED: "runs or tables failed (run again to retry), or a plug-in failed",
    ExitCode.GATE_FAILED: "a gate failed: `compare --fail-if` holds, or `validate` misses",
    ExitCode.NOT_JUDGED: "facts to judge some safety rules are missing; none is broken",
    ExitCode.INTERRUPTED: "Ctrl-C or SIGTERM; what is finished is kept (`live`, `console`: 0)",
    ExitCode.READER_GONE: "the reader of the output has ended, as in `| head`",
}


class DvaSimError(Exception):
    """Base of all errors a user can cause and mend.

    Attributes:
        exit_code: Exit code of the command line.
    """

    exit_code: ClassVar[ExitCode] = ExitCode.MISTAKE


class RunsFailed(DvaSimError):
    """Runs failed, so there is nothing to go on with; the input was as it should be."""

    exit_code = ExitCode.RUNS_FAILED


class ConfigError(DvaSimError):
    """Bad input: one line that says where, what, and what would be right.

    Args:
        problem: Mistake and correction, without a trailing full stop.
        file: The file that holds the mistake, if one does.
        line: Line in that file, counted from 1.
        column: Column in that line, counted from 1.
        keys: Changed keys at fault, if the file alone is valid.
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
_LONGEST = 160  # maximum characters of a word


def error_line(problem: object) -> str:
    """Return a mistake as the command line says it.

    One line, whatever a name or a file in it holds.
    """
    words = (
        word if len(word) <= _LONGEST else f"{word[:_LONGEST]}..." for word in str(problem).split()
    )
    return ERROR + visible(" ".join(words))


class RunTooLong(BaseException):
    """A run has taken too long. No `Exception`, so that no policy takes it for its own."""
