"""An HTTP server within a process: its listening socket, its settings, and its end."""

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
        """Return a server for an application, with no access log and a limited error log.

        Args:
            app: The application.
            most_bytes: Maximum size of a request's head [B].
            more: Further settings of uvicorn, such as a certificate.
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
        """Return the protocol that serves a connection."""
        return HttpProtocol(slot, config=self.config, server_state=self.server_state, app_state={})

    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Install no signal handlers: the process has its own."""
        yield


async def serve(
    server: Server, sock: socket.socket, places: PortConnections, ended: asyncio.Event
) -> None:
    """Serve until `ended` is set."""
    server.config.load()
    listener = PortListener(sock, server.protocol, server.config.ssl, places)
    accepting = asyncio.ensure_future(listener.run())
    serving = asyncio.ensure_future(server.serve(sockets=[]))  # the listener accepts instead
    waiting = asyncio.ensure_future(ended.wait())
    tasks = {accepting, serving, waiting}
    await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    server.should_exit = True
    accepting.cancel()
    waiting.cancel()
    await serving


MAX_COMPLAINTS = 5


def limit_complaints() -> None:
    """Limit the loggers of the server and its event loop to a few records in all."""
    handler = Complaints()
    for name in ("uvicorn.error", "asyncio"):
        logger = logging.getLogger(name)
        logger.handlers = [handler]
        logger.propagate = False
        logger.setLevel(logging.WARNING)


class Complaints(logging.StreamHandler):  # type: ignore[type-arg]
    """Log handler that writes the first few records, and none about faults of clients."""

    NOISE = ("Invalid", "Cancel", "Unsupported", "No supported", "ASGI callable")

    def __init__(self) -> None:
        super().__init__()
        self._count = 0

    def emit(self, record: logging.LogRecord) -> None:
        """Write a record, unless it concerns a client or the limit is reached."""
        cut_off = record.exc_info and isinstance(record.exc_info[1], asyncio.CancelledError)
        if cut_off or record.getMessage().startswith(self.NOISE):
            return
        self._count += 1
        if self._count <= MAX_COMPLAINTS:  # standard error may be a pipe that nobody reads
            super().emit(record)
