"""Pictures of robots that run elsewhere, handed on from the address that each robot states.

A page may load nothing but from its own console, so that the console fetches them. An unknown
device chooses the address: only HTTP is spoken, only motion JPEG is handed on, and no
header of the other server reaches a page. A robot's clock is not the page's, so that the times of
its pictures are left out.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator
from contextlib import suppress
from dataclasses import dataclass
from email.message import Message
from typing import Final
from urllib.parse import urlsplit

import h11

from dva_sim.cameras.streams import BOUNDARY

CONNECTED_WITHIN: Final = 5.0  # and answered [s]
SILENCE: Final = 10.0  # without a byte a stream is over [s]
CHUNK: Final = 65_536
MAX_BYTES: Final = 4_000_000  # of one picture
START: Final = b"\xff\xd8"  # of a JPEG
KIND: Final = "multipart/x-mixed-replace"


class NoPictures(Exception):
    """A camera whose pictures cannot be had, and why, in a line."""


@dataclass
class RemoteCamera:
    """An open stream of pictures.

    Attributes:
        reader: Bytes of the response.
        writer: The connection.
        protocol: State of the response.
        boundary: Separator of the pictures.
    """

    reader: asyncio.StreamReader
    writer: asyncio.StreamWriter
    protocol: h11.Connection
    boundary: bytes

    async def pictures(self) -> AsyncGenerator[bytes, None]:
        """Yield pictures as parts of a response, until the other end is silent or ends."""
        try:
            yield f"--{BOUNDARY}\r\n".encode()
            buffer = b""
            while (data := await self._next()) is not None:
                buffer += data
                *whole, buffer = buffer.split(self.boundary)
                pictures = [jpeg for part in whole if (jpeg := _jpeg_in(part))]
                for jpeg in pictures[-1:]:  # a viewer wants the newest
                    yield _part(jpeg)
                if len(buffer) > MAX_BYTES:
                    return
        finally:
            await _close(self.writer)

    async def _next(self) -> bytes | None:
        """Return the next bytes of the response's body; None at its end."""
        with suppress(TimeoutError, OSError, h11.RemoteProtocolError):
            async with asyncio.timeout(SILENCE):
                event = await _event(self.reader, self.protocol)
                if isinstance(event, h11.Data):
                    return bytes(event.data)
        return None


async def open_camera(url: str) -> RemoteCamera:
    """Ask a camera for its stream.

    Args:
        url: Address that the robot states.

    Raises:
        NoPictures: nothing answers there, or with something else.
    """
    try:
        parts = urlsplit(url)
        host, port = parts.hostname, parts.port or 80
    except ValueError:
        raise NoPictures(f"{url!r} is no address of pictures") from None
    if parts.scheme != "http" or not host:
        raise NoPictures(f"its pictures are at {url!r}, which no page can show")
    try:
        async with asyncio.timeout(CONNECTED_WITHIN):
            return await _asked(host, port, parts.path, parts.query)
    except (OSError, TimeoutError, h11.ProtocolError):
        raise NoPictures(f"nothing answers at {host}:{port}") from None


async def _asked(host: str, port: int, path: str, query: str) -> RemoteCamera:
    reader, writer = await asyncio.open_connection(host, port)
    try:
        protocol = h11.Connection(h11.CLIENT)
        target = f"{path or '/'}{'?' if query else ''}{query}"
        headers = [("Host", f"{host}:{port}"), ("Connection", "close")]
        head = protocol.send(h11.Request(method="GET", target=target, headers=headers))
        writer.write((head or b"") + (protocol.send(h11.EndOfMessage()) or b""))
        event = await _event(reader, protocol)
        while isinstance(event, h11.InformationalResponse):
            event = await _event(reader, protocol)
        boundary = _boundary_of(event)
        if boundary is None:
            raise NoPictures(f"{host}:{port} answers with no motion JPEG")
    except BaseException:
        await _close(writer)
        raise
    return RemoteCamera(reader, writer, protocol, boundary)


def _boundary_of(event: object) -> bytes | None:
    """Return what stands between the pictures of a response; None if it holds none."""
    if not isinstance(event, h11.Response) or event.status_code != 200:
        return None
    kind = Message()
    kind["Content-Type"] = dict(event.headers).get(b"content-type", b"").decode("latin-1")
    boundary = kind.get_boundary()
    if kind.get_content_type() != KIND or not boundary:
        return None
    return b"--" + boundary.removeprefix("--").encode()


async def _close(writer: asyncio.StreamWriter) -> None:
    writer.close()
    with suppress(OSError):
        await writer.wait_closed()


async def _event(reader: asyncio.StreamReader, protocol: h11.Connection) -> object:
    while (event := protocol.next_event()) is h11.NEED_DATA:
        protocol.receive_data(await reader.read(CHUNK))
    return event


def _jpeg_in(part: bytes) -> bytes:
    """Return the picture in a part of a response; empty if it holds none."""
    body = part.partition(b"\r\n\r\n")[2]
    return body.removesuffix(b"\r\n") if body.startswith(START) else b""


def _part(jpeg: bytes) -> bytes:
    head = f"Content-Type: image/jpeg\r\nContent-Length: {len(jpeg)}\r\n\r\n"
    return head.encode() + jpeg + f"\r\n--{BOUNDARY}\r\n".encode()
