"""The server: its socket, its limits, its silence, and its end."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import socket
from collections.abc import Iterator
from pathlib import Path

import uvicorn
from starlette.types import ASGIApp

from dva_sim.console.web.actions import MOST_BYTES
from dva_sim.console.web.port_connections import PortConnection, PortConnections
from dva_sim.console.web.port_listener import WAITING, PortListener
from dva_sim.console.web.sockets import HttpProtocol
from dva_sim.kernel.errors import ConfigError

SEND_BYTES = 64 * 1024  # in the kernel for each connection: what waits there is old
SILENT_MS = 20_000  # a connection that takes or answers nothing for so long is cut [ms]
PING = 10.0  # [s]
MOST_COMPLAINTS = 5


def listen(host: str, port: int) -> socket.socket:
    """A listening socket, so that its port is known before anything is served.

    Raises:
        ConfigError: the address is not of this machine, or taken.
    """
    try:
        found = socket.getaddrinfo(host.strip("[]"), port, type=socket.SOCK_STREAM)
        family, kind, protocol, _, address = found[0]
        sock = socket.socket(family, kind, protocol)
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        sock.bind(address)
    except OSError as error:
        raise ConfigError(f"cannot listen on {host} port {port}: {error.strerror}") from error
    # Connections inherit these.
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BYTES)
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    if hasattr(socket, "TCP_USER_TIMEOUT"):
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, SILENT_MS)
    sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    sock.listen(WAITING)
    sock.setblocking(False)
    return sock


class Server(uvicorn.Server):
    """A server that is ended by whoever started it, not by signals of its own."""

    def protocol(self, place: PortConnection) -> HttpProtocol:
        """Return what serves a connection."""
        return HttpProtocol(place, config=self.config, server_state=self.server_state, app_state={})

    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Leave signals to the process."""
        yield


def make_server(app: ASGIApp, certificate: Path | None = None) -> Server:
    """The server of an application; by https where it has a certificate, with its key."""
    logger = logging.getLogger("uvicorn.error")
    logger.handlers, logger.propagate = [_Complaints()], False
    logger.setLevel(logging.WARNING)
    config = uvicorn.Config(
        app,
        ssl_certfile=certificate,
        http=HttpProtocol,
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
