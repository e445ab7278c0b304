"""Another version of the program as a folder, and programs that end with the one that asked."""

import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from helpers.paths import ROOT

RUNNING: list[subprocess.Popen[Any]] = []
"""Processes that end with this program; each leads a session of its own."""
STARTING: list[Sequence[str]] = []
"""Programs that may run already, and are not among those yet."""
HELD: list[int] = []
"""Signals that came meanwhile."""


@contextmanager
def version(commit: str) -> Iterator[Path]:
    """The files of a commit in a folder of their own, of which Git knows nothing."""
    with tempfile.TemporaryDirectory() as folder:
        packed = subprocess.check_output(["git", "-C", str(ROOT), "archive", commit])
        subprocess.run(["tar", "-x", "-C", folder], input=packed, check=True)
        yield Path(folder)


def output(words: Sequence[str], **options: Any) -> str:
    """Output of a program, which ends with this one, children included.

    Raises:
        subprocess.CalledProcessError: it failed.
    """
    pipes = {"stdout": subprocess.PIPE, "text": True, "start_new_session": True}
    with _started(words, pipes | options) as program:
        text, _ = program.communicate()
    if program.returncode:
        raise subprocess.CalledProcessError(program.returncode, list(words))
    return str(text)


def _started(words: Sequence[str], options: dict[str, Any]) -> subprocess.Popen[Any]:
    """A program that runs and is known to run: no signal comes between the two."""
    STARTING.append(words)
    try:
        program = subprocess.Popen(words, **options)
        RUNNING.append(program)
    finally:
        STARTING.remove(words)
        if HELD and not STARTING:
            os.kill(os.getpid(), HELD.pop())
    return program


def end_with_signals() -> None:
    """From now on Ctrl-C and SIGTERM end all programs that run, and leave no folder behind."""
    signal.signal(signal.SIGINT, _end)
    signal.signal(signal.SIGTERM, _end)


def _end(number: int, _: object) -> None:
    if STARTING:
        HELD.append(number)
        return
    for program in RUNNING:
        if program.poll() is None:
            os.killpg(program.pid, signal.SIGKILL)
    sys.exit(128 + number)
