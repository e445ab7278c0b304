"""The server of the pages: its limits and its silence."""

from __future__ import annotations

from pathlib import Path

import uvicorn
from starlette.types import ASGIApp

from dva_sim.cameras.complaints import limit_complaints
from dva_sim.cameras.http import HttpProtocol, Server
from dva_sim.console.web.actions import MOST_BYTES
from dva_sim.console.web.sockets import WireProtocol

PING = 10.0  # [s]


def make_server(app: ASGIApp, certificate: Path | None = None) -> Server:
    """The server of an application; by https where it has a certificate, with its key."""
    limit_complaints()
    config = uvicorn.Config(
        app,
        ssl_certfile=certificate,
        http=HttpProtocol,
        ws=WireProtocol,
        ws_max_size=MOST_BYTES,
        ws_ping_interval=PING,
        ws_ping_timeout=PING,
        ws_per_message_deflate=False,
        lifespan="off",
        loop="asyncio",
        log_config=None,
        access_log=False,
        proxy_headers=False,
        server_header=False,
        timeout_keep_alive=15,
        timeout_graceful_shutdown=0,
        h11_max_incomplete_event_size=MOST_BYTES,
    )
    return Server(config)
