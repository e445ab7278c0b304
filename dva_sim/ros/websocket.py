"""WebSocket connections in the thread of a run, which they block only at its end.

The clock of the run polls the sockets. Bytes that the kernel does not take wait in a buffer of
bounded size; a peer that lets it fill up is disconnected.
"""

from __future__ import annotations

import socket
import time
from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Final

from dva_sim.kernel.errors import ConfigError
from dva_sim.network.realtime import LiveClock
from dva_sim.ros.dialling import Dialling

if TYPE_CHECKING:
    from websockets.client import ClientProtocol
    from websockets.server import ServerProtocol

FLUSH: Final = 0.01  # design: interval between two attempts to send waiting data [s]
READ_BYTES: Final = 1 << 16  # design: maximum read per turn of a connection [B]
MAX_WAITING: Final = 8_000_000  # design: maximum data waiting for a peer [B]
LINGERS: Final = 0.5  # design: maximum wait for a bridge to read a run's last commands [s]
SHAKES_WITHIN: Final = 5.0  # design: time for the WebSocket handshake [s]
NORMAL = 1000  # close code of RFC 6455
TOO_SLOW = 1008  # close code of RFC 6455
GOING = 1001  # close code of RFC 6455
PORT: Final = 9090  # default port of rosbridge


class WebSocketConnection:
    """One end of a WebSocket, from the TCP connection on.

    Args:
        clock: Polls the socket.
        sock: Connected, non-blocking socket.
        protocol: State machine of the protocol at this end.
        on_text: Callback for each whole text message.
        on_end: Callback once, with the reason, when the connection is over.

    Attributes:
        is_open: False once the connection is over.
        on_event: Callback for requests and responses of the handshake.
        heard_at: Time of the newest bytes of the peer, pongs among them [s].
    """

    def __init__(
        self,
        clock: LiveClock,
        sock: socket.socket,
        protocol: ClientProtocol | ServerProtocol,
        on_text: Callable[[bytes], object],
        on_end: Callable[[str], object],
    ) -> None:
        self._clock = clock
        self._sock = sock
        self._protocol = protocol
        self._on_text = on_text
        self._on_end = on_end
        self._parts: list[bytes] = []
        self._buffer = bytearray()
        self._flushing = False
        self.is_open = True
        self.heard_at = clock.now
        self.on_event: Callable[[Any], object] = lambda _: None
        sock.setblocking(False)
        with suppress(OSError):
            sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        clock.watch(sock.fileno(), self._read)

    @property
    def has_failed(self) -> bool:
        """True if the handshake was refused."""
        return self._protocol.handshake_exc is not None

    @property
    def waiting(self) -> int:
        """Bytes that the kernel has not taken yet."""
        return len(self._buffer)

    def send(self, text: bytes) -> None:
        """Send a text message in UTF-8; do nothing once either end has begun to close."""
        if self.is_open and self._protocol.state.name == "OPEN":
            self._protocol.send_text(text)
            self.push()

    def ping(self) -> None:
        """Ping the peer, whose library replies by itself."""
        if self.is_open and self._protocol.state.name == "OPEN":
            self._protocol.send_ping(b"")
            self.push()

    def close(self, code: int = NORMAL, reason: str = "", *, linger: float = 0.0) -> None:
        """Send a close frame and end the connection.

        Args:
            code: Close code.
            reason: Reason, for the peer.
            linger: Maximum time for the peer to read the last data [s]; blocks meanwhile.
        """
        if not self.is_open:
            return
        if self._protocol.state.name == "OPEN":  # an unfinished handshake has no close frame
            self._protocol.send_close(code, reason[:120])
            self.push()
            if linger and self.is_open:
                self._linger(linger)
        self.end(reason)

    def _linger(self, linger: float) -> None:
        """Read until the peer has closed.

        Closing a socket with unread bytes resets the connection, and the last data, such as a
        command to stand, would be lost.
        """
        until = time.monotonic() + linger
        with suppress(OSError):
            self._sock.setblocking(True)
            if self._buffer:
                self._sock.settimeout(linger)
                self._sock.sendall(self._buffer)
            self._sock.shutdown(socket.SHUT_WR)
            while (remaining := until - time.monotonic()) > 0.0:
                self._sock.settimeout(remaining)
                if not self._sock.recv(READ_BYTES):
                    return

    def push(self) -> None:
        """Send the protocol's output, as far as the kernel takes it."""
        self._buffer += b"".join(self._protocol.data_to_send())
        self._flush()

    def _flush(self) -> bool:
        """Return True while bytes are left."""
        if not self.is_open:
            return False
        try:
            while self._buffer:
                sent = self._sock.send(memoryview(self._buffer)[:READ_BYTES])
                del self._buffer[:sent]
        except BlockingIOError:
            if len(self._buffer) > MAX_WAITING:
                self.end("does not read what it is sent")
                return False
            if not self._flushing:
                self._flushing = True
                self._clock.every(FLUSH, self._flush)
            return True
        except OSError as error:
            self.end(error.strerror or str(error))
        self._flushing = False
        return False

    def _read(self) -> None:
        try:
            data = self._sock.recv(READ_BYTES)
        except BlockingIOError:
            return
        except OSError as error:
            self.end(error.strerror or str(error))
            return
        if data:
            self.heard_at = self._clock.now
            self._protocol.receive_data(data)
        else:
            self._protocol.receive_eof()
        for event in self._protocol.events_received():
            if self.is_open:
                self._take(event)
        if self.is_open:
            self.push()
        if self.is_open and (not data or self._protocol.close_expected()):
            self.end(self._why())

    def _why(self) -> str:
        failed = self._protocol.handshake_exc or self._protocol.parser_exc
        if failed is not None:
            return str(failed)
        reason = self._protocol.close_reason
        return f"closed by the peer{f': {reason}' if reason else ''}"

    def _take(self, event: Any) -> None:
        """Handle an event of the protocol: a part of a message, or of a handshake."""
        opcode = getattr(event, "opcode", None)
        if opcode is None:
            self.on_event(event)
        elif int(opcode) in (0, 1, 2):
            self._parts.append(bytes(event.data))
            if event.fin:
                data = b"".join(self._parts)
                self._parts = []
                self._on_text(data)

    def end(self, why: str) -> None:
        """End the connection at once."""
        if self.is_open:
            self.is_open = False
            self._clock.unwatch(self._sock.fileno())
            self._sock.close()
            self._buffer.clear()
            self._on_end(why)


