"""WebSocket: messages in order over one TCP connection, as browsers and rosbridge have them."""

from __future__ import annotations

import socket
from contextlib import suppress
from typing import TYPE_CHECKING

from typing_extensions import override

from dva_sim.network.middleware.ends import (
    CommandTransport,
    Receive,
    Rendezvous,
    TransportEnd,
    connected,
)
from dva_sim.network.middleware.event_loop import LoopEnd

if TYPE_CHECKING:
    from websockets.asyncio.client import ClientConnection
    from websockets.asyncio.server import Server, ServerConnection

MAX_WAITING = 64_000  # bytes that may wait in the program before nothing more is taken


class WebSocketTransport(CommandTransport):
    """WebSocket over TCP.

    Args:
        nodelay: True if small messages leave at once (TCP_NODELAY).
    """

    title = "WebSocket"

    def __init__(self, nodelay: bool = True) -> None:
        self.nodelay = nodelay

    @override
    def near(self, place: Rendezvous, receive: Receive) -> TransportEnd:
        end = _Near(receive, self.nodelay)
        return connected(end, lambda: end.connect(place))

    @override
    def far(self, place: Rendezvous, receive: Receive) -> TransportEnd:
        return _Far(place, receive, self.nodelay)


class _WebSocketEnd(LoopEnd):
    def __init__(self, receive: Receive, nodelay: bool) -> None:
        super().__init__()
        self._receive = receive
        self._nodelay = nodelay
        self._connection: ClientConnection | ServerConnection | None = None

    async def _hear(self, connection: ClientConnection | ServerConnection) -> None:
        from websockets.exceptions import ConnectionClosed

        self._take(connection)
        with suppress(ConnectionClosed):
            async for data in connection:
                self._receive(data if isinstance(data, bytes) else data.encode())

    def _take(self, connection: ClientConnection | ServerConnection) -> None:
        self._connection = connection
        raw = connection.transport.get_extra_info("socket")
        raw.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, int(self._nodelay))

    @override
    def send(self, data: bytes) -> bool:
        connection = self._connection
        if connection is None or connection.transport.is_closing():
            return False
        if connection.transport.get_write_buffer_size() > MAX_WAITING:
            return False
        self.begin(connection.send(data))
        return True


class _Near(_WebSocketEnd):
    _opened: ClientConnection | None = None

    def connect(self, place: Rendezvous) -> None:
        """Connect to the robot's server."""
        from websockets.asyncio.client import connect

        url = f"ws://{place.far}:{place.port}"
        connection = self.reach(lambda: connect(url, compression=None, proxy=None), place.ready_by)
        self._take(connection)
        self.begin(self._hear(connection))
        self._opened = connection

    @override
    def close(self) -> None:
        if self._opened is not None:
            self.finish(self._opened.close())
        super().close()


class _Far(_WebSocketEnd):
    def __init__(self, place: Rendezvous, receive: Receive, nodelay: bool) -> None:
        super().__init__(receive, nodelay)
        self._server: Server = self.run(self._listen(place))

    async def _listen(self, place: Rendezvous) -> Server:
        from websockets.asyncio.server import serve

        return await serve(self._hear, place.far, place.port, compression=None)

    @override
    def close(self) -> None:
        self._server.close()
        self.finish(self._server.wait_closed())
        super().close()
