"""Pictures in transit from the drawing thread to the server.

A record is the length of a header (4 bytes, big-endian), the header as JSON, and a JPEG of as many
bytes as the header says. The renderer may die in the middle of a record and begin again on the
same pipe, so the reader finds the next whole record by itself.
"""

from __future__ import annotations

import json
from typing import NamedTuple

MAGIC = b'{"robot":'  # beginning of each header
JPEG_END = b"\xff\xd9"
MAX_HEADER = 512  # maximum size of a header [B]
MAX_PICTURE = 1 << 20  # maximum size of a picture [B]
ALIVE = -1  # robot number of a keep-alive record


class Picture(NamedTuple):
    """Picture of a robot's camera.

    Attributes:
        robot: Index of the robot in the scene; `ALIVE` for none.
        number: Number of the frame.
        captured_ms: Capture time, virtual [ms].
        arrived_ms: Arrival time over the link, virtual [ms].
        jpeg: The picture.
    """

    robot: int
    number: int
    captured_ms: int
    arrived_ms: int
    jpeg: bytes


def pack(picture: Picture) -> bytes:
    """Return a picture as a record."""
    robot, number, captured, arrived, jpeg = picture
    header = {"robot": robot, "n": number, "captured_ms": captured, "arrived_ms": arrived}
    data = json.dumps(header | {"bytes": len(jpeg)}, separators=(",", ":")).encode()
    return len(data).to_bytes(4, "big") + data + jpeg


class Unpacker:
    """Assembles records from pieces of bytes.

    Attributes:
        skipped: Number of bytes outside of complete records.
    """

    def __init__(self) -> None:
        self._unread = bytearray()
        self.skipped = 0

    def feed(self, data: bytes) -> list[Picture]:
        """Take some bytes and return the pictures that they complete."""
        self._unread += data
        pictures = []
        while len(self._unread) >= 4 + len(MAGIC):
            first = self._first()
            if first is None:
                break
            picture, used = first
            del self._unread[:used]
            if picture is not None:
                pictures.append(picture)
        return pictures

    def _first(self) -> tuple[Picture | None, int] | None:
        """Return the first picture and the size of its record [B]; None if more bytes are needed.

        Where a record is damaged, the picture is None and the size is that of the bytes to skip.
        """
        size = int.from_bytes(self._unread[:4], "big")
        if size > MAX_HEADER or self._unread[4 : 4 + len(MAGIC)] != MAGIC:
            return None, self._skip()
        if len(self._unread) < 4 + size:
            return None
        try:
            header = json.loads(self._unread[4 : 4 + size])
            names = ("robot", "n", "captured_ms", "arrived_ms", "bytes")
            robot, number, captured, arrived, length = (int(header[name]) for name in names)
        except (ValueError, KeyError, TypeError):
            return None, self._skip()
        end = 4 + size + length
        if not 0 <= length <= MAX_PICTURE:
            return None, self._skip()
        if self._unread.find(MAGIC, 4 + size, end) >= 0:
            return None, self._skip()
        if len(self._unread) < end:
            return None
        jpeg = bytes(self._unread[4 + size : end])
        if jpeg and not jpeg.endswith(JPEG_END):
            return None, self._skip()
        return Picture(robot, number, captured, arrived, jpeg), end

    def _skip(self) -> int:
        """Return the number of bytes before the next possible record."""
        following = self._unread.find(MAGIC, 5)
        used = following - 4 if following > 0 else max(1, len(self._unread) - len(MAGIC) - 3)
        self.skipped += used
        return used
