"""Tables of mistakes: what is done, and what the one line names in which it ends.

A room keeps its tables in `test_mistakes.py`, a row a line: the arguments of a function, then the
codes, names and numbers, between spaces.
"""

import shlex
from collections.abc import Callable
from contextlib import chdir
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from helpers.processes.command_line import call
from helpers.wording import unnamed

from dva_sim.kernel.errors import ConfigError, ExitCode

each_mistake = partial(pytest.mark.parametrize, ("act", "error", "names"))


def mistakes(
    do: Callable[..., object], *rows: tuple[Any, ...], error: type[Exception] = ConfigError
) -> list[Any]:
    """Cases of `each_mistake`: a call with the arguments of each row, whose last word is names."""
    return [pytest.param(partial(do, *given), error, names, id=names) for *given, names in rows]


def check_mistake(
    folder: Path, act: Callable[[], object], error: type[Exception], names: str
) -> None:
    """Act in a folder: it should end in an error of one line that has all the names."""
    with chdir(folder), pytest.raises(error) as caught:
        act()
    line = str(caught.value)
    assert line.splitlines() == [line.strip()], line
    missing = unnamed(line, *names.split())
    assert not missing, f"{missing} are not in: {line}"


def of_file(read: Callable[[str], object], name: str) -> Callable[[str | bytes], object]:
    """Return a function that keeps a text in a file of the working folder, and reads it."""

    def read_text(text: str | bytes) -> object:
        Path(name).write_bytes(text.encode() if isinstance(text, str) else text)
        return read(name)

    return read_text


class Refused(Exception):
    """A command that has ended with exit code 2, and the line that says why."""


def command(words: str) -> None:
    """Call `dva-sim WORDS`.

    Raises:
        Refused: It has ended so, and has printed nothing else.
    """
    done = call(*shlex.split(words))
    if done.returncode == ExitCode.MISTAKE:
        assert (done.stdout, done.stderr[:7]) == ("", "error: ")
        raise Refused(done.stderr.removesuffix("\n"))
