"""Cache of file contents, shared by the runs of a study, until the files change."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import lru_cache, wraps
from pathlib import Path
from typing import ParamSpec, TypeVar

Asked = ParamSpec("Asked")
Read = TypeVar("Read")

Version = tuple[str, tuple[int, ...]]


def read_once(
    files: Callable[..., Iterable[Path]], most: int = 64
) -> Callable[[Callable[Asked, Read]], Callable[Asked, Read]]:
    """Cache a function's results until one of its files changes.

    Args:
        files: Function that returns the files behind the first argument, such as a map and its
            image.
        most: Maximum number of cached results.
    """

    def decorate(read: Callable[Asked, Read]) -> Callable[Asked, Read]:
        @lru_cache(maxsize=most)
        def kept(_: tuple[Version, ...], *arguments: Asked.args, **named: Asked.kwargs) -> Read:
            return read(*arguments, **named)

        @wraps(read)
        def read_current(*arguments: Asked.args, **named: Asked.kwargs) -> Read:
            first = next(iter((*arguments, *named.values())))
            return kept(tuple(map(read_version, files(first))), *arguments, **named)  # type: ignore[arg-type]

        return read_current

    return decorate


def read_version(file: Path) -> Version:
    """Return the path of a file, and numbers that differ after any change; none if it is missing.

    They include the time of the last status change: copying or unpacking a file can set its
    modification time back.
    """
    path = file.absolute()
    try:
        status = path.stat()
    except (OSError, ValueError):  # reported when the file is read
        return str(path), ()
    return str(path), (status.st_ino, status.st_ctime_ns, status.st_mtime_ns, status.st_size)
