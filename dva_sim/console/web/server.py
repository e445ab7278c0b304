"""The server of the pages: its limits and its silence."""

from __future__ import annotations

import asyncio
import logging
from pathlib import Path

import uvicorn
from starlette.types import ASGIApp

from dva_sim.cameras.http import HttpProtocol, Server
from dva_sim.console.web.actions import MOST_BYTES
from dva_sim.console.web.sockets import WireProtocol

PING = 10.0  # [s]
MOST_COMPLAINTS = 5


def make_server(app: ASGIApp, certificate: Path | None = None) -> Server:
    """The server of an application; by https where it has a certificate, with its key."""
    logger = logging.getLogger("uvicorn.error")
    logger.handlers, logger.propagate = [_Complaints()], False
    logger.setLevel(logging.WARNING)
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


class _Complaints(logging.StreamHandler):  # type: ignore[type-arg]
    """A mistake of ours in full, the first times; what clients sent, and how they ended, not."""

    NOISE = ("Invalid", "Cancel", "Unsupported", "No supported", "ASGI callable")

    def __init__(self) -> None:
        super().__init__()
        self._count = 0

    def emit(self, record: logging.LogRecord) -> None:
        cut_off = record.exc_info and isinstance(record.exc_info[1], asyncio.CancelledError)
        if cut_off or record.getMessage().startswith(self.NOISE):
            return
        self._count += 1
        if self._count <= MOST_COMPLAINTS:  # nobody may read them
            super().emit(record)
