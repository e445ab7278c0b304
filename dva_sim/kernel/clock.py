"""The one clock: SimPy in whole microseconds, seen by everyone else in seconds.

Whole microseconds make simultaneous events exactly simultaneous (no 0.1 + 0.2), so
the order of a run does not hang on rounding, and periodic events do not drift.
Callbacks are scheduled directly: a process per packet costs three times as much.
"""

from __future__ import annotations

from collections.abc import Callable
from heapq import heappop, heappush
from typing import Any

import simpy

US = 1_000_000


class Clock:
    """Virtual time of one run.

    Times are seconds [s] since the run's start; they are kept to the microsecond.

    Attributes:
        now: Seconds since the start [s].
    """

    def __init__(self) -> None:
        self.env = simpy.Environment(initial_time=0)
        self._queue: Any = self.env._queue  # of when [us], in which order, what, with what
        self.now = 0.0

    def call_at(self, time: float, action: Callable[..., object], *args: Any) -> None:
        """Run `action(*args)` at `time` [s]; a time already past means as soon as possible."""
        self._put(round(time * US), action, args)

    def call_after(self, delay: float, action: Callable[..., object], *args: Any) -> None:
        """Run `action(*args)` after `delay` [s]."""
        self._put(round((self.now + delay) * US), action, args)

    def every(
        self, period: float, action: Callable[[], object], start: float | None = None
    ) -> None:
        """Run `action()` each `period` [s] until it returns `False`; first at `start` [s]."""
        env, queue, step = self.env, self._queue, max(1, round(period * US))

        def tick() -> None:
            if action() is not False:
                heappush(queue, (env._now + step, next(env._eid), tick, ()))

        self._put(env._now if start is None else round(start * US), tick, ())

    def run(self, until: float) -> None:
        """Let time pass up to `until` [s]; what is due then happens when time goes on."""
        end, env, queue = round(until * US), self.env, self._queue
        if until > self.now:
            while queue and queue[0][0] < end:
                env._now, _, action, args = heappop(queue)  # as in `step`, without its call
                self.now = env._now / US
                action(*args)
            self._set(end)

    def step(self) -> None:
        """Let the next event happen."""
        env = self.env
        env._now, _, action, args = heappop(self._queue)
        self.now = env._now / US
        action(*args)

    def _put(self, at: float, action: Callable[..., object], args: tuple[Any, ...]) -> None:
        """It is due at a time [us], after all that was put there before."""
        env = self.env
        now = env._now
        heappush(self._queue, (at if at > now else now, next(env._eid), action, args))

    def _set(self, now: float) -> None:
        """It is that time [us], and nothing before it is due."""
        self.env._now, self.now = now, now / US
