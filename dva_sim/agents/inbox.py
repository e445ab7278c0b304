"""A robot's computer: one message at a time, each taking its processing time."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import NamedTuple

from dva_sim.clock import Clock
from dva_sim.network.patterns import Answer

LIMIT = 1000  # ZeroMQ's default high-water mark: a full subscriber keeps the oldest


class Letter(NamedTuple):
    """A message that has arrived: its bytes, when [s], and how to answer it."""

    data: bytes
    arrived: float
    answer: Answer | None


class Inbox:
    """First come, first served within a class; emergencies before control before commands.

    Args:
        clock: The run's clock.
        processing: Time that one message takes [s].
        handle: Takes each letter when its processing is done.
        latest_wins: Keep only the newest waiting command, as a subscriber that drains its
            socket before it works does.
    """

    def __init__(
        self,
        clock: Clock,
        processing: float,
        handle: Callable[[Letter], object],
        latest_wins: bool,
    ) -> None:
        self._clock, self._processing, self._handle = clock, processing, handle
        self._latest_wins = latest_wins
        self._emergencies: deque[Letter] = deque()
        self._control: deque[Letter] = deque()
        self._commands: deque[Letter] = deque()
        self._busy = False
        self.longest = self.superseded = self.overflowed = 0

    def emergency(self, data: bytes, answer: Answer) -> None:
        """An emergency has arrived: it overtakes everything that waits."""
        self._put(self._emergencies, Letter(data, self._clock.now, answer))

    def control(self, data: bytes, answer: Answer) -> None:
        """A request on the acknowledged channel has arrived."""
        self._put(self._control, Letter(data, self._clock.now, answer))

    def command(self, data: bytes, answer: Answer | None = None) -> None:
        """A command has arrived, with somebody waiting for an answer or not."""
        if self._latest_wins and self._commands:
            self.superseded += len(self._commands)
            self._commands.clear()
        self._put(self._commands, Letter(data, self._clock.now, answer))

    def forget_commands(self) -> None:
        """Drop the commands that wait: their subscription is closed."""
        self._commands.clear()

    def _put(self, queue: deque[Letter], letter: Letter) -> None:
        if len(queue) >= LIMIT:
            self.overflowed += 1
            return
        queue.append(letter)
        self.longest = max(self.longest, len(queue))
        if not self._busy:
            self._work()

    def _work(self) -> None:
        for queue in (self._emergencies, self._control, self._commands):
            if queue:
                self._busy = True
                self._clock.call_after(self._processing, self._done, queue.popleft())
                return
        self._busy = False

    def _done(self, letter: Letter) -> None:
        self._handle(letter)
        self._work()
