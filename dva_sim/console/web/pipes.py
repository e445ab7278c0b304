"""Pipes to the other processes, in the event loop: what they say is taken at once."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Callable
from typing import cast

from dva_sim.console.web.outbox import Asked, OutgoingLines

MOST_LINE = 32 << 20  # bytes; a scene is a few hundred thousand


class Lines:
    """Pieces of bytes as whole lines."""

    def __init__(self) -> None:
        self._pieces: list[bytes] = []
        self._size = 0

    def feed(self, data: bytes) -> list[bytes]:
        """Take some bytes; the lines that are complete with them, without their ends.

        Raises:
            ValueError: a line does not end.
        """
        first, *rest = data.split(b"\n")
        self._pieces.append(first)
        self._size += len(first)
        if self._size > MOST_LINE:
            raise ValueError(f"a line is longer than {MOST_LINE} bytes")
        if not rest:
            return []
        lines = [b"".join(self._pieces), *rest[:-1]]
        self._pieces, self._size = [rest[-1]], len(rest[-1])
        return lines


class PipeEnd(asyncio.Protocol):
    """One end of a socket pair.

    Args:
        take: Gets what arrives.
        end: Called once when nothing more will.
    """

    def __init__(self, take: Callable[[bytes], None], end: Callable[[], None]) -> None:
        self._take, self._end = take, end
        self._transport: asyncio.Transport | None = None
        self._room = True
        self.outbox = OutgoingLines()

    async def open(self, number: int) -> PipeEnd:
        """Use an open socket by its number."""
        sock = socket.socket(fileno=number)
        sock.setblocking(False)
        await asyncio.get_running_loop().create_connection(lambda: self, sock=sock)
        return self

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """It can be written to; what waits, waits here, where the newest replaces the older."""
        self._transport = cast(asyncio.Transport, transport)
        self._transport.set_write_buffer_limits(high=4096)
        self._flush()

    def data_received(self, data: bytes) -> None:
        """Something arrived."""
        self._take(data)

    def connection_lost(self, exc: Exception | None) -> None:
        """The other process has ended."""
        self._transport = None
        self._end()

    def pause_writing(self) -> None:
        """The other process does not read."""
        self._room = False

    def resume_writing(self) -> None:
        """It does again."""
        self._room = True
        self._flush()

    @property
    def is_open(self) -> bool:
        """Whether the other process is there."""
        return self._transport is not None

    def send(self, asked: Asked) -> bool:
        """Say something: False if it cannot be said."""
        if self._transport is None or not self.outbox.put(asked):
            return False
        self._flush()
        return True

    def _flush(self) -> None:
        while self._transport is not None and self._room:
            line = self.outbox.next()
            if line is None:
                return
            self._transport.write(line)

    def close(self) -> None:
        """Say nothing more."""
        if self._transport is not None:
            self._transport.close()
