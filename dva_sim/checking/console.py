"""What `check` and `schema` print, and the exit code they end with."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from dva_sim.checking.files import NotReadError, Verdict, check_file
from dva_sim.checking.messages import READ_BYTES, check_message
from dva_sim.checking.schemas import schema_text

STDIN: Final = "-"
VALID, INVALID, NOT_READ = 0, 1, 2  # exit codes; the highest of all files counts
_SHOWN: Final = 50  # problems of one file


def check(names: Sequence[str]) -> int:
    """Tell of each file whether it is valid, and if not, why; the exit code."""
    codes = [_check_one(name) for name in names]
    count = Counter(codes)
    words = {VALID: "valid", INVALID: "invalid", NOT_READ: "not read"}
    files = "1 file" if len(codes) == 1 else f"{len(codes)} files"
    found = ", ".join(f"{count[code]} {word}" for code, word in words.items() if count[code])
    print(f"{files}: {found}")
    return max(codes, default=VALID)


def print_schema(kind: str) -> None:
    """Print a schema as it is, so that it can be written into a file."""
    sys.stdout.write(schema_text(kind))


def _check_one(name: str) -> int:
    try:
        verdict = _judge(name)
    except NotReadError as error:
        _say(f"{name}: {error}")
        return NOT_READ
    for problem in verdict.problems[:_SHOWN]:
        where = _near(problem.file) if problem.file else name
        _say(f"{where}:{problem.line}:{problem.column}: {problem.text}")
    number = len(verdict.problems)
    if not number:
        _say(f"{name}: {verdict.kind}: valid")
        return VALID
    more = f", the first {_SHOWN} shown" if number > _SHOWN else ""
    _say(f"{name}: {verdict.kind}: invalid, {number} problem{'s'[: number > 1]}{more}")
    return INVALID


def _judge(name: str) -> Verdict:
    if name == STDIN:
        return Verdict("message", check_message(sys.stdin.buffer.read(READ_BYTES)))
    return check_file(Path(name))


def _near(file: str) -> str:
    """A path as one would write it here."""
    here = Path.cwd()
    return str(Path(file).relative_to(here)) if Path(file).is_relative_to(here) else file


def _say(text: str) -> None:
    """One line stays one line, whatever a file or its name holds."""
    escaped = (c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)
    print("".join(escaped))
