"""What has been sent and not yet acknowledged, segment by segment.

References:
    RFC 2018 (selective acknowledgement), RFC 6675 (the scoreboard and its count of what
    is in flight).
"""

from __future__ import annotations

from dva_sim.network.tcp.send_buffer import PACKET_COST


class SentSegment:
    """One segment under way.

    Attributes:
        start: Its first byte.
        end: The byte after its last.
        sent_at: When it was sent last [s].
        charge: What the send buffer is charged for it [B].
        repeated: It has been sent more than once.
        sacked: It has been acknowledged selectively.
        lost: It is held to be lost.
        resent: It has been sent again since then, and that is under way.
    """

    __slots__ = ("charge", "end", "lost", "repeated", "resent", "sacked", "sent_at", "start")

    def __init__(self, start: int, end: int, sent_at: float, charge: int) -> None:
        self.start, self.end, self.sent_at, self.charge = start, end, sent_at, charge
        self.repeated = self.sacked = self.lost = self.resent = False


class Gain:
    """What one acknowledgement brought.

    Attributes:
        taken: Segments newly acknowledged in order, those already known by selection too.
        delivered: Segments of which nothing was known before, in order or by selection.
        released: Charge of the segments that left the scoreboard [B].
        ambiguous: One of those acknowledged in order had been sent more than once.
    """

    __slots__ = ("ambiguous", "delivered", "released", "taken")

    def __init__(self) -> None:
        self.taken: list[SentSegment] = []
        self.delivered: list[SentSegment] = []
        self.released = 0
        self.ambiguous = False


class Scoreboard:
    """Segments in order of their bytes.

    Attributes:
        queue: All that are not acknowledged in order.
        sacked: How many of them are acknowledged selectively.
        lost: How many are held to be lost.
        resent: How many have been sent again and are under way.
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
        """Forget all of them."""
        self.queue.clear()
        self.sacked = self.lost = self.resent = 0

    def take(self, acknowledged: int, blocks: tuple[tuple[int, int], ...]) -> Gain:
        """Remove what is acknowledged in order, mark what is acknowledged selectively."""
        gain, queue, count = Gain(), self.queue, 0
        for sent in queue:
            if sent.end > acknowledged:
                break
            count += 1
            self._remove(sent, gain)
        if count:
            gain.taken = queue[:count]
            del queue[:count]
        if queue and queue[0].start < acknowledged:
            self._trim(queue[0], acknowledged, gain)
        for start, end in blocks:
            self._select(start, end, gain)
        return gain

    def mark_lost(self, sent: SentSegment) -> None:
        """Hold a segment, or its repetition, to be lost."""
        if not sent.lost:
            sent.lost = True
            self.lost += 1
        if sent.resent:
            sent.resent = False
            self.resent -= 1

    def forgive(self) -> None:
        """None of them was lost after all."""
        for sent in self.queue:
            sent.lost = False
        self.lost = 0

    def repeat(self, sent: SentSegment, now: float) -> None:
        """A segment is sent again at `now` [s]."""
        sent.repeated, sent.sent_at = True, now
        if not sent.resent:
            sent.resent = True
            self.resent += 1

    def merge(self, index: int, mss: int) -> int:
        """Let a segment swallow its small neighbours behind it: the charge set free [B]."""
        sent, free = self.queue[index], 0
        while index + 1 < len(self.queue):
            other = self.queue[index + 1]
            if other.sacked or other.end - sent.start > mss:
                break
            self.lost -= other.lost
            self.resent -= other.resent
            sent.end = other.end
            sent.charge += other.charge - PACKET_COST
            free += PACKET_COST
            del self.queue[index + 1]
        return free

    def _remove(self, sent: SentSegment, gain: Gain) -> None:
        gain.released += sent.charge
        gain.ambiguous = gain.ambiguous or sent.repeated
        if sent.sacked:
            self.sacked -= 1
        else:
            gain.delivered.append(sent)
        self.lost -= sent.lost
        self.resent -= sent.resent

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
                sent.sacked, sent.lost, sent.resent = True, False, False
                self.sacked += 1
                gain.delivered.append(sent)
