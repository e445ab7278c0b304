"""Receiving half of an end: order, the receive window, and when to acknowledge.

References:
    RFC 9293 (windows), RFC 2018 and 2883 (selective and duplicate acknowledgement),
    RFC 7323, section 4.3 (which time stamp is echoed), RFC 1122, section 4.2.3.2 (delayed
    acknowledgement); Sarolahti, Kuznetsov: Congestion Control in Linux TCP. USENIX Annual
    Technical Conference, FREENIX Track, 2002 (quick and adaptive acknowledgements);
    ip-sysctl (tcp_pingpong_thresh = 1). Measured on Linux 6.18: a full segment without PSH is
    not acknowledged when it is read.
"""

from __future__ import annotations

from collections.abc import Callable
from math import inf

from dva_sim.kernel.clock import Clock
from dva_sim.network.tcp.parameters import TcpOptions
from dva_sim.network.tcp.retransmission_timer import RoundTrip, Timer
from dva_sim.network.tcp.send_queue import SMALLEST

FIRST_WINDOW = 65_160  # 45 full segments [B]
MAX_WINDOW = 3_145_728  # half of tcp_rmem's third value [B]
QUICK = 16  # segments acknowledged at once after a pause and after trouble
MAX_DELAY = 0.2  # maximum delay of an acknowledgement in a dialogue [s]
BLOCKS = 3  # selective acknowledgements that fit beside time stamps


class Receiver:
    """Receiver of an end: turns segments into bytes in order.

    Args:
        clock: The run's clock.
        options: Options of this end.
        times: Round trip as this end's sender sees it.
        acknowledge: Sends an acknowledgement without data.

    Attributes:
        next: First byte that is missing.
        read_to: First byte not read by the program.
        edge: First byte beyond the window last advertised to the other end.
        acknowledged: First missing byte last acknowledged to the other end.
        blocks: Bytes received beyond `next`, latest first.
        duplicate: Something has arrived twice since the last acknowledgement.
        stamp: Time stamp to echo [s].
        pending: Segments with data since the last acknowledgement.
        urgent: The next acknowledgement must not wait.
        dialogue: Data goes back soon after data has come, so that acknowledgements wait
            to ride on it.
    """

    def __init__(
        self,
        clock: Clock,
        options: TcpOptions,
        times: RoundTrip,
        acknowledge: Callable[[], object],
    ) -> None:
        self._clock = clock
        self._options = options
        self._times = times
        self._acknowledge = acknowledge
        self.next = self.read_to = self.acknowledged = 0
        self._automatic = options.receive_buffer is None
        self._window = FIRST_WINDOW
        if options.receive_buffer is not None:
            self._window = max(2 * options.receive_buffer, SMALLEST) // 2
        self.edge = self._window
        self.blocks: list[tuple[int, int]] = []
        self.duplicate = self.urgent = self.dialogue = False
        self.stamp = 0.0
        self.pending = 0
        self._quick = 0
        self._last_data = -inf
        self._patience = options.delayed_ack
        self._largest = 536  # segment seen [B]; RFC 9293's default to start with
        self._pushed = 0  # segments that are small or have PSH, not acknowledged
        self._timer = Timer(clock, self._waited, options.tick)

    def take(self, start: int, end: int, now: float, pushes: bool) -> bool:
        """Take bytes `start` to `end` at `now` [s]; return True if some of them are in order."""
        if end <= self.next:
            self.duplicate = True
            self._hurry()
            return False
        if start > self.next:
            self.urgent = True
            if start < self.edge:
                self._keep(start, end)
            return False
        self._note_rhythm(now)
        # A full segment without PSH is the first part of more, so its acknowledgement waits for the
        # next one even if the program reads at once.
        size = end - start
        if size < self._largest:
            self._pushed += 1
        else:
            self._largest = min(size, self._options.mss)
            self._pushed = max(self._pushed, int(pushes))
        self.duplicate = self.duplicate or start < self.next
        self.next = end
        self.pending += 1
        if self.blocks:
            self.urgent = True
            self._absorb()
        return True

    def read(self, count: int) -> int:
        """Take up to `count` bytes [B] for the program; return how many there were."""
        taken = min(count, self.next - self.read_to)
        self.read_to += taken
        if self._automatic:
            self._window = min(self._window + taken, MAX_WINDOW)
        drained = self.pending and self.read_to == self.next
        pushed = self._pushed > (1 if self.dialogue else 0)
        if (drained and (pushed or self._has_full_one())) or self._reopened():
            self._acknowledge()
        return taken

    def must_acknowledge(self) -> bool:
        """Return True if an acknowledgement leaves at once."""
        if self.urgent:
            return True
        if not self.pending:
            return False
        quick = self._quick > 0 and not self.dialogue
        return quick or self._has_full_one() or not self._patience

    def wait(self, now: float) -> None:
        """Let the acknowledgement wait for something to ride on."""
        # RFC 1122 allows half a second at most.
        longest = MAX_DELAY if self.dialogue else 0.5
        longest = min(longest, max(self._times.smoothed, self._options.delayed_ack))
        at = now + min(self._patience, longest)
        if at < self._timer.deadline:
            self._timer.set(at)

    def leaves(self, now: float, data: bool) -> None:
        """Note that a segment leaves, and the acknowledgement with it."""
        if data and now - self._last_data < self._patience:
            self.dialogue = True
        if self.pending and self._quick:
            self._quick -= 1
        self.pending = 0
        self.urgent = False
        self.duplicate = False
        self._pushed = 0
        self.acknowledged = self.next
        self.edge = max(self.edge, self.read_to + self._window)
        self._timer.stop()

    def stop(self) -> None:
        """Acknowledge nothing more."""
        self._timer.stop()

    def _waited(self) -> None:
        """Send the acknowledgement alone: nothing came to ride on."""
        if self.dialogue:
            self.dialogue = False
            self._patience = self._options.delayed_ack
        else:
            self._patience = min(2 * self._patience, self._times.timeout)
        if self.pending:
            self._acknowledge()

    def _reopened(self) -> bool:
        """Return True if the window at least doubled, by a segment (RFC 9293, 3.8.6.2.2)."""
        before = self.edge - self.next
        after = self.read_to + self._window - self.next
        least = min(self._options.mss, self._window // 2)
        return after >= 2 * before and after - before >= least

    def _has_full_one(self) -> bool:
        """Return True if more than a full segment is unacknowledged."""
        return self.next - self.acknowledged > self._largest

    def _note_rhythm(self, now: float) -> None:
        """Note how soon the next data can be expected."""
        gap = now - self._last_data
        base = self._options.delayed_ack
        self._last_data = now
        if gap > self._times.timeout:
            self._quick = QUICK
        elif gap <= base / 2:
            self._patience = self._patience / 2 + base / 2
        elif gap < self._patience:
            self._patience = min(self._patience / 2 + gap, self._times.timeout)

    def _hurry(self) -> None:
        self.urgent = True
        self.dialogue = False
        self._quick = QUICK
        self._patience = self._options.delayed_ack

    def _keep(self, start: int, end: int) -> None:
        """Put bytes that came too early first among the blocks, with those they touch."""
        apart = []
        for first, last in self.blocks:
            if last < start or first > end:
                apart.append((first, last))
            else:
                start = min(start, first)
                end = max(end, last)
        self.blocks = [(start, end), *apart]

    def _absorb(self) -> None:
        """Take blocks that are in order now."""
        for first, last in sorted(self.blocks):
            if first > self.next:
                break
            self.next = max(self.next, last)
        self.blocks = [block for block in self.blocks if block[1] > self.next]
