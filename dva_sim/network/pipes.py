"""Queues of messages with a high-water mark, as a ZeroMQ socket has one for each connection.

Who writes learns of what was read only in steps of the low-water mark, half of the high one:
so a full pipe stays full until half of it has been read.

References:
    ZeroMQ's documentation of ZMQ_SNDHWM, ZMQ_RCVHWM and ZMQ_CONFLATE; that the low-water
    mark is half of the high one was measured.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from typing import Generic, Protocol, TypeVar

HIGH_WATER_MARK = 1000  # ZeroMQ's default, in messages

T = TypeVar("T")


def _nothing() -> None:
    return None


class Pipe(Generic[T]):
    """Messages between a program and its connection.

    Args:
        mark: High-water mark, in messages.
        conflate: Whether only the newest message is kept; there is no mark then.

    Attributes:
        on_room: Called when there is room again after a refusal.
        superseded: Messages that a newer one has replaced.
    """

    def __init__(self, mark: int = HIGH_WATER_MARK, conflate: bool = False) -> None:
        self._mark, self._low, self._conflate = mark, (mark + 1) // 2, conflate
        self._items: deque[T] = deque(maxlen=1 if conflate else None)
        self._written = self._read = self._told = self.superseded = 0
        self._refused = False
        self.on_room: Callable[[], object] = _nothing

    def __len__(self) -> int:
        return len(self._items)

    def __iter__(self) -> Iterator[T]:
        return iter(self._items)

    @property
    def full(self) -> bool:
        """Whether the next message would be refused."""
        return not self._conflate and self._written - self._told >= self._mark

    def put(self, item: T) -> bool:
        """Add a message; False if the mark is reached."""
        if self.full:
            self._refused = True
            return False
        self._written += 1
        self.superseded += self._conflate and len(self._items)
        self._items.append(item)
        return True

    def take(self) -> T | None:
        """The oldest message, if there is one."""
        if not self._items:
            return None
        item = self._items.popleft()
        self._read += 1
        if self._read % self._low == 0:
            self._told = self._read
            if self._refused:
                self._refused = False
                self.on_room()
        return item


class Flow(Protocol):
    """What delivers messages and can be told to wait."""

    def pause(self) -> None:
        """Deliver nothing more: what comes waits, at last at the sender."""

    def resume(self) -> None:
        """Go on with what has waited."""


class ReceivePipe(Pipe[T]):
    """What a connection has delivered and its program has not read yet.

    It tells the connection to wait while it is full.

    Args:
        mark: High-water mark, in messages.
        conflate: Whether only the newest message is kept.

    Attributes:
        flow: The end of the connection that delivers into it.
    """

    flow: Flow | None = None

    def put(self, item: T) -> bool:
        """See `Pipe`; a connection that cannot wait loses what comes while the pipe is full."""
        taken = super().put(item)
        if self.full and self.flow is not None:
            self.flow.pause()
        return taken

    def take(self) -> T | None:
        """See `Pipe`."""
        was_full = self.full
        item = super().take()
        if was_full and not self.full and self.flow is not None:
            self.flow.resume()
        return item
