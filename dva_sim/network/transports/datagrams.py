"""Datagrams as often as a law of rate lets them: the newest message waits, the others are gone.

Those of a message that has begun are sent to the end, because a part of a picture shows nothing;
what comes meanwhile replaces what waits.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence

from dva_sim.kernel.clock import Clock
from dva_sim.network.link import Link
from dva_sim.network.transports.feedback import REPEATED, Echo, Feedback
from dva_sim.network.transports.interface import Deliver, TransportMessage
from dva_sim.network.transports.message_parts import IP_UDP, Assembly, MessagePart, parts_of
from dva_sim.network.transports.pace import Pace
from dva_sim.network.transports.rate_control import RateLaw

SLACK = 1e-6  # the clock's grain [s]


class DatagramSender:
    """One direction of a session whose rate a law decides, with the receiver at its other end.

    Args:
        clock: Virtual time.
        link: Link that carries the datagrams.
        header: Header of the transport in each datagram [B].
        law: Law that decides the rate.
        deliver: Callback for every message at the other end.
        repeats_crucial: True if crucial messages are sent at once, and again until they have
            arrived.

    Attributes:
        ride: Function that returns the acknowledgements, of the other direction, that ride on a
            datagram.
        on_arrival: Callback at the other end for every datagram, with its feedback.
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
        """Return the feedback of the receiver at the other end."""
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