class WebSocketUrl:
    """Address of a WebSocket server, `ws://HOST:PORT/PATH`.

    Raises:
        ConfigError: the text is not such an address.
    """

    def __init__(self, text: str, option: str) -> None:
        from websockets.exceptions import InvalidURI  # late: start-up
        from websockets.uri import parse_uri  # late: start-up

        should = "should be ws://HOST:PORT, as in ws://192.168.1.20:9090"
        if text.startswith("wss://"):
            raise ConfigError(f"{option} {text!r}: wss:// is not supported; give ws://")
        try:
            self.uri = parse_uri(text)
        except (InvalidURI, ValueError):
            raise ConfigError(f"{option} {text!r} {should}") from None
        self.text = text
        self.host = self.uri.host
        self.port = self.uri.port if f":{self.uri.port}" in text else PORT


class WebSocketDialer:
    """Connects to a server without blocking.

    Args:
        clock: Polls the socket.
        url: Address of the server.
        largest: Maximum size of a message [B].
        on_open: Callback when the handshake is done.
        on_text: Callback for each text message.
        on_end: Callback once, when the connection is over or could not be made.

    Attributes:
        connection: The connection; None until TCP has connected.
    """

    def __init__(
        self,
        clock: LiveClock,
        url: WebSocketUrl,
        *,
        largest: int,
        on_open: Callable[[], object],
        on_text: Callable[[bytes], object],
        on_end: Callable[[str], object],
    ) -> None:
        self._clock = clock
        self._url = url
        self._largest = largest
        self._on_open = on_open
        self._on_text = on_text
        self._on_end = on_end
        self.connection: WebSocketConnection | None = None
        self._is_open = self._is_over = False
        self._dialling = Dialling(clock, url.host, url.port, self._connected, self._over)

    def _connected(self, sock: socket.socket) -> None:
        from websockets.client import ClientProtocol  # late: start-up

        protocol = ClientProtocol(self._url.uri, max_size=self._largest)
        connection = WebSocketConnection(self._clock, sock, protocol, self._on_text, self._over)
        connection.on_event = self._answered
        self.connection = connection
        protocol.send_request(protocol.connect())
        connection.push()
        self._clock.call_after(SHAKES_WITHIN, self._give_up)

    def _give_up(self) -> None:
        if not self._is_open and self.connection is not None:
            self.connection.end("does not speak WebSocket")

    def _answered(self, _: Any) -> None:
        connection = self.connection
        assert connection is not None
        if connection.has_failed:
            return
        self._is_open = True
        self._on_open()

    def _over(self, why: str) -> None:
        if not self._is_over:
            self._is_over = True
            self._on_end(why)

    def close(self) -> None:
        """End the connection, or the attempt."""
        if self.connection is not None:
            self.connection.close(GOING, linger=LINGERS)
        else:
            self._dialling.cancel()
        self._is_over = True
