"""The one clock: SimPy in whole microseconds, seen by everyone else in seconds.

Whole microseconds make simultaneous events exactly simultaneous (no 0.1 + 0.2), so
the order of a run does not hang on rounding, and periodic events do not drift.
Callbacks are scheduled directly: a process per packet costs three times as much.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import simpy

US = 1_000_000


class Clock:
    """Virtual time of one run.

    Times are seconds [s] since the run's start; they are kept to the microsecond.

    Attributes:
        env: SimPy's environment, in microseconds.
        now: Seconds since the start [s].
    """

    def __init__(self) -> None:
        self.env = simpy.Environment(initial_time=0)
        self.now, self._now_us = 0.0, 0
        self._event_us = 0  # SimPy's own time, that of the last event, without asking it

    def call_at(self, time: float, action: Callable[..., object], *args: Any) -> None:
        """Run `action(*args)` at `time` [s]; a time already past means as soon as possible."""
        self._put(round(time * US), action, args)

    def on_suspended(self, handler: Callable[[float], object]) -> None:
        """Call `handler` with how long the machine was suspended [s]; virtual time never is."""

    def call_after(self, delay: float, action: Callable[..., object], *args: Any) -> None:
        """Run `action(*args)` after `delay` [s]."""
        self._put(round((self.now + delay) * US), action, args)

    def every(
        self, period: float, action: Callable[[], object], start: float | None = None
    ) -> None:
        """Run `action()` each `period` [s] until it returns `False`; first at `start` [s]."""
        timeout, step = self.env.timeout, max(1, round(period * US))
        at = self._now_us if start is None else max(self._now_us, round(start * US))

        def tick(_: simpy.Event) -> None:
            nonlocal at
            self._event_us = self._now_us = at
            self.now = at / US
            if action() is not False:
                at += step
                timeout(step).callbacks.append(tick)

        timeout(at - self._event_us).callbacks.append(tick)

    def run(self, until: float) -> None:
        """Let time pass up to `until` [s]; what is due then happens when time goes on."""
        end = round(until * US)
        if until > self.now:
            peek, step = self.env.peek, self.env.step
            while peek() < end:
                step()
            self._set(end)

    def step(self) -> None:
        """Let the next event happen."""
        self.env.step()

    def _put(self, at: int, action: Callable[..., object], args: tuple[Any, ...]) -> None:
        """It is due at a time [us], after all that was put there before."""
        if at < self._now_us:
            at = self._now_us

        def call(_: simpy.Event) -> None:
            self._event_us = self._now_us = at
            self.now = at / US
            action(*args)

        self.env.timeout(at - self._event_us).callbacks.append(call)

    def _set(self, now: int) -> None:
        """It is that time [us], and nothing before it is due."""
        self._now_us, self.now = now, now / US
