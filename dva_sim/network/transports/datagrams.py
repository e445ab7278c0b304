"""What a sender of datagrams learns from acknowledgements: round trips, losses, when to give up.

Each datagram is acknowledged by its number, and an acknowledgement repeats those before it, so
that a lost one costs nothing. A datagram is lost when three later ones were acknowledged (the
threshold of RFC 5681), or when nothing was heard for as long as RFC 6298 says.

Tells a law of rate what happened: once per round trip, and once for all losses of one.

Datagrams as often as a law of rate lets them: the newest message waits, the others are gone.

A message is cut into datagrams of at most one packet. Those of a message that has begun are sent
to the end, because a part of a picture shows nothing; what comes meanwhile replaces what waits.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

from dva_sim.kernel.clock import Clock
from dva_sim.network.link import Link
from dva_sim.network.transports.config import Deliver, TransportMessage
from dva_sim.network.transports.rate_control import RateLaw

REORDERED = 3  # later ones acknowledged, until one counts as lost: RFC 5681
FIRST_TIMEOUT, LEAST_TIMEOUT, LONGEST_TIMEOUT = 1.0, 1.0, 60.0  # [s]: RFC 6298
REPEATED = 32  # datagrams that an acknowledgement tells of: the bits of a word; assumed
Echo = tuple[int, float]  # a datagram's number, and since when it had been there [s]


class RoundTrips:
    """Smoothed round trip and time-out.

    Attributes:
        smoothed: [s], or None before the first sample.

    References:
        RFC 6298.
    """

    def __init__(self) -> None:
        self.smoothed: float | None = None
        self._variation, self._backoff = 0.0, 1.0

    @property
    def timeout(self) -> float:
        """How long to wait for an answer before giving it up [s]."""
        if self.smoothed is None:
            return min(FIRST_TIMEOUT * self._backoff, LONGEST_TIMEOUT)
        plain = max(self.smoothed + 4.0 * self._variation, LEAST_TIMEOUT)
        return min(plain * self._backoff, LONGEST_TIMEOUT)

    def add(self, sample: float) -> None:
        """Learn from a round trip [s]."""
        if self.smoothed is None:
            self.smoothed, self._variation = sample, 0.5 * sample
        else:
            self._variation += 0.25 * (abs(sample - self.smoothed) - self._variation)
            self.smoothed += 0.125 * (sample - self.smoothed)
        self._backoff = 1.0

    def back_off(self) -> None:
        """A time-out has passed: wait twice as long the next time."""
        self._backoff *= 2.0


class Feedback:
    """What was sent and is not known to have arrived.

    Attributes:
        round_trips: What they were like.
        lost: How many are taken for lost.
        samples: Round trips since somebody emptied the list [s].
    """

    def __init__(self) -> None:
        self.round_trips, self.lost = RoundTrips(), 0
        self._pending: dict[int, float] = {}  # in order of sending
        self._passed_by: dict[int, int] = {}
        self._heard = 0.0
        self.samples: list[float] = []

    @property
    def deadline(self) -> float:
        """When all that is pending is given up, unless something is heard [s]."""
        if not self._pending:
            return math.inf
        oldest = next(iter(self._pending.values()))
        return max(oldest, self._heard) + self.round_trips.timeout

    def sent(self, now: float, number: int) -> None:
        """Datagram `number` was sent at `now` [s]."""
        self._pending[number] = now

    def acknowledged(self, now: float, echoes: Sequence[Echo]) -> list[int]:
        """An acknowledgement has come.

        Args:
            now: [s]
            echoes: Numbers of datagrams, oldest first, each with how long the other side had it
                before it answered [s].

        Returns:
            Datagrams that are lost, as this one shows.
        """
        gone: list[int] = []
        for number, held in echoes:
            sent = self._pending.pop(number, None)
            if sent is not None:
                self._heard = now
                self.samples.append(now - sent - held)
                self.round_trips.add(self.samples[-1])
                gone += self._passed(number)
        return gone

    def _passed(self, number: int) -> list[int]:
        """A later datagram than some was acknowledged: those that this shows to be lost."""
        earlier = [n for n in self._pending if n < number]
        for n in earlier:
            self._passed_by[n] = self._passed_by.get(n, 0) + 1
        return self._drop(n for n in earlier if self._passed_by[n] >= REORDERED)

    def give_up(self) -> list[int]:
        """The time-out has passed: everything pending is lost."""
        self.round_trips.back_off()
        return self._drop(self._pending)

    def _drop(self, numbers: Iterable[int]) -> list[int]:
        gone = list(numbers)
        for number in gone:
            del self._pending[number]
            self._passed_by.pop(number, None)
        self.lost += len(gone)
        return gone


FIRST_FLIGHT = 10  # datagrams before the first answer: the initial window of RFC 6928


class Pace:
    """A law, and the round trips that it goes by.

    Args:
        law: How often a datagram may be sent.
        feedback: Where round trips come from.

    Attributes:
        held: Whether the gap has made something wait since the round trip began.
    """

    def __init__(self, law: RateLaw, feedback: Feedback) -> None:
        self._law, self._feedback = law, feedback
        self._begun, self._unanswered, self.held = False, 0, False
        self._since, self._deaf_until = 0.0, 0.0

    @property
    def gap(self) -> float:
        """Between two datagrams [s]; unanswered, a first flight, and then one per time-out."""
        if self._begun:
            return self._law.gap
        return self._feedback.round_trips.timeout if self._unanswered >= FIRST_FLIGHT else 0.0

    def sent(self) -> None:
        """A datagram was sent."""
        self._unanswered += 1

    def heard(self, now: float) -> None:
        """An acknowledgement has come at `now` [s]; perhaps a round trip has passed."""
        samples, smoothed = self._feedback.samples, self._feedback.round_trips.smoothed
        if not samples or smoothed is None:
            return
        if not self._begun:
            self._begun, self._since = True, now
            self._law.begin(samples[0])
        elif now - self._since >= smoothed:
            self._law.passed(sum(samples) / len(samples), self.held)
            self._restart(now)

    def lost(self, now: float) -> None:
        """Something is lost, as is known at `now` [s]."""
        if self._begun and now >= self._deaf_until:
            self._law.lost()
            self._deaf_until = now + (self._feedback.round_trips.smoothed or 0.0)
            self._restart(now)

    def _restart(self, now: float) -> None:
        self._feedback.samples.clear()
        self._since, self.held = now, False


PACKET = 1500  # largest IP packet of Ethernet: RFC 894 [B]
IP_UDP = 28  # headers: RFC 791 and 768 [B]
SLACK = 1e-6  # the clock's grain [s]


class MessagePart(NamedTuple):
    """A piece of a message: which of how many, and its size [B]."""

    message: TransportMessage
    place: int
    pieces: int
    size: int


def parts_of(message: TransportMessage, header: int) -> list[MessagePart]:
    """The datagrams that a message is cut into, all full but the last.

    Args:
        message: What is sent.
        header: Of the transport, in each datagram [B].
    """
    room = PACKET - IP_UDP - header
    count = max(1, math.ceil(message.size / room))
    sizes = [room] * (count - 1) + [message.size - room * (count - 1)]
    return [MessagePart(message, place, count, size) for place, size in enumerate(sizes)]


class Assembly:
    """Puts parts together again.

    Args:
        deliver: Told of every message once it is whole.
    """

    def __init__(self, deliver: Deliver) -> None:
        self._deliver = deliver
        self._missing: dict[int, set[int]] = {}

    def add(self, part: MessagePart) -> None:
        """A part has arrived, perhaps once more."""
        number = part.message.number
        missing = self._missing.setdefault(number, set(range(part.pieces)))
        if part.place in missing:
            missing.remove(part.place)
            if not missing:
                self._deliver(number)


class DatagramSender:
    """One direction of a session whose rate a law decides, with the receiver at its other end.

    Args:
        clock: Virtual time.
        link: What the datagrams take.
        header: Of the transport, in each datagram [B].
        law: How often.
        deliver: Told of every message at the other end.
        repeats_crucial: Whether crucial messages go at once and again until they have arrived.

    Attributes:
        ride: Gives the acknowledgements, of the other direction, that ride on a datagram.
        on_arrival: Told at the other end of every datagram, with what rode on it.
    """

    def __init__(
        self,
        clock: Clock,
        link: Link,
        header: int,
        law: RateLaw,
        deliver: Deliver,
        repeats_crucial: bool = False,
    ) -> None:
        self._clock, self._link, self._header = clock, link, header
        self._repeats, self._assembly = repeats_crucial, Assembly(deliver)
        self._feedback = Feedback()
        self._seen: deque[Echo] = deque(maxlen=REPEATED)  # what has arrived, and since when
        self._pace = Pace(law, self._feedback)
        self._waiting: TransportMessage | None = None
        self._parts: deque[MessagePart] = deque()
        self._crucial: deque[MessagePart] = deque()
        self._to_repeat: dict[int, MessagePart] = {}
        self._number, self._sent_at = 0, -math.inf
        self._wake_at = self._watch_at = math.inf
        self.ride: Callable[[], Sequence[Echo]] = tuple
        self.on_arrival: Callable[[Sequence[Echo]], object] = lambda echoes: None

    def offer(self, message: TransportMessage) -> None:
        """There is something to send; what has not begun to be sent is replaced by it."""
        if message.crucial and self._repeats:
            self._crucial += parts_of(message, self._header)
        else:
            self._waiting = message
        self._pump()

    def hear(self, echoes: Sequence[Echo]) -> None:
        """The other end tells what it has got."""
        now = self._clock.now
        self._lose(now, self._feedback.acknowledged(now, echoes))
        self._pace.heard(now)
        self._pump()

    def echoes(self) -> Sequence[Echo]:
        """What the receiver at the other end tells now."""
        now = self._clock.now
        return [(number, now - since) for number, since in self._seen]

    def _lose(self, now: float, gone: Sequence[int]) -> None:
        """Datagrams are lost: the law hears of it, and the crucial ones go again."""
        if gone:
            self._crucial += [self._to_repeat.pop(n) for n in gone if n in self._to_repeat]
            self._pace.lost(now)

    def _pump(self) -> None:
        """Send what may be sent now, and come back for the rest."""
        now = self._clock.now
        while self._crucial:
            part = self._crucial.popleft()
            self._to_repeat[self._send(now, part)] = part
        while self._parts or self._waiting is not None:
            ready = self._sent_at + self._pace.gap
            if now < ready - SLACK:
                self._pace.held = True
                self._wake(ready)
                return
            if not self._parts and self._waiting is not None:
                self._parts += parts_of(self._waiting, self._header)
                self._waiting = None
            self._send(now, self._parts.popleft())
            self._pace.sent()
            self._sent_at = now

    def _wake(self, at: float) -> None:
        if at < self._wake_at - SLACK:
            self._wake_at = at
            self._clock.call_at(at, self._woken, at)

    def _woken(self, at: float) -> None:
        if at == self._wake_at:
            self._wake_at = math.inf
            self._pump()

    def _send(self, now: float, part: MessagePart) -> int:
        number, self._number = self._number, self._number + 1
        self._feedback.sent(now, number)
        arrival = self._link.carry(now, part.size + self._header + IP_UDP)
        if arrival is not None:
            self._clock.call_at(arrival, self._arrive, number, part, self.ride())
        self._watch()
        return number

    def _watch(self) -> None:
        """Be there when nothing has been heard for too long."""
        deadline = self._feedback.deadline
        if deadline < math.inf and self._watch_at == math.inf:
            self._watch_at = deadline
            self._clock.call_at(deadline, self._watched)

    def _watched(self) -> None:
        self._watch_at, now = math.inf, self._clock.now
        if now >= self._feedback.deadline - SLACK:
            self._lose(now, self._feedback.give_up())
            self._pump()
        self._watch()

    def _arrive(self, number: int, part: MessagePart, riding: Sequence[Echo]) -> None:
        """At the other end."""
        self._seen.append((number, self._clock.now))
        self._assembly.add(part)
        self.on_arrival(riding)
