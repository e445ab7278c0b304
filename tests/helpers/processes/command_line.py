"""The command line, called in this process: its words, what it prints, its exit code.

To start a program takes a second or more of computing. Only one test of `test_command_line` does,
and for a process that can be stopped see `programs`.
"""

import contextlib
import io
import sys
from collections.abc import Iterator
from pathlib import Path
from subprocess import CompletedProcess
from unittest import mock

from dva_sim import cli

WIDE = "200"  # columns, so that no line is broken


def call(*words: str | Path, cwd: Path | None = None, stdin: str = "") -> CompletedProcess[str]:
    """Run `dva-sim WORDS` in a folder, with `stdin` on its standard input."""
    out, errors = _written(), _written()
    with _terminal(out, errors, stdin), contextlib.chdir(cwd or Path.cwd()):
        code = cli.call([str(word) for word in words])
    return CompletedProcess(words, code, *(_text(stream) for stream in (out, errors)))


def ended(*words: str | Path, cwd: Path | None = None) -> tuple[int, str, str]:
    """The exit code of `dva-sim WORDS`, its output, and its complaint."""
    done = call(*words, cwd=cwd)
    return done.returncode, done.stdout, done.stderr


@contextlib.contextmanager
def _terminal(out: io.TextIOWrapper, errors: io.TextIOWrapper, stdin: str) -> Iterator[None]:
    typed = io.TextIOWrapper(io.BytesIO(stdin.encode()), "utf-8")
    with (
        mock.patch.object(sys, "stdin", typed),
        mock.patch.dict("os.environ", {"COLUMNS": WIDE}),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(errors),
    ):
        yield


def _written() -> io.TextIOWrapper:
    return io.TextIOWrapper(io.BytesIO(), "utf-8", newline="\n", write_through=True)


def _text(stream: io.TextIOWrapper) -> str:
    return stream.buffer.getvalue().decode()  # type: ignore[attr-defined,no-any-return]
