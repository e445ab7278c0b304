"""A server of HTTP in a process of ours: its listening socket, its settings, and its end."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import socket
from collections.abc import Iterator
from typing import Any

import uvicorn
from starlette.types import ASGIApp

from dva_sim.serving.connection import HttpProtocol
from dva_sim.serving.port_connections import PortConnection, PortConnections
from dva_sim.serving.port_listener import PortListener


class Server(uvicorn.Server):
    """A server that its caller ends; it handles no signals."""

    @classmethod
    def of(cls, app: ASGIApp, most_bytes: int, **more: Any) -> Server:
        """Return the server of an application, with bounded complaints and no logs.

        Args:
            app: The application.
            most_bytes: Longest head of a request [B].
            more: More settings of uvicorn, such as a certificate.
        """
        limit_complaints()
        config = uvicorn.Config(
            app,
            http=HttpProtocol,
            lifespan="off",
            loop="asyncio",
            log_config=None,
            access_log=False,
            proxy_headers=False,
            server_header=False,
            timeout_keep_alive=15,
            timeout_graceful_shutdown=0,
            h11_max_incomplete_event_size=most_bytes,
            **more,
        )
        return cls(config)

    def protocol(self, slot: PortConnection) -> HttpProtocol:
        """Return what serves a connection."""
        return HttpProtocol(slot, config=self.config, server_state=self.server_state, app_state={})

    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Leave signals to the process."""
        yield


async def serve(
    server: Server, sock: socket.socket, places: PortConnections, ended: asyncio.Event
) -> None:
    """Serve until the end."""
    server.config.load()
    listener = PortListener(sock, server.protocol, server.config.ssl, places)
    accepting = asyncio.ensure_future(listener.run())
    serving = asyncio.ensure_future(server.serve(sockets=[]))  # the listener accepts in its place
    waiting = asyncio.ensure_future(ended.wait())
    tasks = {accepting, serving, waiting}
    await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    server.should_exit = True
    accepting.cancel()
    waiting.cancel()
    await serving


MAX_COMPLAINTS = 5


def limit_complaints() -> None:
    """Limit the loggers of the server and of its event loop to a few complaints in all."""
    handler = Complaints()
    for name in ("uvicorn.error", "asyncio"):
        logger = logging.getLogger(name)
        logger.handlers = [handler]
        logger.propagate = False
        logger.setLevel(logging.WARNING)


class Complaints(logging.StreamHandler):  # type: ignore[type-arg]
    """Writes the first few records in full, and none about what clients sent or how they left."""

    NOISE = ("Invalid", "Cancel", "Unsupported", "No supported", "ASGI callable")

    def __init__(self) -> None:
        super().__init__()
        self._count = 0

    def emit(self, record: logging.LogRecord) -> None:
        """Write a complaint, unless it is of a client or there were enough."""
        cut_off = record.exc_info and isinstance(record.exc_info[1], asyncio.CancelledError)
        if cut_off or record.getMessage().startswith(self.NOISE):
            return
        self._count += 1
        if self._count <= MAX_COMPLAINTS:  # nobody may read them
            super().emit(record)
