"""Real time: the same kernel, with the wall clock for time and sockets for company.

Between two events the kernel waits in the ZeroMQ poller, so that a message is handled as
soon as it arrives. One thread does everything.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Any

import zmq

from dva_sim.kernel.clock import US, Clock

AT_ONCE = 500  # events that are late, before messages have their turn
LONGEST_WAIT = 60_000  # of one poll [ms]


class LiveClock(Clock):
    """A clock that follows the wall clock; see `Clock`.

    Times are seconds since `epoch`, taken from a clock that never steps back.

    Args:
        epoch: The run's start by `time.monotonic` [s]; processes of a machine that share it share
            their time. Default: now.

    Attributes:
        lateness: The longest that an event had to wait [s].
    """

    def __init__(self, epoch: float | None = None) -> None:
        super().__init__()
        elapsed = 0.0 if epoch is None else time.monotonic() - epoch
        self._origin = time.monotonic_ns() // 1000 - round(elapsed * US)
        self._poller = zmq.Poller()
        self._handlers: dict[Any, Callable[[], object]] = {}
        self._running = False
        self.lateness = 0.0
        self._catch_up(math.inf)

    def watch(self, source: Any, handler: Callable[[], object]) -> None:
        """Call `handler()` whenever a socket or file descriptor has something to read."""
        self._handlers[source] = handler
        self._poller.register(source, zmq.POLLIN)

    def unwatch(self, source: Any) -> None:
        """Look at it no more."""
        if self._handlers.pop(source, None) is not None:
            self._poller.unregister(source)

    def stop(self) -> None:
        """Let `run` return after what is being done now."""
        self._running = False

    def run(self, until: float = math.inf) -> None:
        """Live until a time [s], or until `stop` is called."""
        self._running = True
        end = math.inf if math.isinf(until) else round(until * US)
        self._catch_up(end)
        while self._running and self.env._now < end:
            self._wait(end)
        self._running = False

    def _wait(self, end: float) -> None:
        """Wait for the next event or message; events that are due by then go first."""
        wait = min(self.env.peek(), end) - self._real()
        # Rounded up: an event may be a millisecond late, but the processor is not kept spinning.
        ready = self._poller.poll(0 if wait <= 0 else min(LONGEST_WAIT, int(wait) // 1000 + 1))
        self._catch_up(end)
        for source, _ in ready:
            handler = self._handlers.get(source)
            if handler is not None:  # nobody unwatched it since
                handler()
        if self.env.peek() <= self.env._now:
            self._catch_up(end)

    def _catch_up(self, end: float) -> None:
        """Let the events happen that are due, in their order, then make it now."""
        env, real = self.env, self._real()
        until = min(real, end)
        due = env.peek()
        for _ in range(AT_ONCE):
            if due > until:
                break
            self.lateness = max(self.lateness, (real - due) / US)
            env.step()
            if not self._running:
                return
            due = env.peek()
        # Never beyond the next event, whose own step would turn time back.
        env._now = max(env._now, min(until, due))

    def _real(self) -> int:
        return time.monotonic_ns() // 1000 - self._origin
