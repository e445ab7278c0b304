"""Connections to pages that may be slow, hostile or gone.

The protocols of uvicorn hide the connection from the application, but only there a page that does
not read can be cut, and a connection be counted. So both are handed through the request's scope.
"""

from __future__ import annotations

import asyncio
import socket
import struct
from contextlib import suppress
from functools import partial
from typing import Any

from starlette.types import ASGIApp, Receive, Scope, Send
from starlette.websockets import WebSocket, WebSocketDisconnect
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol

from dva_sim.console.web.port_connections import PortConnection

STALLED = 5.0  # without a byte taken, a page is dropped [s]
FAREWELL = 10.0  # for what is on its way to a page that was dropped [s]
WIRE = "dva_sim.wire"
PLACE = "dva_sim.place"
NO_LINGERING = struct.pack("ii", 1, 0)  # a reset: the kernel keeps nothing for a deaf client


class HttpProtocol(H11Protocol):
    """An HTTP connection that has a place among those of its port.

    Args:
        place: Its place.
        given: See `H11Protocol`.
    """

    def __init__(self, place: PortConnection, **given: Any) -> None:
        super().__init__(**given)
        self._place = place
        self.app = _extended(self.app, {PLACE: place, WIRE: self})
        self.ws_protocol_class: Any = partial(WireProtocol, place)

    @property
    def waiting(self) -> int:
        """Bytes that the client has not taken yet."""
        return self.transport.get_write_buffer_size()

    def cut(self) -> None:
        """End the connection at once, also under a WebSocket; what is on its way is lost."""
        sock = self.transport.get_extra_info("socket")
        with suppress(OSError):
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, NO_LINGERING)
        self.transport.abort()

    def connection_made(self, transport: Any) -> None:
        """Let the connection be cut for others."""
        super().connection_made(transport)
        self._place.busy, self._place.drop = False, self.cut

    def connection_lost(self, exc: Exception | None) -> None:
        """Give the place to others."""
        super().connection_lost(exc)
        self._place.leave()


class WireProtocol(WebSocketsSansIOProtocol):
    """A WebSocket that the application can drop.

    Args:
        place: Of its connection.
        given: See `WebSocketsSansIOProtocol`.
    """

    def __init__(self, place: PortConnection, **given: Any) -> None:
        super().__init__(**given)
        self._place = place
        self.app = _extended(self.app, {PLACE: place, WIRE: self})

    def connection_lost(self, exc: Exception | None) -> None:
        """Give the place to others."""
        super().connection_lost(exc)
        self._place.leave()

    @property
    def waiting(self) -> int:
        """Bytes that the page has not taken yet."""
        return self.transport.get_write_buffer_size()

    def drop(self, code: int, reason: str) -> None:
        """Say why behind what is on its way, and wait no longer than a moment for all of it."""
        if self.disconnected or self.close_sent:
            return
        self.conn.send_close(code, reason)
        self.transport.write(b"".join(self.conn.data_to_send()))
        self.close_sent = True
        self.transport.close()
        self.loop.call_later(FAREWELL, self.transport.abort)


def _extended(app: Any, more: dict[str, Any]) -> ASGIApp:
    """An application that finds more in the scope of each request."""

    async def extended(scope: Scope, receive: Receive, send: Send) -> None:
        scope.setdefault("extensions", {}).update(more)
        await app(scope, receive, send)

    return extended


def place_of(scope: Scope) -> PortConnection:
    """The place of the connection under a request."""
    place: PortConnection = scope["extensions"][PLACE]
    return place


def wire_of(scope: Scope) -> Any:
    """The connection under a request: a `WireProtocol` under a WebSocket, else `HttpProtocol`."""
    return scope["extensions"][WIRE]


async def say(ws: WebSocket, text: str) -> bool:
    """Send a message: False if the page has not taken a byte for too long."""
    wire = wire_of(ws.scope)
    before = wire.waiting
    if not before:
        await ws.send_text(text)
        return True
    sending = asyncio.ensure_future(ws.send_text(text))
    try:
        while True:
            done, _ = await asyncio.wait({sending}, timeout=STALLED)
            if done:
                sending.result()
                return True
            if wire.waiting >= before:
                return False
            before = wire.waiting
    finally:
        sending.cancel()


async def heard(ws: WebSocket) -> str | bytes | None:
    """The next message of a page; None if it is gone."""
    try:
        message = await ws.receive()
    except (WebSocketDisconnect, RuntimeError):
        return None
    text: str | None = message.get("text")
    data: bytes | None = message.get("bytes")
    return data if text is None else text
