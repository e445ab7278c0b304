"""Exit codes of the program, and the errors that a caller may handle.

Any other exception is a bug and keeps its traceback.
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
        """Meaning in a few words, for help and documentation."""
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
    """Base of all errors that a user can cause and correct.

    Attributes:
        exit_code: Exit code of the command line.
    """

    exit_code: ClassVar[ExitCode] = ExitCode.MISTAKE


class RunsFailed(DvaSimError):
    """Failure of runs although the input was valid."""

    exit_code = ExitCode.RUNS_FAILED


class ConfigError(DvaSimError):
    """Invalid input, in one line: place, mistake and correction.

    Args:
        problem: Mistake and correction, without a trailing full stop.
        file: File that contains the mistake, if any.
        line: Line in that file, counted from 1.
        column: Column in that line, counted from 1.
        keys: Changed keys at fault, if the unchanged file is valid.
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
    """Return a mistake as the command line prints it.

    It is one line, even if a name or path in it contains line breaks.
    """
    words = (
        word if len(word) <= _LONGEST else f"{word[:_LONGEST]}..." for word in str(problem).split()
    )
    return ERROR + visible(" ".join(words))


class RunTooLong(BaseException):
    """Time limit of a run. Not an `Exception`, so that no policy's `except` catches it."""
