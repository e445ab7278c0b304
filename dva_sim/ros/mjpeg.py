"""Reads a camera's stream of JPEG pictures over HTTP, without blocking the thread of a run."""

from __future__ import annotations

import ipaddress
import re
import socket
from collections.abc import Callable
from contextlib import suppress
from typing import Final
from urllib.parse import urlsplit

from dva_sim.network.realtime import LiveClock
from dva_sim.ros.dialling import Dialling

AGAIN_AFTER: Final = 3.0  # design: pause between the end of a stream and the next attempt [s]
MAX_PICTURE_BYTES: Final = 2_000_000  # design: maximum size of a picture with its headers [B]
READ_BYTES: Final = 1 << 16  # maximum size of a read [B]
_LENGTH = re.compile(rb"\r\nContent-Length: (\d{1,7})\r\n", re.IGNORECASE)
_TIME = re.compile(rb"\r\nX-Frame-Time-Ms: (\d{1,15})\r\n", re.IGNORECASE)


class MjpegReader:
    """Reads one stream until `close`, reopening it whenever it ends.

    Args:
        clock: Polls the socket.
        url: `http://HOST:PORT/PATH`.
        token: Token sent to the server; empty: none.
        take: Callback for each picture, and its capture time [s]; None if unknown.
        is_trusted: True if the host may be a name. Otherwise it must be an address: looking up a
            name would block the thread, which also carries emergencies.
    """

    def __init__(
        self,
        clock: LiveClock,
        url: str,
        token: str,
        take: Callable[[bytes, float | None], object],
        is_trusted: bool = False,
    ) -> None:
        self._clock = clock
        self._token = token
        self._take = take
        self._host, self._port, self._path = _parse(url, is_trusted)
        self._sock: socket.socket | None = None
        self._dialling: Dialling | None = None
        self._data = bytearray()
        self._is_over = False
        self._open()

    def _open(self) -> None:
        if self._is_over or not self._host:
            return
        self._data.clear()
        self._dialling = Dialling(self._clock, self._host, self._port, self._ask, self._again)

    def _ask(self, sock: socket.socket) -> None:
        query = f"?token={self._token}" if self._token else ""
        host = f"[{self._host}]" if ":" in self._host else self._host
        request = f"GET {self._path}{query} HTTP/1.0\r\nHost: {host}:{self._port}\r\n\r\n"
        self._sock = sock
        self._clock.watch(sock.fileno(), self._read)
        with suppress(OSError):
            sock.send(request.encode())  # fits the kernel's buffer, so it is sent whole

    def _read(self) -> None:
        assert self._sock is not None
        try:
            data = self._sock.recv(READ_BYTES)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        self._data += data
        while self._picture():
            pass
        if not data or len(self._data) > MAX_PICTURE_BYTES:
            self._end()
            self._again()

    def _picture(self) -> bool:
        """Pass on the first picture in the data; return False if it is incomplete."""
        start = self._data.find(b"\r\n\r\n")
        head = bytes(self._data[: start + 2])
        length = _LENGTH.search(head)
        if start >= 0 and length is None:  # headers of the response, or an empty line
            del self._data[: start + 4]
            return True
        end = start + 4 + (0 if length is None else int(length[1]))
        if start < 0 or len(self._data) < end:
            return False
        time = _TIME.search(head)
        picture = bytes(self._data[start + 4 : end])
        del self._data[:end]
        if not self._is_over:
            self._take(picture, None if time is None else int(time[1]) / 1000)
        return True

    def _again(self, *_: object) -> None:
        self._clock.call_after(AGAIN_AFTER, self._open)

    def _end(self) -> None:
        if self._sock is not None:
            self._clock.unwatch(self._sock.fileno())
            self._sock.close()
            self._sock = None

    def close(self) -> None:
        """Stop reading."""
        self._is_over = True
        if self._dialling is not None:
            self._dialling.cancel()
        self._end()


def _parse(url: str, may_have_name: bool) -> tuple[str, int, str]:
    """Return host, port and path of a stream; an empty host for an unusable URL."""
    try:
        parts = urlsplit(url)
        host = parts.hostname or ""
        port = parts.port or 80
        if not may_have_name:
            ipaddress.ip_address(host)
    except ValueError:
        return "", 0, ""
    return (host, port, parts.path) if parts.scheme == "http" else ("", 0, "")
