"""The page's own files: by their names in a list, never by a path that a request gives."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import NamedTuple

FOLDER = Path(__file__).parent.parent / "static"

# Said here, because the machine's own table may call scripts plain text.
TYPES = {
    ".css": "text/css; charset=utf-8",
    ".html": "text/html; charset=utf-8",
    ".ico": "image/x-icon",
    ".js": "text/javascript; charset=utf-8",
    ".json": "application/json",
    ".mjs": "text/javascript; charset=utf-8",
    ".png": "image/png",
    ".svg": "image/svg+xml",
    ".txt": "text/plain; charset=utf-8",
    ".webmanifest": "application/manifest+json",
    ".woff2": "font/woff2",
}


class StaticFile(NamedTuple):
    """A file: its bytes, their type, and a tag that changes with them."""

    data: bytes
    kind: str
    tag: str


class StaticFiles:
    """The files in a folder, by name.

    A name that is not in the list is looked for once more, as files come and go while somebody
    works on them.
    """

    def __init__(self, folder: Path = FOLDER) -> None:
        self._folder = folder
        self._names = self._list()
        self._kept: dict[str, tuple[int, StaticFile]] = {}

    def _list(self) -> dict[str, Path]:
        found = (path for path in self._folder.rglob("*") if path.suffix in TYPES)
        return {path.relative_to(self._folder).as_posix(): path for path in found if path.is_file()}

    def find(self, name: str) -> StaticFile | None:
        """The file of a name, if there is one."""
        if name not in self._names:
            self._names = self._list()
        path = self._names.get(name)
        if path is None:
            return None
        try:
            changed = path.stat().st_mtime_ns
            known = self._kept.get(name)
            if known is None or known[0] != changed:
                self._kept[name] = known = changed, _read(path)
        except OSError:
            return None
        return known[1]


def _read(path: Path) -> StaticFile:
    data = path.read_bytes()
    return StaticFile(data, TYPES[path.suffix], f'"{hashlib.sha256(data).hexdigest()[:32]}"')
