"""The server of the pages: its WebSockets and its certificate."""

from __future__ import annotations

from pathlib import Path

from starlette.types import ASGIApp

from dva_sim.console.wire.limits import MOST_BYTES
from dva_sim.serving.server import Server
from dva_sim.serving.web_sockets import WireProtocol

PING = 10.0  # [s]


def make_server(app: ASGIApp, certificate: Path | None = None) -> Server:
    """Return the server of an application; by https where it has a certificate, with its key."""
    return Server.of(
        app,
        MOST_BYTES,
        ssl_certfile=certificate,
        ws=WireProtocol,
        ws_max_size=MOST_BYTES,
        ws_ping_interval=PING,
        ws_ping_timeout=PING,
        ws_per_message_deflate=False,
    )
