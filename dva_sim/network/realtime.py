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

from dva_sim.clock import US, Clock

LONGEST_WAIT = 3_600_000  # of one poll [ms]


class LiveClock(Clock):
    """A clock that follows the wall clock; see `Clock`.

    Times are seconds since `epoch`, taken from a clock that never steps back.

    Args:
        epoch: The run's start in seconds since 1970 [s]; processes that share it share
            their time. Default: now.
    """

    def __init__(self, epoch: float | None = None) -> None:
        super().__init__()
        wall = time.time()
        self._origin = time.monotonic() - (0.0 if epoch is None else wall - epoch)
        self._poller = zmq.Poller()
        self._handlers: dict[Any, Callable[[], object]] = {}
        self._running = False
        self.lateness = 0.0
        self._advance()

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
        while self._running and self._step(end):
            pass
        self._running = False

    def _step(self, end: float) -> bool:
        """Do what is due, then wait for the next event or message; False at the end."""
        self._catch_up(end)
        if self.env._now >= end or not self._running:
            return False
        due = min(self.env.peek(), end)
        # Rounded up: an event may be a millisecond late, but the processor is not kept spinning.
        wait = min(LONGEST_WAIT, max(0.0, math.ceil((due - self._real()) / 1000)))
        ready = self._poller.poll(int(wait))
        self._catch_up(end)
        for source, _ in ready:
            handler = self._handlers.get(source)
            if handler is not None:
                handler()
        return True

    def _catch_up(self, end: float) -> None:
        """Let the events happen that are due, in their order, then make it now."""
        env, real = self.env, self._real()
        while env.peek() <= min(real, end) and self._running:
            late = (real - env.peek()) / US
            self.lateness = max(self.lateness, late)
            env.step()
        self._advance()

    def _advance(self) -> None:
        """Time has passed without an event."""
        env = self.env
        env._now = max(env._now, min(self._real(), _before(env.peek())))

    def _real(self) -> int:
        return round((time.monotonic() - self._origin) * US)


def _before(due: float) -> int | float:
    """The last moment before an event, so that its own step does not turn time back."""
    return due if math.isinf(due) else int(due)
