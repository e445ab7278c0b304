"""Datagrams as often as a law of rate lets them: the newest message waits, the others are gone.

A message is cut into datagrams of at most one packet. Those of a message that has begun are sent
to the end, because a part of a picture shows nothing; what comes meanwhile replaces what waits.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence
from typing import NamedTuple

from dva_sim.clock import Clock
from dva_sim.network.link import Link
from dva_sim.network.transports.feedback import Echo, Echoes, Feedback
from dva_sim.network.transports.laws import Law
from dva_sim.network.transports.messages import Deliver, Message
from dva_sim.network.transports.pacing import Pace

PACKET = 1500  # largest IP packet of Ethernet: RFC 894 [B]
IP_UDP = 28  # headers: RFC 791 and 768 [B]
SLACK = 1e-6  # the clock's grain [s]


class Part(NamedTuple):
    """A piece of a message: which of how many, and its size [B]."""

    message: Message
    place: int
    pieces: int
    size: int


def parts_of(message: Message, header: int) -> list[Part]:
    """The datagrams that a message is cut into, all full but the last.

    Args:
        message: What is sent.
        header: Of the transport, in each datagram [B].
    """
    room = PACKET - IP_UDP - header
    count = max(1, math.ceil(message.size / room))
    sizes = [room] * (count - 1) + [message.size - room * (count - 1)]
    return [Part(message, place, count, size) for place, size in enumerate(sizes)]


class Assembly:
    """Puts parts together again.

    Args:
        deliver: Told of every message once it is whole.
    """

    def __init__(self, deliver: Deliver) -> None:
        self._deliver = deliver
        self._missing: dict[int, set[int]] = {}

    def add(self, part: Part) -> None:
        """A part has arrived, perhaps once more."""
        number = part.message.number
        missing = self._missing.setdefault(number, set(range(part.pieces)))
        if part.place in missing:
            missing.remove(part.place)
            if not missing:
                self._deliver(number)


class Sender:
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
        law: Law,
        deliver: Deliver,
        repeats_crucial: bool = False,
    ) -> None:
        self._clock, self._link, self._header = clock, link, header
        self._repeats, self._assembly = repeats_crucial, Assembly(deliver)
        self._feedback, self._echoes = Feedback(), Echoes()
        self._pace = Pace(law, self._feedback)
        self._waiting: Message | None = None
        self._parts: deque[Part] = deque()
        self._crucial: deque[Part] = deque()
        self._to_repeat: dict[int, Part] = {}
        self._number, self._sent_at = 0, -math.inf
        self._wake_at = self._watch_at = math.inf
        self.ride: Callable[[], Sequence[Echo]] = tuple
        self.on_arrival: Callable[[Sequence[Echo]], object] = lambda echoes: None

    def offer(self, message: Message) -> None:
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
        return self._echoes.at(self._clock.now)

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

    def _send(self, now: float, part: Part) -> int:
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

    def _arrive(self, number: int, part: Part, riding: Sequence[Echo]) -> None:
        """At the other end."""
        self._echoes.saw(self._clock.now, number)
        self._assembly.add(part)
        self.on_arrival(riding)
