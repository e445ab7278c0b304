"""What the program ends with: one number for each way in which a command can end."""

from __future__ import annotations

from enum import IntEnum
from typing import Final


class ExitCode(IntEnum):
    """How a command ended, as a shell and CI see it."""

    OK = 0
    DOES_NOT_HOLD = 1
    MISTAKE = 2
    RUNS_FAILED = 3
    GATE_FAILED = 4
    INTERRUPTED = 130
    READER_GONE = 141

    @property
    def meaning(self) -> str:
        """In a few words, as help and README say it."""
        return _MEANINGS[self]


_MEANINGS: Final = {
    ExitCode.OK: "done",
    ExitCode.DOES_NOT_HOLD: "a file, an agent or the emulated link that was checked is not valid",
    ExitCode.MISTAKE: "a mistake in the call or in a file, or what cannot be read or written",
    ExitCode.RUNS_FAILED: "runs failed; the others are kept, and the same command tries again",
    ExitCode.GATE_FAILED: "a gate failed: `compare --fail-if` holds, or `validate` misses",
    ExitCode.INTERRUPTED: "stopped by Ctrl-C; what is finished is kept (`live` ends with 0)",
    ExitCode.READER_GONE: "whoever read the output has gone, as in `| head`",
}
