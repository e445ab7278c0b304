"""Admission check in front of an application whose clients all have the same rights."""

from __future__ import annotations

import time
from typing import Any, Final

from starlette.requests import HTTPConnection
from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Receive, Scope, Send
from starlette.websockets import WebSocket

from dva_sim.serving.admission import Admission, RequestFacts
from dva_sim.serving.connection import place_of

CLIENT: Final = 1  # rank of every admitted client


class PortGuard:
    """Refuses requests that are not admitted; marks the connections of all others as served.

    Args:
        app: Application to guard.
        admission: The rules.
    """

    def __init__(self, app: ASGIApp, admission: Admission) -> None:
        self._app = app
        self._admission = admission

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request."""
        slot = place_of(scope)
        headers = HTTPConnection(scope).headers
        query = scope["query_string"].decode("latin-1")
        bearer = headers.get("authorization", "")
        refusal = self._admission.refusal(facts_of(scope, is_page=True), query, bearer)
        if not slot.begin(0 if refusal else CLIENT, time.monotonic()):
            refusal = 503, "too many connections are in use"
        try:
            if refusal is None:
                await self._app(scope, receive, send)
                return
            status, reason = refusal
            answer = PlainTextResponse(f"{reason}\n", status, headers={"Cache-Control": "no-store"})
            if scope["type"] == "http":
                await answer(scope, receive, send)
            else:
                await WebSocket(scope, receive, send).send_denial_response(answer)
        finally:
            slot.end(time.monotonic())


def facts_of(scope: Scope, *, is_page: bool) -> RequestFacts:
    """Return the facts of a request.

    Args:
        scope: Scope of the request.
        is_page: See `RequestFacts`.
    """
    headers: Any = HTTPConnection(scope).headers
    hosts = headers.getlist("host")
    is_http = scope["type"] == "http"
    return RequestFacts(
        host=hosts[0] if len(hosts) == 1 else "",
        origin=headers.get("origin"),
        site=headers.get("sec-fetch-site", "").lower(),
        mode=headers.get("sec-fetch-mode", "").lower(),
        scheme="https" if scope.get("scheme") in ("https", "wss") else "http",
        changes=not is_http or scope["method"] not in ("GET", "HEAD"),
        is_page=is_page,
    )
