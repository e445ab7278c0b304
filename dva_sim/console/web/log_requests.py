"""Logs by plain requests: older lines, one exchange whole, and all of it as a file."""

from __future__ import annotations

import csv
import io
import re
import zipfile
from collections.abc import Iterable
from typing import Any, Final

from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response

from dva_sim.console.web.hub import Hub
from dva_sim.console.web.log_entries import Entry
from dva_sim.console.web.logs import (
    ENTRIES_PER_LINE,
    KEPT_ENTRIES,
    TICKS,
    WORDS,
    KeptLog,
    LogFilter,
    Looks,
)
from dva_sim.console.web.rest import NOT_KEPT, ROLE, json_answer, problem
from dva_sim.console.wire.kinds import BadMessage
from dva_sim.console.wire.roles import Role
from dva_sim.protocol import messages as m
from dva_sim.protocol.mistakes import check_message

_TOKEN: Final = re.compile(r"<[^>]*>|[^<]+")
COLUMNS: Final = (
    *("n", "t", "kind", "from", "from_label", "to", "to_label", "session"),
    *("code", "word", "text", "service_us", "published", "payload"),
)


class LogRequests:
    """Requests about logs.

    Args:
        hub: Hub of the pages; knows the simulation.
    """

    def __init__(self, hub: Hub) -> None:
        self._logs = hub.simulation.state.logs

    async def lines(self, request: Request) -> Response:
        """`GET /api/logs/NAME?before=N&...`: lines of a device's log that match."""
        log = self._log(request)
        before = request.query_params.get("before", "")
        if before and not (before.isascii() and before.isdigit() and len(before) < 12):
            return problem(400, "before should be a whole number")
        looks = Looks(self._logs, request.scope[ROLE] >= Role.DRIVE)
        try:
            log_filter = looks.filter(_given(request))
        except BadMessage as error:
            return problem(400, str(error))
        below = int(before) if before else None
        entries = log.find(log_filter, self._logs.names, below, ENTRIES_PER_LINE)
        lines = [looks.brief(entry) for entry in entries]
        return json_answer({"lines": lines, "total": log.newest})

    async def entry(self, request: Request) -> Response:
        """`GET /api/logs/NAME/N`: one exchange, whole."""
        entry = self._log(request).entries.get(int(request.path_params["number"]))
        if entry is None:
            return problem(404, "this exchange is not kept any more")
        body = whole(entry) | {"labels": self._labels(entry)}
        return json_answer(body)

    async def export(self, request: Request) -> Response:
        """`GET /api/logs/NAME/export?...`: lines that match, as an archive of messages."""
        log = self._log(request)
        try:
            log_filter = LogFilter.of(_given(request))
        except BadMessage as error:
            return problem(400, str(error))
        entries = log.find(log_filter, self._logs.names, None, KEPT_ENTRIES)
        data = await run_in_threadpool(archive, entries, dict(self._logs.names))
        name = f'attachment; filename="{re.sub(r"[^A-Za-z0-9-]", "_", log.name)}-log.zip"'
        headers = NOT_KEPT | {"Content-Disposition": name}
        return Response(data, headers=headers, media_type="application/zip")

    def _log(self, request: Request) -> KeptLog:
        name = request.path_params["name"]
        if name not in self._logs:
            raise HTTPException(404)
        return self._logs.of(name)

    def _labels(self, entry: Entry) -> dict[str, str]:
        return {
            name: self._logs.names[value]
            for name, value in entry.header.items()
            if value in self._logs.names
        }


def _given(request: Request) -> dict[str, Any]:
    """Return a filter out of the address."""
    query = request.query_params
    words: dict[str, Any] = {key: query[key] for key in WORDS if key in query}
    since = query.get("since", "0")
    words["since"] = int(since) if since.isascii() and since.isdigit() else since
    ticks = {key: query[key] == "true" for key in TICKS if key in query}
    return words | ticks


def whole(entry: Entry) -> dict[str, Any]:
    """Return an exchange with all that can be said about it."""
    request, problems = laid_out(entry.data)
    return {
        "n": entry.number,
        "t": entry.time,
        "kind": entry.kind,
        "header": entry.header,
        "request": request,
        "problems": [] if entry.is_cut else problems,
        "reply": None if entry.reply is None else laid_out(entry.reply)[0],
        "reply_cut": entry.is_reply_cut,
        "code": entry.code,
        "word": m.CODE_NAMES.get(entry.code, "") if entry.code is not None else "",
        "text": entry.text,
        "service_us": entry.service_us,
        "published": entry.published,
        "bytes": len(entry.data),
        "sent": entry.sent,
    }


def laid_out(data: bytes) -> tuple[str, list[dict[str, Any]]]:
    """Return a message with a line for each element, and its mistakes by line and column of that.

    What cannot be laid out without a change to what is wrong with it is shown as it came.
    """
    plain = data.decode("utf-8", "backslashreplace")
    text = plain
    mistakes = check_message(data)
    if "\n" not in plain and (pretty := _indented(plain)) is not None:
        again = check_message(pretty.encode())
        if [one.text for one in again] == [one.text for one in mistakes]:
            text = pretty
            mistakes = again
    return text, [{"line": p.line, "column": p.column, "text": p.text} for p in mistakes]


def _indented(text: str) -> str | None:
    """Return one line of XML as several; None if its elements do not close in order."""
    lines = [""]
    depth = 0
    for token in _TOKEN.findall(text):
        closes = token.startswith("</")
        opens = token.startswith("<") and token[1:2] not in "/?!"
        depth -= closes
        if depth < 0:
            return None
        if (closes and lines[-1].lstrip().startswith("<" + token[2:-1] + ">")) or not (
            closes or token.startswith("<")
        ):
            lines[-1] += token
        else:
            lines.append("  " * depth + token)
        depth += opens and not token.endswith("/>")
    return "\n".join(lines[1:]) if depth == 0 and "".join(_TOKEN.findall(text)) == text else None


def archive(entries: Iterable[Entry], names: dict[str, str]) -> bytes:
    """Return messages as files of an archive, and a table of them.

    Below `messages/` stands what is valid, so that `dva-sim check messages/*` finds no fault;
    below `refused/` everything else, as received.
    """
    made = io.BytesIO()
    table = io.StringIO()
    writer = csv.DictWriter(table, COLUMNS, extrasaction="ignore", lineterminator="\n")
    writer.writeheader()
    with zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as files:
        for entry in entries:
            writer.writerow(entry.brief(names))
            name = f"{entry.number:06}-{entry.kind.replace('?', 'unknown')}"
            for part, data in (("request", entry.data), ("reply", entry.reply)):
                if data is not None:
                    is_whole = data is not entry.data or not entry.is_cut
                    folder = "messages" if is_whole and not check_message(data) else "refused"
                    files.writestr(f"{folder}/{name}-{part}.xml", data)
        files.writestr("log.csv", table.getvalue())
    return made.getvalue()
