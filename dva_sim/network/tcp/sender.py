"""The sending half of an end: what may leave, when, and what is done about losses.

References:
    RFC 5681 and 6298 (windows and time-outs), RFC 8985 (RACK, tail-loss probe), RFC 6937
    (rate reduction), RFC 3522 (needless recoveries told by time stamps), RFC 9293,
    section 3.8.6.1 (probing a closed window).
"""

from __future__ import annotations

from collections.abc import Callable
from math import inf

from dva_sim.clock import Clock
from dva_sim.network.tcp.congestion import HyStart, RateReduction, make_window
from dva_sim.network.tcp.losses import ByCount, ByTime
from dva_sim.network.tcp.memory import SendBuffer
from dva_sim.network.tcp.options import TcpOptions
from dva_sim.network.tcp.round_trip import RoundTrip
from dva_sim.network.tcp.scoreboard import Gain, Scoreboard, Sent
from dva_sim.network.tcp.timer import Timer

OPEN, RECOVERY, LOSS = "open", "recovery", "loss"
TIMEOUT, PROBE, REORDER, WINDOW = "timeout", "probe", "reorder", "window"

Emit = Callable[[int, int, float], object]


class Sender:
    """Bytes in, segments out.

    Args:
        clock: The run's clock.
        options: Of this end.
        emit: Sends one segment: first byte, byte after the last, now [s]. A first byte
            of -1 asks for an acknowledgement.
        give_up: Called when the other end has not answered for too long.

    Attributes:
        total: Bytes written so far.
        next: First byte not sent yet.
        first: First byte not acknowledged.
        edge: First byte that the receive window does not take.
        end_mark: Where the stream ends, once it is finished.
        segments: Segments with data sent so far, repetitions included.
        retransmitted: Repetitions.
        timeouts: Retransmission time-outs.
        tail_probes: Tail-loss probes.
    """

    def __init__(
        self, clock: Clock, options: TcpOptions, emit: Emit, give_up: Callable[[], object]
    ) -> None:
        self._clock, self._options, self._emit, self._give_up = clock, options, emit, give_up
        self.total = self.next = self.first = self.edge = 0
        self.end_mark: float = inf
        self.segments = self.retransmitted = self.timeouts = self.tail_probes = 0
        self.buffer = SendBuffer(options.send_buffer, options.initial_window)
        self.board = Scoreboard()
        self.times = RoundTrip(options)
        self.window = make_window(options)
        self._losses = ByTime(self.times) if options.rack else ByCount(self.times)
        self._hystart = HyStart()
        self._state, self._recover_to = OPEN, 0
        self._before = self.window.window, self.window.threshold
        self._first_repeat: float = inf
        self._reduction = RateReduction(0.0, 0)
        self._timer, self._kind = Timer(clock, self._ring, options.tick), TIMEOUT
        self._timeout_at = self._doubt_until = 0.0
        self._back_off = self._unanswered = 0
        self._probe_end, self._probe_repeats = -1, False
        self._last_sent = 0.0
        self._window_used, self._most_out, self._use_round = False, 0, 0

    def established(self, round_trip: float | None, repeated: int, edge: int) -> None:
        """The opening is over: its round trip [s] if one was measured, its repetitions."""
        self.edge = edge
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

    def finish(self) -> None:
        """Nothing more will be written; the end itself counts as a byte."""
        self.end_mark = self.total
        self.total += 1
        self._push(self._clock.now)

    def stop(self) -> None:
        """Forget what is under way."""
        self._timer.stop()
        self.total = self.next
        self.board = Scoreboard()

    # Acknowledgements

    def acknowledge(
        self,
        now: float,
        acknowledged: int,
        edge: int,
        blocks: tuple[tuple[int, int], ...],
        duplicate: bool,
        echo: float,
    ) -> None:
        """Take one acknowledgement, and send what it allows.

        Args:
            now: When it arrives [s].
            acknowledged: First byte that is missing at the other end.
            edge: First byte that does not fit there.
            blocks: Bytes received beyond, from and to.
            duplicate: It was caused by a segment that had arrived before.
            echo: Time stamp of the segment that caused it [s].
        """
        self._unanswered = 0
        self.edge = max(self.edge, edge)
        advanced = acknowledged > self.first
        if self.board.queue and (advanced or blocks or duplicate or self._probe_end >= 0):
            self._digest(now, acknowledged, blocks, duplicate, echo)
        elif self.total > self.next:
            self._back_off = 0 if self.edge > self.next else self._back_off
            self._push(now)

    def _digest(
        self,
        now: float,
        acknowledged: int,
        blocks: tuple[tuple[int, int], ...],
        duplicate: bool,
        echo: float,
    ) -> None:
        gain, advanced = self.board.take(acknowledged, blocks), acknowledged > self.first
        if advanced:
            self.first, self._back_off = acknowledged, 0
            self.buffer.release(gain.released)
        if gain.delivered:
            self._measure(gain, now, echo, advanced)
        if duplicate:
            self._losses.needless(acknowledged, self.next)
        if self._probe_end >= 0:
            self._judge_probe(now, acknowledged, advanced, bool(blocks), duplicate)
        if self._state != OPEN and advanced:
            self._progress(now, acknowledged, echo)
        lost = self.board.lost
        self._doubt_until = 0.0
        if self.board.sacked or gain.ambiguous or self._state != OPEN:
            self._find_losses(now)
        self._adapt(now, len(gain.delivered), advanced, self.board.lost > lost)
        self._transmit(now)
        self._arm(now, advanced)

    def _measure(self, gain: Gain, now: float, echo: float, advanced: bool) -> None:
        """Round trip of the segment that waited longest; never of an ambiguous one (Karn)."""
        first = last = 0.0
        for sent in gain.delivered:
            self._losses.delivered(sent, now, echo)
            if not sent.repeated and (sent.sacked or not gain.ambiguous):
                last = now - sent.sent_at
                first = first or last
        if not first and advanced:
            first = last = now - echo
        if first:
            self.times.sample(first, self.first, self.next)
            self.times.shortest(last)
            if self.window.threshold > self.window.window >= HyStart.LOW_WINDOW:
                self._look_for_queue(last)

    def _look_for_queue(self, round_trip: float) -> None:
        ends = self._hystart.ends(round_trip, self.times.minimum, self.first, self.next)
        if ends and self._options.hystart:
            self.window.threshold = self.window.window

    def _judge_probe(
        self, now: float, acknowledged: int, advanced: bool, selective: bool, duplicate: bool
    ) -> None:
        """Did the probe mend a loss by itself? RFC 8985, section 7.4."""
        if acknowledged < self._probe_end:
            return
        if self._probe_repeats and not duplicate and acknowledged > self._probe_end:
            if self._state == OPEN and self._options.congestion_window:
                self.window.window = min(self.window.window, self.window.reduce(now))
        elif self._probe_repeats and not duplicate and (advanced or selective):
            return  # either sending of it may have arrived
        self._probe_end = -1

    def _progress(self, now: float, acknowledged: int, echo: float) -> None:
        """The left edge moved during a recovery: is it over, or was it needless?"""
        over = acknowledged >= self._recover_to
        needless = self._options.undo and echo < self._first_repeat
        if needless and (over or self._state == LOSS or not self.board.resent):
            window, threshold = self._before
            self.window.window = max(self.window.window, window)
            self.window.threshold = max(self.window.threshold, threshold)
            self.board.forgive()
            self._state = OPEN
        elif over:
            if self._state == RECOVERY and self._options.congestion_window:
                self.window.window = self.window.threshold
            self._losses.recovered()
            self._state = OPEN

    def _find_losses(self, now: float) -> None:
        wait = self._losses.detect(self.board, now, self._state != OPEN)
        self._doubt_until = now + wait if wait else 0.0
        if self.board.lost and self._state == OPEN:
            in_flight = len(self.board.queue)
            self._begin(RECOVERY)
            self._reduction = RateReduction(self.window.reduce(now), in_flight)

    def _begin(self, state: str) -> None:
        self._before = self.window.window, self.window.threshold
        self._state, self._recover_to = state, self.next
        self._first_repeat, self._probe_end = inf, -1

    def _adapt(self, now: float, delivered: int, advanced: bool, worse: bool) -> None:
        """Move the congestion window."""
        if self._state == RECOVERY and self._options.congestion_window:
            in_flight = self.board.in_flight
            allowed = self._reduction.allows(delivered, in_flight, advanced and not worse)
            self.window.window = float(in_flight + allowed)
        elif advanced and self._state != RECOVERY:
            slow_start = self.window.window < self.window.threshold
            if self._window_used or (slow_start and self.window.window < 2 * self._most_out):
                self.window.grow(delivered, now, self.times.minimum)
            else:
                self.window.rests(now)

    # Sending

    def _push(self, now: float) -> None:
        """Send what may leave of what was written."""
        before = self.next
        self._transmit(now)
        if self.next > before or not self.board.queue:
            self._arm(now, False)

    def _transmit(self, now: float) -> None:
        """Send what the windows allow: first what is lost, then what is new."""
        if self._state != OPEN and self.board.lost:
            self._repeat_lost(now)
        if self.total == self.next:
            return
        room, mss = int(self.window.window) - self.board.in_flight, self._options.mss
        edge = self.edge + (self.end_mark < inf)  # the end itself takes no room
        while room > 0 and self.next < self.total:
            end = min(self.next + mss, self.total)
            if end > edge:
                break
            self._send(end, now)
            room -= 1
        self._note_use(room <= 0)

    def _note_use(self, used: bool) -> None:
        """Whether the congestion window was filled within the last round trip."""
        out = len(self.board.queue)
        fuller = not self._window_used and out > self._most_out
        if used or fuller or self.first >= self._use_round:
            self._window_used, self._most_out, self._use_round = used, out, self.next

    def _send(self, end: int, now: float) -> None:
        start, self.next = self.next, end
        charge = self.buffer.depart(end - start, end == self.total)
        self.board.queue.append(Sent(start, end, now, charge))
        self.segments += 1
        self._reduction.sent += 1
        self._last_sent = now
        self._emit(start, end, now)

    def _repeat_lost(self, now: float) -> None:
        queue, index = self.board.queue, 0
        room = int(self.window.window) - self.board.in_flight
        while index < len(queue) and room > 0:
            if queue[index].lost and not queue[index].resent:
                self._repeat(index, now)
                room -= 1
            index += 1

    def _repeat(self, index: int, now: float) -> None:
        sent = self.board.queue[index]
        if self._options.collapse:
            self.buffer.release(self.board.merge(index, self._options.mss))
        self.board.repeat(sent, now)
        self.segments += 1
        self.retransmitted += 1
        self._reduction.sent += 1
        self._first_repeat = min(self._first_repeat, now)
        self._last_sent = now
        if index == 0:
            self._timeout_at = now + self._timeout()
        self._emit(sent.start, sent.end, now)

    # Timers

    def _timeout(self) -> float:
        return min(self.times.timeout * 2.0**self._back_off, self._options.max_rto)

    def _arm(self, now: float, advanced: bool) -> None:
        """Set the one timer to what comes first: a doubt resolved, a probe, a time-out."""
        if not self.board.queue:
            self._watch_window(now)
            return
        if advanced:
            self._timeout_at = now + self._timeout()
        elif self._kind != TIMEOUT or self._timer.deadline == inf:
            self._timeout_at = self.board.queue[0].sent_at + self._timeout()
        self._kind, at = TIMEOUT, self._timeout_at
        if self._doubt_until and self._doubt_until < at:
            self._kind, at = REORDER, self._doubt_until
        elif self._may_probe():
            self._kind, at = PROBE, min(at, now + self._probe_time())
        self._timer.set(max(at, now))

    def _may_probe(self) -> bool:
        quiet = self._state == OPEN and not self.board.sacked and self._probe_end < 0
        return quiet and self._options.tail_probe

    def _probe_time(self) -> float:
        """RFC 8985, section 7.2: a single segment may meet a delayed acknowledgement."""
        if not self.times.smoothed:
            return self._options.first_rto
        alone = len(self.board.queue) == 1
        return 2 * self.times.smoothed + (self._options.min_rto if alone else 0.0)

    def _watch_window(self, now: float) -> None:
        if self.next == self.total:
            self._kind = TIMEOUT
            self._timer.stop()
        elif self._kind != WINDOW or self._timer.deadline == inf:
            self._kind = WINDOW
            self._timer.set(now + self._timeout())

    def _ring(self) -> None:
        now = self._clock.now
        if self._kind == REORDER:
            self._doubt_over(now)
        elif self._kind == PROBE:
            self._probe(now)
        elif self._unanswered >= self._options.retries:
            self._give_up()
        else:
            self._unanswered += 1
            self._back_off += 1
            if self._kind == WINDOW:
                self._probe_window(now)
            else:
                self._time_out(now)

    def _doubt_over(self, now: float) -> None:
        lost = self.board.lost
        self._find_losses(now)
        self._adapt(now, 0, False, self.board.lost > lost)
        self._transmit(now)
        self._arm(now, False)

    def _probe(self, now: float) -> None:
        """Send something new, or the last segment again, to provoke an acknowledgement."""
        self.tail_probes += 1
        end = min(self.next + self._options.mss, self.total)
        self._probe_repeats = not self.next < end <= self.edge
        if self._probe_repeats:
            self._repeat(len(self.board.queue) - 1, now)
        else:
            self._send(end, now)
        self._probe_end = self.next
        self._kind, self._timeout_at = TIMEOUT, now + self._timeout()
        self._timer.set(self._timeout_at)

    def _time_out(self, now: float) -> None:
        """RFC 6298, rules 5.4 to 5.6; RFC 5681, equation 4."""
        self.timeouts += 1
        if self._state == OPEN or self.first >= self._recover_to:
            self._begin(LOSS)
            self.window.reduce(now)
        self._state, self._recover_to = LOSS, self.next
        self._losses.on_timeout(self.board, now)
        if self._options.congestion_window:
            self.window.window = float(self.board.in_flight + 1)
        self._doubt_until = 0.0
        self._repeat(0, now)
        self._kind, self._timeout_at = TIMEOUT, now + self._timeout()
        self._timer.set(self._timeout_at)

    def _probe_window(self, now: float) -> None:
        if self.edge > self.next:
            self._send(min(self.edge, self.total), now)
            self._arm(now, False)
        else:
            self._emit(-1, -1, now)
            self._timer.set(now + self._timeout())
