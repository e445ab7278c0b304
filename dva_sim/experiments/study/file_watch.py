"""Watch on the files that the runs of a study read, so that all runs read the same contents."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.read_once import Version, version_of

Files = Callable[[], Iterable[tuple[str, Path]]]


class FileWatch:
    """Remembers the versions of files, and refuses runs made after a change.

    A check takes 0.2 ms while no file, and no folder that may get a new one, has changed.

    Args:
        files: Returns the files' names for messages, and their paths as runs would find them now.
        folders: Returns the folders in which a new file could hide one of them.
    """

    def __init__(self, files: Files, folders: Callable[[], Iterable[Path]]) -> None:
        self._files = files
        self._folders = folders
        self._places: tuple[Path, ...] = ()
        self._seen: tuple[Version, ...] = ()
        self._begun = self._look()

    def refuse_changes(self) -> None:
        """Do nothing while the files are as they were.

        A file that was changed and restored also counts: some runs may have read the change.

        Raises:
            ConfigError: a file was written or deleted, or a new one hides it.
        """
        if tuple(map(version_of, self._places)) == self._seen:
            return
        now = self._look()
        changed = [
            name for name in {**self._begun, **now} if self._begun.get(name) != now.get(name)
        ]
        if changed:
            raise ConfigError(
                f"{changed[0]} has changed since the study began, so the runs under way were "
                "discarded; run the same command again to resume, or give another folder with -o"
            )

    def _look(self) -> dict[str, Version]:
        """The version of each file by name."""
        folders = list(self._folders())
        seen = tuple(map(version_of, folders))
        files = dict(self._files())
        versions = {name: version_of(path) for name, path in files.items()}
        self._places = (*folders, *files.values())
        self._seen = (*seen, *versions.values())
        return versions
