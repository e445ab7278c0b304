"""How much a command prints: mistakes alone, as usual, or more than usual."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from contextvars import ContextVar
from pathlib import Path

_verbose: ContextVar[bool] = ContextVar("verbose", default=False)


@contextmanager
def loudness(quiet: bool = False, verbose: bool = False) -> Iterator[None]:
    """Print nothing but mistakes inside, or more than usual."""
    token = _verbose.set(verbose and not quiet)
    try:
        if not quiet:
            yield
            return
        with Path(os.devnull).open("w", encoding="utf-8") as nowhere, redirect_stdout(nowhere):
            yield
    finally:
        _verbose.reset(token)


def is_verbose() -> bool:
    """Whether more than usual is wanted."""
    return _verbose.get()


def detail(line: str) -> None:
    """Print a line if more than usual is wanted."""
    if is_verbose():
        print(line)
