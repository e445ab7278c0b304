"""What a program notes while it runs, in memory shared with whoever started it.

Noting costs about a microsecond and needs no connection, and the notes outlive the program:
it may be killed at any moment, and is at the end.
"""

from __future__ import annotations

import mmap
import struct
from enum import IntEnum

_COUNT = struct.Struct("q")
_NOTE = struct.Struct("iid")


class Kind(IntEnum):
    """What happened."""

    OPENED = 0
    CONNECTED = 1
    HANDSHAKE = 2
    STARTED = 3
    ISSUED = 4
    REPLIED = 5
    TIMEOUT = 6
    ALERT = 7
    APPLIED = 8


Note = tuple[int, int, float]
"""Kind, number of the command and time [s]."""


class Notes:
    """Made before the program's process is, read after.

    Args:
        room: Notes that find room.
    """

    def __init__(self, room: int) -> None:
        self._room = room
        self._memory = mmap.mmap(-1, _COUNT.size + room * _NOTE.size)
        self._count = 0

    def add(self, kind: Kind, number: int, time: float) -> None:
        """Note that something happened.

        Raises:
            MemoryError: there is no room left.
        """
        if self._count == self._room:
            raise MemoryError(f"no room for more than {self._room} notes")
        _NOTE.pack_into(self._memory, _COUNT.size + self._count * _NOTE.size, kind, number, time)
        self._count += 1
        _COUNT.pack_into(self._memory, 0, self._count)

    def read(self) -> list[Note]:
        """All notes so far, in their order."""
        (count,) = _COUNT.unpack_from(self._memory, 0)
        end = _COUNT.size + count * _NOTE.size
        return list(_NOTE.iter_unpack(self._memory[_COUNT.size : end]))
