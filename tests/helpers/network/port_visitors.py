"""Clients of a listening port as raw sockets: they say what they are given, and read nothing."""

import contextlib
import json
import socket
from urllib.parse import urlsplit


def is_closed(sock: socket.socket) -> bool:
    """True once the other end has closed a connection, or reset it."""
    sock.setblocking(False)
    try:
        while data := sock.recv(1 << 16):
            del data
    except BlockingIOError:
        return False
    except OSError:
        pass
    return True


def upgrade(url: str, **more: str) -> bytes:
    """The opening handshake of a WebSocket; `more` adds headers, or replaces them."""
    parts = urlsplit(url)
    headers = {
        "Host": parts.netloc,
        "Upgrade": "websocket",
        "Connection": "Upgrade",
        "Sec-WebSocket-Version": "13",
        "Sec-WebSocket-Key": "AAAAAAAAAAAAAAAAAAAAAA==",
    }
    return request(url, **headers | more)


def request(url: str, **headers: str) -> bytes:
    """A request by GET."""
    parts = urlsplit(url)
    target = f"{parts.path or '/'}{'?' if parts.query else ''}{parts.query}"
    lines = [f"{name}: {value}" for name, value in ({"Host": parts.netloc} | headers).items()]
    return "\r\n".join([f"GET {target} HTTP/1.1", *lines, "", ""]).encode()


def text_frame(operation) -> bytes:
    """A text message of a client, with a mask of zeros."""
    text = json.dumps(operation).encode()
    length = (
        bytes([0x80 | len(text)]) if len(text) < 126 else b"\xfe" + len(text).to_bytes(2, "big")
    )
    return b"\x81" + length + bytes(4) + text


class DeafClient:
    """A WebSocket client that reads nothing, and so answers no ping either."""

    def __init__(self, url: str, **headers: str) -> None:
        parts = urlsplit(url)
        self.sock = socket.create_connection((parts.hostname, parts.port))
        self.sock.sendall(upgrade(url, **headers))

    @property
    def is_answered(self) -> bool:
        """True once the server has sent something."""
        self.sock.setblocking(False)
        with contextlib.suppress(BlockingIOError):
            return bool(self.sock.recv(1, socket.MSG_PEEK))
        return False

    def say(self, operation) -> None:
        self.sock.sendall(text_frame(operation))
