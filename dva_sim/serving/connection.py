"""A connection of a port: counted, and cut if its client does not read."""

from __future__ import annotations

import socket
import struct
from contextlib import suppress
from functools import partial
from typing import Any

import h11
from starlette.types import ASGIApp, Receive, Scope, Send
from uvicorn.protocols.http.h11_impl import H11Protocol

from dva_sim.serving.port_connections import PortConnection

WIRE = "dva_sim.wire"
PLACE = "dva_sim.place"
NO_LINGERING = struct.pack("ii", 1, 0)  # reset on close: drop unsent data


class HttpProtocol(H11Protocol):
    """An HTTP connection that its port counts and can cut.

    uvicorn hides the connection from the application, but only the application notices a client
    that does not read, and knows who showed a token. So each request's scope holds protocol and
    slot.

    Args:
        slot: Connection slot that the port counts.
        **options: See `H11Protocol`.

    Attributes:
        is_made: True once the connection belongs to the protocol, and no longer to the listener.
    """

    def __init__(self, slot: PortConnection, **options: Any) -> None:
        super().__init__(**options)
        self._place = slot
        self.is_made = False
        self._is_lost = False
        self.app = extended(self.app, {PLACE: slot, WIRE: self})
        kind: Any = self.ws_protocol_class
        if kind is not None:
            self.ws_protocol_class = partial(kind, slot)  # type: ignore[assignment]

    @property
    def waiting(self) -> int:
        """Bytes that the client has not taken yet."""
        return 0 if self._is_lost else self.transport.get_write_buffer_size()

    def take_one_by_one(self) -> None:
        """Wait until the client has taken each piece of a response before sending the next."""
        if not self._is_lost:
            self.transport.set_write_buffer_limits(high=1, low=0)  # 0 would always mean full in TLS

    def cut(self) -> None:
        """End the connection at once, also under a WebSocket; data in transit is lost."""
        if not self._is_lost:
            reset(self.transport)

    def send_400_response(self, msg: str) -> None:
        """Reject input that is not HTTP; only close if a response has begun or ended."""
        if self.conn.our_state in (h11.IDLE, h11.SEND_RESPONSE):
            super().send_400_response(msg)
        else:
            self.transport.close()

    def connection_made(self, transport: Any) -> None:
        """Let the port cut the connection to make room for others."""
        super().connection_made(transport)
        self.is_made = True
        self._place.drop = self.cut

    def connection_lost(self, exc: Exception | None) -> None:
        """Release the connection slot."""
        self._is_lost = True
        super().connection_lost(exc)
        self._place.leave()


def reset(transport: Any) -> None:
    """End a connection at once; data in transit is lost."""
    sock = transport.get_extra_info("socket")
    if sock is not None:
        with suppress(OSError):
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, NO_LINGERING)
    transport.abort()


def extended(app: Any, more: dict[str, Any]) -> ASGIApp:
    """Return an application whose requests have more keys in their scope."""

    async def with_more(scope: Scope, receive: Receive, send: Send) -> None:
        scope.setdefault("extensions", {}).update(more)
        await app(scope, receive, send)

    return with_more


def place_of(scope: Scope) -> PortConnection:
    """Return the slot of the connection that carries a request."""
    slot: PortConnection = scope["extensions"][PLACE]
    return slot


def wire_of(scope: Scope) -> Any:
    """Return the protocol that carries a request: that of the WebSocket, or `HttpProtocol`."""
    return scope["extensions"][WIRE]
