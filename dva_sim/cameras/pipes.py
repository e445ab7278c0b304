"""Lines of JSON between two processes, of which one never waits for the other.

What has no room waits in an outbox of a few lines, of some kinds only the newest; when it is full
the oldest that may be lost is lost, and counted. Lines that must arrive, such as what an action
came to, are never dropped: there are few of them.
"""

from __future__ import annotations

import json
import socket
from collections import OrderedDict
from contextlib import suppress
from typing import Any

MOST_WAITING = 64  # lines
NEWEST_ONLY = frozenset({"pos", "frame", "seat", "rows", "hazards", "events", "devices", "told"})
DROPPED_FIRST = "log"  # whose numbers tell what is missing
KEPT = frozenset({"scene", "shelf", "done", "bye", "contain"})  # lines that are never dropped
MOST_LINE = 1 << 20  # of one that is read [B]
AT_ONCE = 1 << 16  # that are read [B]

Line = dict[str, Any]


class LineOutbox:
    """Lines that wait to be written.

    Attributes:
        dropped: Lines that were lost, or replaced by newer ones.
    """

    def __init__(self) -> None:
        self._waiting: OrderedDict[object, tuple[str, bytes]] = OrderedDict()
        self._number = self.dropped = 0

    def __len__(self) -> int:
        return len(self._waiting)

    def put(self, line: Line, key: object = None) -> None:
        """Add a line; `key` tells lines of one kind apart of which only the newest counts."""
        kind = str(line.get("k"))
        self._number += 1
        place = (kind, key) if kind in NEWEST_ONLY else self._number
        if self._waiting.pop(place, None) is not None:
            self.dropped += 1
        elif len(self._waiting) >= MOST_WAITING:
            self._drop_one()
        data = json.dumps(line, separators=(",", ":"), ensure_ascii=False).encode() + b"\n"
        self._waiting[place] = kind, data

    def pop(self) -> bytes:
        """The oldest."""
        return self._waiting.popitem(last=False)[1][1]

    def _drop_one(self) -> None:
        lost = [place for place, (kind, _) in self._waiting.items() if kind not in KEPT]
        logs = [place for place in lost if self._waiting[place][0] == DROPPED_FIRST]
        for place in (logs or lost)[:1]:
            del self._waiting[place]
            self.dropped += 1


class LinePipe:
    """One end of a socket on which lines go both ways; nothing here ever waits.

    Args:
        end: Connected; it is closed by `close`.

    Attributes:
        outbox: What waits to be written.
        is_open: Whether the other end is still there.
    """

    def __init__(self, end: socket.socket) -> None:
        end.setblocking(False)
        self._end, self._rest, self._read = end, b"", b""
        self.outbox, self.is_open = LineOutbox(), True

    def fileno(self) -> int:
        """Of the socket."""
        return self._end.fileno()

    def put(self, line: Line, key: object = None) -> None:
        """Write a line as soon as there is room; see `LineOutbox`."""
        if self.is_open:
            self.outbox.put(line, key)
            self.flush()

    def flush(self) -> bool:
        """Write what there is room for; True if nothing waits any more."""
        try:
            while self.is_open and (self._rest or len(self.outbox)):
                data = self._rest or self.outbox.pop()
                self._rest = data
                self._rest = data[self._end.send(data) :]
        except BlockingIOError:
            return False
        except OSError:
            self.is_open = False
        return True

    def lines(self) -> list[Line]:
        """What has come since; what is no line of JSON is left out."""
        try:
            data = self._end.recv(AT_ONCE)
        except BlockingIOError:
            return []
        except OSError:
            data = b""
        if not data:
            self.is_open = False
            return []
        *whole, self._read = (self._read + data).split(b"\n")
        if len(self._read) > MOST_LINE:
            self._read = b""
        return [line for text in whole if (line := _read(text)) is not None]

    def close(self) -> None:
        """Say what waits, if there is room, and nothing more."""
        self.flush()
        self.is_open = False
        with suppress(OSError):
            self._end.shutdown(socket.SHUT_WR)
        self._end.close()


def _read(text: bytes) -> Line | None:
    try:
        line = json.loads(text)
    except ValueError:
        return None
    return line if isinstance(line, dict) else None
