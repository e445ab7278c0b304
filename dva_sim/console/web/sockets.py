"""WebSockets to pages that may be slow, hostile or gone: one message in flight, and a deadline.

The protocol of uvicorn hides its connection from the application, but a page that does not read
can only be told and dropped there. So the connection is handed through the request's scope.
"""

from __future__ import annotations

import asyncio
from typing import Any

from starlette.websockets import WebSocket, WebSocketDisconnect
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol

STALLED = 5.0  # without a byte taken, a page is dropped [s]
FAREWELL = 10.0  # for what is on its way to a page that was dropped [s]
WIRE = "dva_sim.wire"


class WireProtocol(WebSocketsSansIOProtocol):
    """A WebSocket that the application can drop."""

    def handle_connect(self, event: Any) -> None:
        """Hand the connection to the application, too."""
        super().handle_connect(event)
        if scope := getattr(self, "scope", None):
            scope["extensions"][WIRE] = self

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


def wire_of(ws: WebSocket) -> WireProtocol:
    """The connection under a WebSocket."""
    wire: WireProtocol = ws.scope["extensions"][WIRE]
    return wire


async def say(ws: WebSocket, text: str) -> bool:
    """Send a message: False if the page has not taken a byte for too long."""
    wire = wire_of(ws)
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
