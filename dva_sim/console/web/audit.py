"""The audit log for pages and programs: read from its file, which the world alone writes.

For a recording, the rows are in a JSON file, as they were kept.
"""

from __future__ import annotations

import asyncio
import csv
import io
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from starlette.requests import Request
from starlette.responses import Response

from dva_sim.console.audit.audit_measures import measured
from dva_sim.console.web.rest import NOT_KEPT, json_answer, problem
from dva_sim.console.wire.audit_answers import AuditCheck
from dva_sim.kernel.csv_cells import harmless_row
from dva_sim.kernel.errors import ConfigError
from dva_sim.recordings.audit_log import (
    COLUMNS,
    SUFFIX,
    AuditRow,
    Verified,
    plain_row,
    read_rows,
    verify,
    verify_plain,
)

MAX_ROWS = 1000  # in one answer


class AuditPages:
    """Requests about the audit log.

    Args:
        path: File of the log; None: there is none.
    """

    def __init__(self, path: Path | None) -> None:
        self._path = path

    async def rows(self, request: Request) -> Response:
        """`GET /api/audit?after=N`: rows of the audit log after a number, up to a thousand."""
        after = request.query_params.get("after", "0")
        if not after.isascii() or not after.isdigit() or len(after) > 12:
            return problem(400, "after should be a whole number")
        return await self._read(self._rows, int(after))

    def _rows(self, path: Path, after: int) -> Response:
        rows = rows_of(path, after, MAX_ROWS)
        body = {"rows": [plain_row(row) for row in rows], "more": len(rows) == MAX_ROWS}
        return json_answer(body)

    async def measures(self, _: Request) -> Response:
        """`GET /api/audit/measures`: times to acknowledge and to assign, and overrides."""
        return await self._read(lambda path: json_answer(measured(rows_of(path))))

    async def check(self, _: Request) -> Response:
        """`GET /api/audit/check`: the first row at which the chain of hashes breaks, if any."""
        return await self._read(_checked)

    async def as_csv(self, _: Request) -> Response:
        """`GET /api/audit.csv`: all rows of the audit log."""
        return await self._read(lambda path: _file("csv", "text/csv", csv_of(rows_of(path))))

    async def as_json(self, _: Request) -> Response:
        """`GET /api/audit.json`: all rows of the audit log."""
        return await self._read(
            lambda path: _file("json", "application/json", json_of(rows_of(path)))
        )

    async def _read(self, do: Any, *more: Any) -> Response:
        if self._path is None:
            return problem(404, "this console keeps no audit log")
        try:
            answer: Response = await asyncio.to_thread(do, self._path, *more)
        except ConfigError as error:
            return problem(503, error.problem)
        return answer


def rows_of(path: Path, after: int = 0, most: int | None = None) -> list[AuditRow]:
    """Return the rows after a number, at most `most` of them.

    Raises:
        ConfigError: the file holds none, or what no log writes.
    """
    if path.suffix == SUFFIX:
        return read_rows(path, after, -1 if most is None else most)
    return [AuditRow(**plain) for plain in _kept(path) if plain["number"] > after][:most]


def _kept(path: Path) -> list[dict[str, Any]]:
    rows: list[dict[str, Any]] = json.loads(path.read_text())
    return rows


def _verified(path: Path) -> Verified:
    return verify(path) if path.suffix == SUFFIX else verify_plain(_kept(path))


def _checked(path: Path) -> Response:
    verified = _verified(path)
    wrong = verified.problem
    body: AuditCheck = {
        "rows": verified.rows,
        "hash": verified.head,
        "problem": None if wrong is None else {"row": wrong.number, "text": wrong.text},
        "doubts": [
            doubt for doubt in verified.doubts if "not an end" not in doubt
        ],  # it still runs
    }
    return json_answer(body)


def _file(suffix: str, kind: str, text: str) -> Response:
    headers = NOT_KEPT | {"Content-Disposition": f'attachment; filename="audit.{suffix}"'}
    return Response(text, headers=headers, media_type=kind)


def csv_of(rows: Sequence[AuditRow]) -> str:
    """Return rows for a spreadsheet; what it would take for a formula begins with an apostrophe.

    References:
        OWASP, "CSV injection".
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\r\n")
    writer.writerow(COLUMNS)
    for row in rows:
        plain = plain_row(row) | {"details": json.dumps(row.details, sort_keys=True)}
        writer.writerow(harmless_row(plain.values()))
    return text.getvalue()


def json_of(rows: Sequence[AuditRow]) -> str:
    """Return rows for programs, hashes included, so that the chain can be followed there, too."""
    return json.dumps({"rows": [plain_row(row) for row in rows]}, indent=1)
