"""The one clock: SimPy in whole microseconds, seen by everyone else in seconds.

Whole microseconds make simultaneous events exactly simultaneous (no 0.1 + 0.2), so
the order of a run does not hang on rounding, and periodic events do not drift.
Callbacks are scheduled directly: a process per packet costs three times as much.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import simpy
from simpy.events import NORMAL, Event

US = 1_000_000


class Clock:
    """Virtual time of one run.

    Times are seconds [s] since the run's start; they are kept to the microsecond.
    """

    def __init__(self) -> None:
        self.env = simpy.Environment(initial_time=0)

    @property
    def now(self) -> float:
        """Seconds since the start [s]."""
        return self.env._now / US

    def call_at(self, time: float, action: Callable[..., object], *args: Any) -> None:
        """Run `action(*args)` at `time` [s]; a time already past means as soon as possible."""
        delay = round(time * US) - self.env._now
        self._schedule(delay if delay > 0 else 0, lambda _: action(*args))

    def call_after(self, delay: float, action: Callable[..., object], *args: Any) -> None:
        """Run `action(*args)` after `delay` [s]."""
        self.call_at(self.env._now / US + delay, action, *args)

    def every(
        self, period: float, action: Callable[[], object], start: float | None = None
    ) -> None:
        """Run `action()` each `period` [s] until it returns `False`; first at `start` [s]."""
        step = max(1, round(period * US))
        first = self.env._now if start is None else round(start * US)

        def tick(_: object = None) -> None:
            if action() is False:
                return
            self._schedule(step, tick)

        self._schedule(max(0, first - int(self.env._now)), tick)

    def _schedule(self, delay_us: float, callback: Callable[[Any], object]) -> None:
        """A bare event with a callback: what SimPy's own Timeout is, without its checks."""
        event = Event(self.env)
        event._ok = True
        event._value = None
        event.callbacks = [callback]  # type: ignore[list-item]
        self.env.schedule(event, NORMAL, delay_us)

    def run(self, until: float) -> None:
        """Let time pass up to `until` [s]."""
        if until > self.now:
            self.env.run(until=round(until * US))
