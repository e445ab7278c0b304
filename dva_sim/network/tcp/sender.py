"""Sending half of an end: which segments may leave, and when.

References:
    RFC 9293 (sliding window), RFC 5681 and 7661 (a window that is not used does not grow),
    RFC 6298 (round trips are never taken from segments sent twice), RFC 896 and
    draft-minshall-nagle-01 (small segments wait for the last small one).
"""

from __future__ import annotations

from collections.abc import Callable
from math import inf

from dva_sim.kernel.clock import Clock
from dva_sim.network.tcp.congestion import HyStart, make_window
from dva_sim.network.tcp.parameters import TcpOptions
from dva_sim.network.tcp.recovery import OPEN, Recovery
from dva_sim.network.tcp.retransmission_timer import PROBE, REORDER, WINDOW, Alarm, RoundTrip
from dva_sim.network.tcp.send_queue import Gain, Scoreboard, SendBuffer, SentSegment

Emit = Callable[[int, int, float, bool], object]
Blocks = tuple[tuple[int, int], ...]


class Sender:
    """Sender of an end: turns bytes into segments.

    Args:
        clock: The run's clock.
        options: Options of this end.
        emit: Sends one segment: first byte, byte after the last, now [s], whether it has PSH.
            A first byte of -1 asks for an acknowledgement.
        give_up: Called when the other end has not answered for too long.

    Attributes:
        total: Bytes written so far.
        next: First byte not sent yet.
        first: First byte not acknowledged.
        edge: First byte that the receive window does not take.
        end_mark: End of the stream, once it is finished.
        retransmitted: Repetitions.
        timeouts: Retransmission time-outs.
        tail_probes: Tail-loss probes.
        buffer: Data written and not acknowledged, in bytes charged.
        board: Segments under way.
        times: The round trip.
        window: The congestion window.
        recovery: Loss recovery.
    """

    def __init__(
        self, clock: Clock, options: TcpOptions, emit: Emit, give_up: Callable[[], object]
    ) -> None:
        self._clock = clock
        self._options = options
        self._emit = emit
        self._give_up = give_up
        self.total = self.next = self.first = self.edge = 0
        self.end_mark: float = inf
        self.segments = self.retransmitted = self.timeouts = self.tail_probes = 0
        self.buffer = SendBuffer(options.send_buffer, options.initial_window, options.mss)
        self.board = Scoreboard()
        self.times = RoundTrip(options)
        self.window = make_window(options)
        self.recovery = Recovery(options, self.times, self.window, self.board)
        self._hystart = HyStart()
        self._alarm = Alarm(clock, options, self.times, self._ring)
        self._unanswered = 0
        self._nodelay = options.nodelay
        self._small_end = 0
        self._last_sent = 0.0
        self._window_used = False
        self._most_out = 0
        self._use_round = 0

    def established(self, round_trip: float | None, repeated: int, edge: int) -> None:
        """Note the end of the opening: its round trip [s] if one was measured, its repetitions."""
        self.edge = edge
        self.buffer.offered(edge)
        if round_trip is not None:
            self.times.sample(round_trip, 0, 0)
            self.times.shortest(round_trip)
        elif repeated:
            self.times.without_sample()
        if repeated > 1 and self._options.congestion_window:
            self.window.window = 1.0  # RFC 5681, section 3.1; Linux forgives one repetition

    def write(self, count: int) -> int:
        """Hand over bytes [B]; returns how many the send buffer took."""
        taken = self.buffer.take(count)
        if taken:
            now = self._clock.now
            if not self.board.queue and self._options.idle_restart:
                self.window.after_idle(now - self._last_sent, self.times.timeout)
            self.total += taken
            self._push(now)
        return taken

    def reopens(self) -> bool:
        """Return True if a program that could not write everything may write again."""
        return self.buffer.reopens(self.window.window, self.board.in_flight)

    def finish(self) -> None:
        """Finish writing; the end itself counts as a byte."""
        self.end_mark = self.total
        self.total += 1
        self._push(self._clock.now)

    def stop(self) -> None:
        """Forget all data, sent or not."""
        self._alarm.stop()
        self.total = self.next
        self.board.clear()

    # Acknowledgements

    def acknowledge(
        self,
        now: float,
        acknowledged: int,
        edge: int,
        blocks: Blocks,
        duplicate: bool,
        echo: float,
    ) -> None:
        """Take one acknowledgement, and send what it allows.

        Args:
            now: Arrival time [s].
            acknowledged: First byte that is missing at the other end.
            edge: First byte that does not fit there.
            blocks: Bytes received beyond, from and to.
            duplicate: It was caused by a segment that had arrived before.
            echo: Time stamp of the segment that caused it [s].
        """
        self._unanswered = 0
        if edge > self.edge:
            self.edge = edge
            self.buffer.offered(edge - acknowledged)
        news = acknowledged > self.first or blocks or duplicate
        if self.board.queue and (news or self.recovery.probe_end >= 0):
            self._digest(now, acknowledged, blocks, duplicate, echo)
        elif self.total > self.next:
            # Nothing is under way: a window has opened, or a probe of it was answered.
            if self.edge > self.next:
                self._alarm.back_off = 0
            self._push(now)

    def _digest(
        self, now: float, acknowledged: int, blocks: Blocks, duplicate: bool, echo: float
    ) -> None:
        board = self.board
        recovery = self.recovery
        gain = board.take(acknowledged, blocks)
        advanced = acknowledged > self.first
        if advanced:
            self.first = acknowledged
            self.buffer.release(gain.released)
        if gain.delivered:
            self._measure(gain, now, echo, advanced)
        if duplicate:
            recovery.losses.needless(acknowledged, self.next)
        if duplicate or blocks:
            recovery.doubted()
        if recovery.probe_end >= 0:
            recovery.judge_probe(now, acknowledged, advanced or bool(blocks), duplicate)
        if advanced:
            recovery.progress(acknowledged, echo)
        lost = board.lost
        self._alarm.doubt = 0.0
        if board.sacked or gain.ambiguous or recovery.state != OPEN:
            self._alarm.doubt = recovery.find(now, self.next)
        if not recovery.hold(len(gain.delivered), advanced and board.lost <= lost) and advanced:
            self._grow(len(gain.delivered), now)
        before = self.next
        self._transmit(now)
        self._watch(now, advanced, self.next > before)

    def _measure(self, gain: Gain, now: float, echo: float, advanced: bool) -> None:
        """Round trip of the segment that waited longest; never of an ambiguous one (Karn)."""
        first = last = 0.0
        for sent in gain.delivered:
            self.recovery.losses.delivered(sent, now, echo)
            if not sent.repeated and (sent.sacked or not gain.ambiguous):
                last = now - sent.sent_at
                first = first or last
        if not first and advanced:
            # All were sent more than once; the echoed time stamp tells which sending arrived.
            first = last = now - echo
        if first:
            self._alarm.back_off = 0  # RFC 6298, section 5: not before there is a new sample
            self.times.sample(first, self.first, self.next)
            self.times.shortest(last)
            if self.window.window < self.window.threshold:
                ends = self._hystart.ends(
                    self.window.window,
                    last,
                    self.times.minimum,
                    acknowledged=self.first,
                    sent=self.next,
                )
                if ends and self._options.hystart:
                    self.window.threshold = self.window.window

    def _grow(self, delivered: int, now: float) -> None:
        """Open the congestion window, if it was in use."""
        # In slow start Linux counts a window as used up to twice what has been under way.
        slow_start = self.window.window < self.window.threshold
        if self._window_used or (slow_start and self.window.window < 2 * self._most_out):
            shortest = self.times.minimum
            self.window.grow(delivered, now, shortest if shortest < inf else 0.0)
        else:
            self.window.rests(now)

    # Sending

    def _push(self, now: float) -> None:
        """Send what may leave, and set the alarm for it."""
        before = self.next
        self._transmit(now)
        if self.next > before or not self.board.queue:
            self._watch(now, False, self.next > before)

    def _transmit(self, now: float) -> None:
        """Send what the windows allow: first what is lost, then what is new."""
        if self.board.lost:
            self._repeat_lost(now)
        if self.total == self.next:
            return
        room = int(self.window.window) - self.board.in_flight
        mss = self._options.mss
        edge = self.edge + (self.end_mark < inf)  # the end itself takes no room
        while room > 0 and self.next < self.total:
            end = min(self.next + mss, self.total)
            if end > edge or self._gathers(end):
                break
            self._send(end, now)
            room -= 1
        # Whether the congestion window was filled within the last round trip.
        used = room <= 0
        out = len(self.board.queue)
        fuller = not self._window_used and out > self._most_out
        if used or fuller or self.first >= self._use_round:
            self._window_used = used
            self._most_out = out
            self._use_round = self.next

    def _gathers(self, end: int) -> bool:
        """Return True if a small segment waits for more, as without TCP_NODELAY; not the last."""
        if self._nodelay or end - self.next >= self._options.mss or end >= self.end_mark:
            return False
        return self._small_end > self.first

    def _send(self, end: int, now: float) -> None:
        start = self.next
        self.next = end
        if end - start < self._options.mss:
            self._small_end = end
        charge = self.buffer.depart(end - start)
        sent = SentSegment(start, end, now, charge, pushes=not self.buffer.is_cut)
        self.board.queue.append(sent)
        self._leave(sent, now)

    def _repeat_lost(self, now: float) -> None:
        queue = self.board.queue
        index = 0
        room = int(self.window.window) - self.board.in_flight
        while index < len(queue) and room > 0:
            if queue[index].lost and not queue[index].resent:
                self._repeat(index, now)
                room -= 1
            index += 1

    def _repeat(self, index: int, now: float, probes: bool = False) -> None:
        sent = self.board.queue[index]
        if self._options.collapse:
            self.buffer.release(self.board.merge(index, self._options.mss))
        self.board.repeat(sent, now, probes)
        if self.recovery.state != OPEN:
            self.recovery.repeated(now)
        self.retransmitted += 1
        if index == 0:
            self._alarm.delay_timeout(now)
        self._leave(sent, now)

    def _leave(self, sent: SentSegment, now: float) -> None:
        self.recovery.sent()
        self._last_sent = now
        self._emit(sent.start, sent.end, now, sent.pushes)

    # Timers

    def _watch(self, now: float, advanced: bool, fresh: bool) -> None:
        if self.board.queue:
            quiet = self.recovery.state == OPEN and not self.board.sacked
            self._alarm.watch(now, self.board, advanced, fresh, quiet and self._options.tail_probe)
        elif self.next < self.total:
            self._alarm.watch_window(now)
        else:
            self._alarm.stop()

    def _ring(self) -> None:
        now = self._clock.now
        kind = self._alarm.kind
        if kind == REORDER:
            self._alarm.doubt = self.recovery.find(now, self.next)
            self.recovery.hold(0, False)
            before = self.next
            self._transmit(now)
            self._watch(now, False, self.next > before)
        elif kind == PROBE:
            self._probe(now)
        elif self._unanswered >= self._options.retries:
            self._give_up()
        else:
            self._unanswered += 1
            self._alarm.back_off += 1
            self._probe_window(now) if kind == WINDOW else self._time_out(now)

    def _probe(self, now: float) -> None:
        """Send something new, or the last segment again, to provoke an acknowledgement."""
        if self.recovery.probe_end >= 0:
            self._alarm.fall_back(now, self.board)  # one probe at a time
            return
        self.tail_probes += 1
        end = min(self.next + self._options.mss, self.total)
        fresh = self.next < end <= self.edge
        if fresh:
            self._send(end, now)
        else:
            self._repeat(len(self.board.queue) - 1, now, probes=True)
        self.recovery.probed(self.next, not fresh)
        self._alarm.restart(now)

    def _time_out(self, now: float) -> None:
        """Time out by RFC 6298, rules 5.4 to 5.6."""
        self.timeouts += 1
        self._alarm.doubt = 0.0
        self.recovery.time_out(now, self.first, self.next)
        self._repeat(0, now)
        self._alarm.restart(now)

    def _probe_window(self, now: float) -> None:
        if self.edge > self.next:
            self._send(min(self.edge, self.total), now)
        else:
            self._emit(-1, -1, now, False)
        self._watch(now, False, bool(self.board.queue))
