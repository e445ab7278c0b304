"""The console as its users start it."""

import re
from pathlib import Path

from helpers.processes.programs import Program, Programs


def started(programs: Programs, *words: str | Path) -> tuple[Program, str]:
    """A console that opens no browser, and its address."""
    console = programs.start("console", "--no-open", "--port", "0", *words)
    console.wait_to_say("Console:")
    return console, re.findall(r"^Console: +(\S+)$", console.output, re.MULTILINE)[0]
