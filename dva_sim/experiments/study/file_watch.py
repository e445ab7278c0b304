"""Files that runs read while a study is run: all runs are to read the same."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.read_once import Version, version_of

Files = Callable[[], Iterable[tuple[str, Path]]]


class FileWatch:
    """Remembers files, and refuses runs made after one of them was written.

    A look costs a fifth of a millisecond while nothing has changed, neither in a file nor in a
    folder that may get a new one.

    Args:
        files: Gives names for messages and paths of the files, as runs would find them now.
        folders: Gives the folders in which a new file might be found in the place of one of them.
    """

    def __init__(self, files: Files, folders: Callable[[], Iterable[Path]]) -> None:
        self._files, self._folders = files, folders
        self._places: tuple[Path, ...] = ()
        self._seen: tuple[Version, ...] = ()
        self._begun = self._look()

    def refuse_changes(self) -> None:
        """Do nothing while the files are as they were.

        What was changed back meanwhile counts, too: some runs may have read it.

        Raises:
            ConfigError: one of them was written, has gone, or hides behind a new one.
        """
        if tuple(map(version_of, self._places)) == self._seen:
            return
        now = self._look()
        changed = [
            name for name in {**self._begun, **now} if self._begun.get(name) != now.get(name)
        ]
        if changed:
            raise ConfigError(
                f"{changed[0]} has changed since the study began, so what was under way is not "
                "kept; run the same command again to resume, or give another folder with -o"
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
