"""Send queue: bytes that wait, and segments sent and not yet acknowledged.

The buffer is counted as the kernel charges it: a packet costs more than its bytes.

References:
    socket(7) (SO_SNDBUF is doubled), tcp(7) and ip-sysctl (tcp_wmem, whose largest value
    is used); RFC 1122, section 4.2.3.4 (no more than half of the largest window offered is
    gathered). Measured on Linux 6.18: that a small packet costs its payload and 832 B, that
    a socket becomes writable again at two thirds, and what a segment counts in tuning.
    RFC 2018 (selective acknowledgement), RFC 6675 (the scoreboard and its count of what
    is in flight).
"""

from __future__ import annotations

from collections import deque

PACKET_COST = 832  # charge of a packet to the send buffer on top of its payload [B]
SMALLEST = 4608  # minimum of SO_SNDBUF, after doubling [B]
LARGEST = 4_194_304  # maximum of automatic tuning, the third value of tcp_wmem [B]
PER_SEGMENT = 2304  # charge of a full segment in automatic tuning; twice ten at first [B]
WAITING_SEGMENTS = 45  # maximum segments in a waiting packet: 64 KiB with its headers


class SendBuffer:
    """Bytes written and not yet acknowledged.

    Bytes that cannot leave at once are gathered in waiting packets, which is cheap; each
    packet costs 832 B until it is acknowledged, and so does each piece that is cut from one.

    Args:
        size: SO_SNDBUF as the program sets it [B], or None = automatic.
        initial_window: Initial congestion window [segments].
        mss: Payload of a full segment [B].

    Attributes:
        limit: Charge above which no further packet is begun [B].
        used: Current charge [B].
        blocked: True if a writer waits for room, for example after a partial write.
        is_cut: True if the last segment left part of its packet behind, and so has no PSH.
    """

    __slots__ = (
        "_automatic",
        "_largest_window",
        "_mss",
        "_packet",
        "_waiting",
        "blocked",
        "is_cut",
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
        self.blocked = self.is_cut = False

    def offered(self, window: int) -> None:
        """Note the other end's room of `window` bytes [B]: packets half as long may wait."""
        if window > self._largest_window:
            self._largest_window = window
            segments = min(WAITING_SEGMENTS, window // 2 // self._mss)
            self._packet = max(1, segments) * self._mss

    @property
    def has_room(self) -> bool:
        """True if a third is free, when the kernel reports a socket as writable."""
        return 3 * self.used <= 2 * self.limit

    def take(self, count: int) -> int:
        """Take up to `count` bytes [B]; return how many found room."""
        waiting = self._waiting
        taken = 0
        if waiting and waiting[-1] < self._packet:
            taken = min(count, self._packet - waiting[-1])
            waiting[-1] += taken
            self.used += taken
        # The last packet begun below the limit may exceed it.
        while taken < count and self.used < self.limit:
            part = min(count - taken, self._packet)
            waiting.append(part)
            self.used += part + PACKET_COST
            taken += part
        self.blocked = self.blocked or taken < count
        return taken

    def depart(self, size: int) -> int:
        """Return the charge of a leaving segment of `size` bytes until it is acknowledged [B]."""
        waiting = self._waiting
        left = size
        packets = 0
        while waiting and left >= waiting[0]:
            left -= waiting.popleft()
            packets += 1
        self.is_cut = bool(left and waiting)
        if self.is_cut:
            waiting[0] -= left
            self.used += PACKET_COST
            packets += 1
        return size + packets * PACKET_COST

    def release(self, charge: int) -> None:
        """Release an acknowledged segment: give back its charge [B]."""
        self.used -= charge

    def reopens(self, window: float, in_flight: int) -> bool:
        """Return True if there is room again.

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


class SentSegment:
    """One segment under way.

    Attributes:
        start: Its first byte.
        end: The byte after its last.
        sent_at: Time of the latest transmission [s].
        charge: Charge to the send buffer [B].
        pushes: True if it has PSH: it ends the data written by then.
        repeated: It has been sent more than once.
        sacked: It has been acknowledged selectively.
        lost: It is held to be lost.
        resent: It has been sent again since then, and that is under way.
    """

    __slots__ = (
        "charge",
        "end",
        "lost",
        "pushes",
        "repeated",
        "resent",
        "sacked",
        "sent_at",
        "start",
    )

    def __init__(
        self, start: int, end: int, sent_at: float, charge: int, pushes: bool = True
    ) -> None:
        self.start = start
        self.end = end
        self.sent_at = sent_at
        self.charge = charge
        self.pushes = pushes
        self.repeated = self.sacked = self.lost = self.resent = False


class Gain:
    """Effect of one acknowledgement.

    Attributes:
        delivered: Segments of which nothing was known before, in order or by selection.
        released: Charge of the segments that left the scoreboard [B].
        ambiguous: One of those acknowledged in order had been sent more than once.
    """

    __slots__ = ("ambiguous", "delivered", "released", "taken")

    def __init__(self) -> None:
        self.delivered: list[SentSegment] = []
        self.released = 0
        self.ambiguous = False


class Scoreboard:
    """Segments in order of their bytes.

    Attributes:
        queue: All that are not acknowledged in order.
        sacked: Number of selectively acknowledged segments.
        lost: Number of segments considered lost.
        resent: Number of retransmitted segments under way.
    """

    __slots__ = ("lost", "queue", "resent", "sacked")

    def __init__(self) -> None:
        self.queue: list[SentSegment] = []
        self.sacked = self.lost = self.resent = 0

    @property
    def in_flight(self) -> int:
        """Segments on their way, by this account (RFC 6675, pipe)."""
        return len(self.queue) - self.sacked - self.lost + self.resent

    def clear(self) -> None:
        """Forget all segments."""
        self.queue.clear()
        self.sacked = self.lost = self.resent = 0

    def take(self, acknowledged: int, blocks: tuple[tuple[int, int], ...]) -> Gain:
        """Remove what is acknowledged in order, mark what is acknowledged selectively."""
        gain = Gain()
        queue = self.queue
        count = 0
        for sent in queue:
            if sent.end > acknowledged:
                break
            count += 1
            gain.released += sent.charge
            gain.ambiguous = gain.ambiguous or sent.repeated
            if sent.sacked:
                self.sacked -= 1
            else:
                gain.delivered.append(sent)
            self.lost -= sent.lost
            self.resent -= sent.resent
        if count:
            del queue[:count]
        if queue and queue[0].start < acknowledged:
            self._trim(queue[0], acknowledged, gain)
        for start, end in blocks:
            self._select(start, end, gain)
        return gain

    def mark_lost(self, sent: SentSegment) -> None:
        """Mark a segment, or its repetition, as lost."""
        if not sent.lost:
            sent.lost = True
            self.lost += 1
        if sent.resent:
            sent.resent = False
            self.resent -= 1

    def forgive(self) -> None:
        """Forgive losses: none of them was lost after all."""
        for sent in self.queue:
            sent.lost = False
        self.lost = 0

    def repeat(self, sent: SentSegment, now: float, probes: bool = False) -> None:
        """Repeat a segment at `now` [s].

        One that probes for a tail loss is not counted in flight once more, as in Linux.
        """
        sent.repeated = True
        sent.sent_at = now
        if not (sent.resent or probes):
            sent.resent = True
            self.resent += 1

    def merge(self, index: int, mss: int) -> int:
        """Merge the small segments behind one into it; return the charge set free [B]."""
        sent = self.queue[index]
        free = 0
        while index + 1 < len(self.queue):
            other = self.queue[index + 1]
            if other.sacked or other.end - sent.start > mss:
                break
            self.lost -= other.lost
            self.resent -= other.resent
            sent.end = other.end
            sent.pushes = sent.pushes or other.pushes
            sent.charge += other.charge - PACKET_COST
            free += PACKET_COST
            del self.queue[index + 1]
        return free

    def _trim(self, sent: SentSegment, acknowledged: int, gain: Gain) -> None:
        cut = acknowledged - sent.start
        sent.start = acknowledged
        sent.charge -= cut
        gain.released += cut

    def _select(self, start: int, end: int, gain: Gain) -> None:
        for sent in self.queue:
            if sent.start >= end:
                break
            if sent.start >= start and sent.end <= end and not sent.sacked:
                self.lost -= sent.lost
                self.resent -= sent.resent
                sent.sacked = True
                sent.lost = False
                sent.resent = False
                self.sacked += 1
                gain.delivered.append(sent)
