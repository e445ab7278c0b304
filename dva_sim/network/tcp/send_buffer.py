"""The send buffer as the kernel charges it: a packet costs more than its bytes.

References:
    socket(7) (SO_SNDBUF is doubled), tcp(7) and ip-sysctl (tcp_wmem, whose largest value
    is used); RFC 1122, section 4.2.3.4 (no more than half of the largest window offered is
    gathered). Measured on Linux 6.18: that a small packet costs its payload and 832 B, that
    a socket becomes writable again at two thirds, and what a segment counts in tuning.
"""

from __future__ import annotations

from collections import deque

PACKET_COST = 832  # beside the payload, of each packet that waits or is under way [B]
SMALLEST = 4608  # the least that SO_SNDBUF gives, after doubling [B]
LARGEST = 4_194_304  # tcp_wmem, third value [B]
PER_SEGMENT = 2304  # what automatic tuning counts for a full segment; x 2 x 10 at first [B]
WAITING_SEGMENTS = 45  # how far a packet that waits may grow: 64 KiB with its headers


class SendBuffer:
    """Bytes written and not yet acknowledged.

    Bytes that cannot leave at once are gathered in waiting packets, which is cheap; each
    packet costs 832 B until it is acknowledged, and so does each piece that is cut from one.

    Args:
        size: SO_SNDBUF as the program sets it [B], or None = automatic.
        initial_window: Of the congestion window [segments].
        mss: Payload of a full segment [B].

    Attributes:
        limit: How much may be charged before no further packet is begun [B].
        used: How much is charged [B].
        blocked: Whether somebody waits for room, because a write was not taken whole, say.
    """

    __slots__ = (
        "_automatic",
        "_largest_window",
        "_mss",
        "_packet",
        "_waiting",
        "blocked",
        "limit",
        "used",
    )

    def __init__(self, size: int | None, initial_window: int, mss: int) -> None:
        self._automatic = size is None
        self._mss = self._packet = mss
        self._largest_window = 0
        self.limit = 2 * initial_window * PER_SEGMENT
        if size is not None:
            self.limit = max(2 * size, SMALLEST)
        self.used = 0
        self._waiting: deque[int] = deque()  # payload of each packet that waits [B]
        self.blocked = False

    def offered(self, window: int) -> None:
        """The other end has room for `window` bytes [B]: packets may wait that are half as long."""
        if window > self._largest_window:
            self._largest_window = window
            segments = min(WAITING_SEGMENTS, window // 2 // self._mss)
            self._packet = max(1, segments) * self._mss

    @property
    def has_room(self) -> bool:
        """Whether a third is free: what the kernel calls writable."""
        return 3 * self.used <= 2 * self.limit

    def take(self, count: int) -> int:
        """Charge up to `count` bytes [B]; returns how many found room."""
        waiting, taken = self._waiting, 0
        if waiting and waiting[-1] < self._packet:
            taken = min(count, self._packet - waiting[-1])
            waiting[-1] += taken
            self.used += taken
        while taken < count and self.used < self.limit:
            part = min(count - taken, self._packet)
            waiting.append(part)
            self.used += part + PACKET_COST
            taken += part
        self.blocked = self.blocked or taken < count
        return taken

    def depart(self, size: int) -> int:
        """A segment of `size` bytes [B] leaves: what it is charged until it is acknowledged [B]."""
        waiting, left, packets = self._waiting, size, 0
        while waiting and left >= waiting[0]:
            left -= waiting.popleft()
            packets += 1
        if left and waiting:  # cut off
            waiting[0] -= left
            self.used += PACKET_COST
            packets += 1
        return size + packets * PACKET_COST

    def release(self, charge: int) -> None:
        """Acknowledged: give back its charge [B]."""
        self.used -= charge

    def reopens(self, window: float, in_flight: int) -> bool:
        """Whether there is room again.

        Tunes the size to the congestion window, but not while that is what holds data back.

        Args:
            window: Congestion window [segments].
            in_flight: Segments under way.
        """
        if not self.blocked:
            return False
        if self._automatic and in_flight < int(window):
            self.limit = max(self.limit, min(LARGEST, 2 * int(window) * PER_SEGMENT))
        if not self.has_room:
            return False
        self.blocked = False
        return True
