"""Pipes between two processes that never wait for each other.

JSON lines that cannot be written yet wait in a small outbox; for some kinds, only the newest waits.
When it is full, the oldest line that may be lost is dropped and counted. Lines that must arrive,
such as the result of an action, are never dropped: there are few of them.
"""

from __future__ import annotations

import json
import os
from collections import OrderedDict
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from typing_extensions import override

if TYPE_CHECKING:
    import asyncio

MAX_WAITING = 64  # maximum waiting lines
MAX_LINE = 32 << 20  # maximum size of a line [B]; a scene has a few hundred thousand
READ_BYTES = 1 << 16  # maximum size of a read [B]

Line = dict[str, Any]


class Lines:
    """Assembles lines from pieces of bytes."""

    def __init__(self) -> None:
        self._pieces: list[bytes] = []
        self._size = 0

    def feed(self, data: bytes) -> list[bytes]:
        """Take some bytes and return the lines that they complete, without line ends.

        Raises:
            ValueError: a line is longer than `MAX_LINE`.
        """
        first, *rest = data.split(b"\n")
        self._pieces.append(first)
        self._size += len(first)
        if self._size > MAX_LINE:
            raise ValueError(f"a line is longer than {MAX_LINE} bytes")
        if not rest:
            return []
        lines = [b"".join(self._pieces), *rest[:-1]]
        self._pieces = [rest[-1]]
        self._size = len(rest[-1])
        return lines


class PipeEnd:
    """One end of a socket or a pipe, which never blocks.

    Args:
        end: File descriptor; `close` closes it.
        following: Function that returns the next bytes to write; None if there are none.

    Attributes:
        is_open: True until the other end closes or fails.
    """

    def __init__(self, end: int, following: Callable[[], bytes | None] = lambda: None) -> None:
        os.set_blocking(end, False)
        self._end = end
        self._following = following
        self._unsent = b""
        self._lines = Lines()
        self.is_open = True

    def fileno(self) -> int:
        """Return the file descriptor; -1 once it is closed."""
        return self._end

    def offer(self, data: bytes) -> bool:
        """Take data to write, now or later; return False if earlier data still waits."""
        if not self.flush() or not self.is_open:
            return False
        self._unsent = data
        self.flush()
        return True

    def flush(self) -> bool:
        """Write as much as fits; return True if nothing is waiting."""
        try:
            while self.is_open and (data := self._unsent or self._following()):
                self._unsent = data
                self._unsent = data[os.write(self._end, data) :]
        except BlockingIOError:
            return False
        except OSError:
            self.is_open = False
        return True

    def read(self) -> bytes | None:
        """Return newly received bytes; None if there are none, empty at the end of the pipe."""
        try:
            data = os.read(self._end, READ_BYTES)
        except BlockingIOError:
            return None
        except OSError:
            data = b""
        self.is_open = self.is_open and bool(data)
        return data

    def lines(self) -> list[Line]:
        """Return the lines received since the last call, without those that are not JSON."""
        try:
            whole = self._lines.feed(self.read() or b"")
        except ValueError:
            self.is_open = False
            return []
        return [line for text in whole if (line := _read(text)) is not None]

    def close(self) -> None:
        """Write as many waiting lines as fit, and close the pipe; may be repeated."""
        if self._end >= 0:
            self.flush()
            self.is_open = False
            os.close(self._end)
            self._end = -1  # the kernel may give the number to another file at once


def _read(text: bytes) -> Line | None:
    try:
        line = json.loads(text)
    except ValueError:
        return None
    return line if isinstance(line, dict) else None


class WatchedEnd(PipeEnd):
    """A pipe in an event loop: incoming data is taken at once, waiting data written when it fits.

    Args:
        loop: Event loop that watches the pipe.
        end: See `PipeEnd`.
        take: Callback for incoming data.
        ended: Called once at the end of the pipe.
        following: See `PipeEnd`.
    """

    def __init__(
        self,
        loop: asyncio.AbstractEventLoop,
        end: int,
        take: Callable[[bytes], object],
        ended: Callable[[], object] = lambda: None,
        following: Callable[[], bytes | None] = lambda: None,
    ) -> None:
        super().__init__(end, following)
        self._loop = loop
        self._take = take
        self._ended = ended
        self._waits = False
        loop.add_reader(end, self._hear)

    def _hear(self) -> None:
        data = self.read()
        if data:
            self._take(data)
        elif data is not None:
            self.close()
            self._ended()

    def flush(self) -> bool:
        """Write as much as fits now, the rest later; return True if nothing is waiting."""
        done = super().flush()
        if self._waits is done:
            self._waits = not done
            if self._waits:
                self._loop.add_writer(self._end, self.flush)
            else:
                self._loop.remove_writer(self._end)
        return done

    @override
    def close(self) -> None:
        if self._end >= 0:
            self._loop.remove_reader(self._end)
            self._loop.remove_writer(self._end)
            self._waits = False
        super().close()


@dataclass(frozen=True)
class LineKinds:
    """Kinds of lines, by their `k`, with special rules for waiting.

    Attributes:
        newest: Kinds of which only the newest line of each key waits.
        kept: Kinds that are never dropped.
        first_dropped: Kinds that are dropped before all others.
    """

    newest: frozenset[str]
    kept: frozenset[str]
    first_dropped: frozenset[str] = frozenset()


class LineOutbox:
    """Lines waiting to be written.

    Attributes:
        dropped: Lines that were lost, or replaced by newer ones.
    """

    def __init__(self, kinds: LineKinds) -> None:
        self._kinds = kinds
        self._waiting: OrderedDict[object, tuple[str, bytes]] = OrderedDict()
        self._number = self.dropped = 0

    def __len__(self) -> int:
        return len(self._waiting)

    def put(self, line: Mapping[str, Any], key: object = None) -> None:
        """Add a line; of some kinds it replaces a waiting line with the same `key`."""
        kind = str(line.get("k"))
        self._number += 1
        key_of_line = (kind, key) if kind in self._kinds.newest else self._number
        if self._waiting.pop(key_of_line, None) is not None:
            self.dropped += 1
        elif len(self._waiting) >= MAX_WAITING:
            self._drop_one()
        data = json.dumps(line, separators=(",", ":"), ensure_ascii=False).encode() + b"\n"
        self._waiting[key_of_line] = kind, data

    def next(self) -> bytes | None:
        """Remove and return the oldest line."""
        return self._waiting.popitem(last=False)[1][1] if self._waiting else None

    def _drop_one(self) -> None:
        lost = [p for p, (kind, _) in self._waiting.items() if kind not in self._kinds.kept]
        first = [p for p in lost if self._waiting[p][0] in self._kinds.first_dropped]
        for key_of_line in (first or lost)[:1]:
            del self._waiting[key_of_line]
            self.dropped += 1


class LinePipe(PipeEnd):
    """One end of a socket on which lines go both ways.

    Args:
        end: See `PipeEnd`.
        kinds: Kinds of the lines that are written.

    Attributes:
        outbox: Lines waiting to be written.
    """

    def __init__(self, end: int, kinds: LineKinds) -> None:
        self.outbox = LineOutbox(kinds)
        super().__init__(end, self.outbox.next)

    def put(self, line: Mapping[str, Any], key: object = None) -> None:
        """Write a line as soon as there is room; see `LineOutbox`."""
        if self.is_open:
            self.outbox.put(line, key)
            self.flush()
