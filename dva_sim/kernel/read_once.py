"""Keep contents of files in memory until the files change: the runs of a study share them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from contextlib import suppress
from functools import lru_cache, wraps
from pathlib import Path
from typing import ParamSpec, TypeVar

Asked = ParamSpec("Asked")
Read = TypeVar("Read")

_Version = tuple[str, int, int]


def read_once(
    files: Callable[..., Iterable[Path]], most: int = 64
) -> Callable[[Callable[Asked, Read]], Callable[Asked, Read]]:
    """Keep what a function makes of files as long as none of them changes.

    Args:
        files: Files that the function's first argument means, such as a map and its image.
        most: Number of results that are kept.
    """

    def keep(read: Callable[Asked, Read]) -> Callable[Asked, Read]:
        @lru_cache(maxsize=most)
        def kept(_: tuple[_Version, ...], *arguments: Asked.args, **named: Asked.kwargs) -> Read:
            return read(*arguments, **named)

        @wraps(read)
        def current(*arguments: Asked.args, **named: Asked.kwargs) -> Read:
            return kept(_versions(files(arguments[0])), *arguments, **named)  # type: ignore[arg-type]

        return current

    return keep


def _versions(files: Iterable[Path]) -> tuple[_Version, ...]:
    """Path, time of the last change [ns] and size [B] of each file that is there."""
    found = []
    for file in files:
        with suppress(OSError, ValueError):  # whoever reads it says so
            status = file.stat()
            found.append((str(file), status.st_mtime_ns, status.st_size))
    return tuple(found)
