"""WebSockets to clients that may be slow, hostile or gone: one message at a time, deadlines."""

from __future__ import annotations

import asyncio
from contextlib import suppress
from typing import Any, Final

from starlette.websockets import WebSocket, WebSocketDisconnect
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from websockets.exceptions import InvalidState

from dva_sim.serving.connection import PLACE, WIRE, extended, reset, wire_of
from dva_sim.serving.port_connections import PortConnection

STALLED: Final = 5.0  # a client that takes no byte for this long is dropped [s]
FAREWELL: Final = 10.0  # time for a dropped client to read waiting data [s]


class WireProtocol(WebSocketsSansIOProtocol):
    """A WebSocket that the application can drop.

    Args:
        slot: Connection slot that the port counts.
        **options: See `WebSocketsSansIOProtocol`.
    """

    def __init__(self, slot: PortConnection, **options: Any) -> None:
        super().__init__(**options)
        self._place = slot
        self.app = extended(self.app, {PLACE: slot, WIRE: self})

    def connection_lost(self, exc: Exception | None) -> None:
        """Release the connection slot."""
        super().connection_lost(exc)
        self._place.leave()

    def keepalive_timeout(self) -> None:
        """Cut a client that answers no ping: it would not read waiting data either."""
        super().keepalive_timeout()
        reset(self.transport)

    @property
    def waiting(self) -> int:
        """Bytes that the client has not taken yet."""
        return self.transport.get_write_buffer_size()

    def drop(self, code: int, reason: str) -> None:
        """Send the reason after all waiting data; cut the connection if that takes too long."""
        if self.disconnected or self.close_sent:
            return
        with suppress(InvalidState):  # the client is closing it at this moment
            self.conn.send_close(code, reason)
        self.transport.write(b"".join(self.conn.data_to_send()))
        self.close_sent = True
        self.transport.close()
        self.loop.call_later(FAREWELL, self.transport.abort)


async def say(ws: WebSocket, message: str | bytes) -> bool:
    """Send a message; return False if the client has not taken a byte for too long."""
    wire = wire_of(ws.scope)
    before = wire.waiting
    leaving = ws.send_text(message) if isinstance(message, str) else ws.send_bytes(message)
    if not before:
        await leaving
        return True
    sending = asyncio.ensure_future(leaving)
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
    """Return the next message of a client; None if it is gone."""
    try:
        message = await ws.receive()
    except (WebSocketDisconnect, RuntimeError):
        return None
    text: str | None = message.get("text")
    data: bytes | None = message.get("bytes")
    return data if text is None else text
