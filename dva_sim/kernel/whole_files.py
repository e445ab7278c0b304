"""Atomic writing of files: complete or not at all, even if the process is killed."""

from __future__ import annotations

import glob
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def whole(path: Path) -> Iterator[Path]:
    """Yield a temporary path, which replaces `path` if the block ends without an error.

    It has the same ending, by which some writers choose the format.
    """
    _clear(path)
    part = path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}")
    try:
        yield part
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def _clear(path: Path) -> None:
    """Remove the temporary files of killed processes beside a file."""
    for part in path.parent.glob(f".{glob.escape(path.stem)}.*{glob.escape(path.suffix)}"):
        owner = part.name.removeprefix(f".{path.stem}.").removesuffix(path.suffix)
        if owner.isdecimal() and not _lives(int(owner)):
            part.unlink(missing_ok=True)


def _lives(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except OSError:  # a process of another user
        return True
    return True


def write_whole(path: Path, content: bytes | str) -> None:
    """Write bytes, or text as UTF-8 with unchanged line ends, atomically.

    Raises:
        OSError: it cannot be written; an existing file is unchanged.
    """
    with whole(path) as part:
        part.write_bytes(content.encode() if isinstance(content, str) else content)
