"""Keep contents of files in memory until the files change: the runs of a study share them."""

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
        files: Function that returns the files of the first argument, such as a map and its image.
        most: Number of results that are kept.
    """

    def keep(read: Callable[Asked, Read]) -> Callable[Asked, Read]:
        @lru_cache(maxsize=most)
        def kept(_: tuple[Version, ...], *arguments: Asked.args, **named: Asked.kwargs) -> Read:
            return read(*arguments, **named)

        @wraps(read)
        def current(*arguments: Asked.args, **named: Asked.kwargs) -> Read:
            first = next(iter((*arguments, *named.values())))
            return kept(tuple(map(version_of, files(first))), *arguments, **named)  # type: ignore[arg-type]

        return current

    return keep


def version_of(file: Path) -> Version:
    """Return the path of a file, and numbers that differ after any change.

    No numbers if it does not exist.

    They include the time of the last status change, since tools that copy or unpack files set the
    modification time back.
    """
    path = file.absolute()
    try:
        status = path.stat()
    except (OSError, ValueError):  # reported when the file is read
        return str(path), ()
    return str(path), (status.st_ino, status.st_ctime_ns, status.st_mtime_ns, status.st_size)
