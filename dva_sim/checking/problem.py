"""What is wrong in a file, and where."""

from __future__ import annotations

from dataclasses import dataclass


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
