"""Messages over a TCP connection, in order, as a program writes them."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Any

from dva_sim.network.tcp.endpoint import TcpEndpoint


class OrderedMessages:
    """Messages written to one end of a connection and read from the other, in order.

    Messages beyond the send buffer wait in the program, without limit.

    Args:
        writer: Endpoint that messages are written to.
        reader: Endpoint that messages are read from.
        deliver: Callback for every message that has been read completely.

    Attributes:
        waiting: Bytes that wait in the program [B].
    """

    def __init__(
        self, writer: TcpEndpoint, reader: TcpEndpoint, deliver: Callable[[Any], object]
    ) -> None:
        self._writer = writer
        self._reader = reader
        self._deliver = deliver
        self._read = 0
        self._ends_at = 0
        self._ends: deque[tuple[int, Any]] = deque()  # of the messages under way
        self._is_open = False
        self.waiting = 0
        writer.on_writable = self._write
        reader.on_readable = self._take

    def open(self) -> None:
        """Let the connection take what is written from now on."""
        self._is_open = True
        self._write()

    def send(self, payload: Any, size: int) -> None:
        """Write a message of `size` bytes [B], or as much as there is room for."""
        self._ends_at += size
        self._ends.append((self._ends_at, payload))
        self.waiting += size
        self._write()

    def _write(self) -> None:
        if self._is_open and self.waiting:
            self.waiting -= self._writer.write(self.waiting)

    def _take(self) -> None:
        self._read += self._reader.read(self._reader.readable)
        while self._ends and self._ends[0][0] <= self._read:
            self._deliver(self._ends.popleft()[1])
