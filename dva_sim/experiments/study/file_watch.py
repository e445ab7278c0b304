"""Files that runs read while a study is run: all runs are to read the same."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from dva_sim.experiments.study.hashing import hash_of_file
from dva_sim.kernel.errors import ConfigError


class FileWatch:
    """Remembers the contents of files, and refuses others.

    Args:
        files: Names for messages, and paths; each file must be there.
    """

    def __init__(self, files: Iterable[tuple[str, Path]]) -> None:
        self._names = {path: name for name, path in files}
        self._hashes = {path: hash_of_file(path) for path in self._names}
        self._seen = {path: _version(path) for path in self._names}

    def refuse_changes(self) -> None:
        """Do nothing while the files are as they were.

        Raises:
            ConfigError: one of them has changed, or has gone.
        """
        for path, name in self._names.items():
            version = _version(path)
            if version == self._seen[path]:
                continue  # most of the time, and much faster than its contents
            if version is None or hash_of_file(path) != self._hashes[path]:
                raise ConfigError(
                    f"{name} has {'gone' if version is None else 'changed'} since the study began; "
                    "put it back and run the same command again, or give another folder with -o"
                )
            self._seen[path] = version


def _version(path: Path) -> tuple[int, int] | None:
    """Time of the last change [ns] and size [B]; None if it is not there."""
    try:
        status = path.stat()
    except OSError:
        return None
    return status.st_mtime_ns, status.st_size
