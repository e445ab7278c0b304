"""The pages' own files, as they are on disk."""

from __future__ import annotations

import mimetypes
from pathlib import Path
from typing import Any, Final

from starlette.responses import Response
from starlette.staticfiles import StaticFiles
from typing_extensions import override

FOLDER: Final = Path(__file__).parent.parent / "static"
# Said here, because the machine's own table may call scripts plain text, or not know a font.
TYPES: Final = {
    ".js": "text/javascript",
    ".mjs": "text/javascript",
    ".webmanifest": "application/manifest+json",
    ".woff2": "font/woff2",
}


class PageFiles(StaticFiles):
    """Serves the files; browsers ask each time whether a file has changed."""

    def __init__(self) -> None:
        super().__init__(directory=FOLDER, check_dir=False)
        for suffix, kind in TYPES.items():
            mimetypes.add_type(kind, suffix)

    @override
    def file_response(self, *arguments: Any, **more: Any) -> Response:
        response = super().file_response(*arguments, **more)
        response.headers["Cache-Control"] = "no-cache"
        return response


def read(name: str) -> str | None:
    """Return the text of a page; None: the pages are not installed."""
    path = FOLDER / name
    return path.read_text(encoding="utf-8") if path.is_file() else None
