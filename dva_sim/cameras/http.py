"""A server of HTTP in a process of ours: its socket, its connections, and its end."""

from __future__ import annotations

import asyncio
import contextlib
import socket
import struct
from collections.abc import Iterator
from contextlib import suppress
from functools import partial
from typing import Any

import h11
import uvicorn
from starlette.types import ASGIApp, Receive, Scope, Send
from uvicorn.protocols.http.h11_impl import H11Protocol

from dva_sim.cameras.port_connections import PortConnection, PortConnections
from dva_sim.cameras.port_listener import WAITING, PortListener
from dva_sim.kernel.errors import ConfigError

SEND_BYTES = 64 * 1024  # in the kernel for each connection: what waits there is old
WIRE = "dva_sim.wire"
PLACE = "dva_sim.place"
NO_LINGERING = struct.pack("ii", 1, 0)  # a reset: the kernel keeps nothing for a deaf client
SILENT_MS = 20_000  # a connection that takes or answers nothing for so long is cut [ms]


def listen(host: str, port: int) -> socket.socket:
    """A listening socket, so that its port is known before anything is served.

    Raises:
        ConfigError: the address is not of this machine, or taken.
    """
    try:
        found = socket.getaddrinfo(host.strip("[]"), port, type=socket.SOCK_STREAM)
        family, kind, protocol, _, address = found[0]
        with contextlib.ExitStack() as on_failure:
            sock = on_failure.enter_context(socket.socket(family, kind, protocol))
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            sock.bind(address)
            on_failure.pop_all()
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


class HttpProtocol(H11Protocol):
    """An HTTP connection that has a place among those of its port, and may be cut.

    uvicorn hides the connection from the application, but only there a client that does not read is
    noticed, and a connection with a token known. So both are handed through a request's scope.

    Args:
        place: Its place.
        given: See `H11Protocol`.
    """

    def __init__(self, place: PortConnection, **given: Any) -> None:
        super().__init__(**given)
        self._place, self._is_lost = place, False
        self.app = extended(self.app, {PLACE: place, WIRE: self})
        kind: Any = self.ws_protocol_class
        if kind is not None:
            self.ws_protocol_class = partial(kind, place)  # type: ignore[assignment]

    @property
    def waiting(self) -> int:
        """Bytes that the client has not taken yet."""
        return 0 if self._is_lost else self.transport.get_write_buffer_size()

    def take_one_by_one(self) -> None:
        """Let each piece of a response be taken by the client before the next one is sent."""
        if not self._is_lost:
            self.transport.set_write_buffer_limits(high=1, low=0)  # TLS takes 0 for always full

    def cut(self) -> None:
        """End the connection at once, also under a WebSocket; what is on its way is lost."""
        if self._is_lost:
            return
        sock = self.transport.get_extra_info("socket")
        if sock is not None:
            with suppress(OSError):
                sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, NO_LINGERING)
        self.transport.abort()

    def send_400_response(self, msg: str) -> None:
        """Answer what is no HTTP, unless an answer is under way or given: then only end it."""
        if self.conn.our_state in (h11.IDLE, h11.SEND_RESPONSE):
            super().send_400_response(msg)
        else:
            self.transport.close()

    def connection_made(self, transport: Any) -> None:
        """Let the connection be cut for others."""
        super().connection_made(transport)
        self._place.drop = self.cut

    def connection_lost(self, exc: Exception | None) -> None:
        """Give the place to others."""
        self._is_lost = True
        super().connection_lost(exc)
        self._place.leave()


def extended(app: Any, more: dict[str, Any]) -> ASGIApp:
    """An application that finds more in the scope of each request."""

    async def with_more(scope: Scope, receive: Receive, send: Send) -> None:
        scope.setdefault("extensions", {}).update(more)
        await app(scope, receive, send)

    return with_more


def place_of(scope: Scope) -> PortConnection:
    """The place of the connection under a request."""
    place: PortConnection = scope["extensions"][PLACE]
    return place


def wire_of(scope: Scope) -> Any:
    """The connection under a request: that of the WebSocket, else `HttpProtocol`."""
    return scope["extensions"][WIRE]


class Server(uvicorn.Server):
    """A server that is ended by whoever started it, not by signals of its own."""

    def protocol(self, place: PortConnection) -> HttpProtocol:
        """Return what serves a connection."""
        return HttpProtocol(place, config=self.config, server_state=self.server_state, app_state={})

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
