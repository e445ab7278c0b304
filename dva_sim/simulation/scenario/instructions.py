"""Instructions for a kind of event: a short text for people, with steps to tick.

A file is Markdown or plain text. Lines that begin as those of a list (`-`, `*`, `1.`, also with an
empty box `[ ]`) are steps; headings and all other lines are text between them.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final, NamedTuple

from dva_sim.kernel.errors import ConfigError

MAX_LINES: Final = 64
MAX_LINE: Final = 256  # maximum characters of a line
_STEP: Final = re.compile(r"(?:[-*+]|\d{1,2}[.)])\s+(?:\[[ xX]?\]\s*)?(.*)")


class Instruction(NamedTuple):
    """Line of instructions.

    Attributes:
        text: Text without marks of a list or heading.
        is_step: True if people do it and tick it.
    """

    text: str
    is_step: bool


def read_instructions(path: Path) -> tuple[Instruction, ...]:
    """Return the lines of a file that are not empty.

    Raises:
        ConfigError: it cannot be read, or is no short text; the line says why.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise ConfigError(f"instructions {str(path)!r} are no text in UTF-8") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise ConfigError(f"instructions {str(path)!r} cannot be read: {reason}") from None
    lines = [" ".join(line.split()) for line in text.splitlines()]
    instructions = tuple(_instruction(line) for line in lines if line)
    if not instructions or len(instructions) > MAX_LINES:
        has = f"{len(instructions)} lines" if instructions else "no text"
        raise ConfigError(f"instructions {str(path)!r} have {has}; 1 to {MAX_LINES} lines fit")
    if any(len(line.text) > MAX_LINE for line in instructions):
        raise ConfigError(
            f"instructions {str(path)!r} have a line of more than {MAX_LINE} characters"
        )
    return instructions


def _instruction(line: str) -> Instruction:
    step = _STEP.fullmatch(line)
    if step is not None:
        return Instruction(step[1], True)
    return Instruction(line.lstrip("# "), False)
