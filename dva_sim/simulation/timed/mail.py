"""Messages between the core of the DVA and everybody in a shift: at once, and in order."""

from __future__ import annotations

import math
from collections import Counter, deque
from collections.abc import Callable
from typing import Protocol

from dva_sim.core.dva import Dva
from dva_sim.core.sessions import Send
from dva_sim.kernel.clock import Clock
from dva_sim.protocol import messages as m

TICK = 1.0  # interval at which the core checks deadlines by itself on a network [s]
DVA = "02:00:00:00:00:01"
NOON = "12:00:00"  # time of day in messages, which nobody reads
CLOCK_STEP_S = 1e-6  # resolution of the clock: no deadline is checked twice at one time [s]


class Taker(Protocol):
    """Receiver of the DVA's messages."""

    def take(self, body: m.Body) -> bool:
        """Hear the DVA; False declines."""


class Mail:
    """Carries messages to the core and from it, one after the other, at once.

    Messages to a busy core wait. The core looks at deadlines
    exactly when they are due. Where one decision can make the next possible, it also looks again
    a second after it has sent something, as it would on its network, until nothing is left to say.

    Args:
        core: The DVA's.
        clock: Clock of the run.
        changed: Called when the core has done something, with whom the message was about.
        moved: Callback before each decision of the core, to update positions.
        attentive: True if one decision can make the next possible.

    Attributes:
        takers: Receivers of messages, by id.
        sent: Number of messages that the core took.
        refused: Answers other than OK, by text.
    """

    def __init__(
        self,
        core: Dva,
        clock: Clock,
        changed: Callable[[object], None],
        moved: Callable[[], None],
        attentive: bool,
    ) -> None:
        self.core = core
        self._clock = clock
        self._changed = changed
        self._moved = moved
        self.takers: dict[str, Taker] = {}
        self.sent = 0
        self.refused: Counter[str] = Counter()
        self._waiting: deque[tuple[str, m.Body, object]] = deque()
        self._numbers: dict[str, int] = {}
        self._due = self._again = math.inf
        self._attentive = attentive

    def say(self, source: str, body: m.Body, about: object = None) -> None:
        """Put a message to the core into the box; `carry` brings it."""
        self._waiting.append((source, body, about))

    def publish(self, source: str, body: m.Body) -> None:
        """Publish a message to the core, which does not answer it."""
        self.core.note(self._message(source, body), self._clock.now)

    def carry(self) -> None:
        """Deliver all messages and the answers to them, until none is left."""
        waiting = self._waiting
        core = self.core
        now = self._clock.now
        while waiting:
            source, body, about = waiting.popleft()
            self._moved()
            reply, sends = core.handle(self._message(source, body), now)
            self.sent += 1
            if reply.code != m.OK:
                self.refused[f"{type(body).__name__}: {m.CODE_NAMES[reply.code]}"] += 1
            self._changed(about)
            if sends:
                self._deliver(sends)
        self._look_again()

    def tick(self) -> None:
        """Let the core check its deadlines."""
        self._moved()
        sends = self.core.tick(self._clock.now)
        self._changed(None)
        self._deliver(sends)
        self.carry()

    def _message(self, source: str, body: m.Body) -> m.Message:
        number = self._numbers[source] = self._numbers.get(source, 0) + 1
        return m.Message(DVA, number, source, NOON, 0, body)

    def _deliver(self, sends: list[Send]) -> None:
        """Deliver the core's messages, and report the outcome to it."""
        queue = deque(sends)
        now = self._clock.now
        if self._attentive and sends:
            self._again = now + TICK
        while queue:
            send = queue.popleft()
            taker = self.takers.get(send.to)
            taken = taker is not None and taker.take(send.body)
            answer = self.core.delivered if taken else self.core.undelivered
            queue.extend(answer(send, now))
        self._changed(None)

    def _look_again(self) -> None:
        """Schedule a tick at the next deadline."""
        due = min(self.core.next_deadline(), self._again)
        if due < self._due:
            self._due = max(due, self._clock.now + CLOCK_STEP_S)
            self._clock.call_at(self._due, self._on_due, self._due)

    def _on_due(self, due: float) -> None:
        if due != self._due:
            return  # an earlier one was found meanwhile, and looks for the next
        self._due = math.inf
        now = self._clock.now + CLOCK_STEP_S
        if self.core.next_deadline() <= now or self._again <= now:
            self._again = math.inf
            self.tick()
        else:
            self._look_again()
