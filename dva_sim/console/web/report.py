"""A study's report beside the console's pages."""

from __future__ import annotations

from pathlib import Path

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import HTMLResponse, Response

from dva_sim.console.web.rest import NOT_KEPT


class StudyReport:
    """A study's report: one file with styles and pictures of its own, and no scripts.

    Args:
        path: File of the report; None without one.
    """

    POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:; frame-ancestors 'none'"

    def __init__(self, path: Path | None) -> None:
        self._path = path

    async def page(self, _: Request) -> Response:
        """`GET /report`: the report of a study that is shown."""
        try:
            data = None if self._path is None else self._path.read_bytes()
        except OSError:
            data = None
        if data is None:
            raise HTTPException(404)
        return HTMLResponse(data, headers=NOT_KEPT | {"Content-Security-Policy": self.POLICY})
