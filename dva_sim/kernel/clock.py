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


class _Call(Event):
    """A function due at some time: a bare event, without the list and dictionary of SimPy's own."""

    __slots__ = ("action", "args", "callbacks")
    _ok = True  # the kernel asks: nothing has failed

    def __init__(self, action: Callable[..., object], args: tuple[Any, ...]) -> None:
        self.action, self.args, self.callbacks = action, args, _RUN


def _run(call: Any) -> None:
    call.action(*call.args)


_RUN: Any = (_run,)  # one for all calls: the kernel replaces it, and never changes it


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
        env = self.env
        delay = round(time * US) - env._now
        env.schedule(_Call(action, args), NORMAL, delay if delay > 0 else 0)

    def call_after(self, delay: float, action: Callable[..., object], *args: Any) -> None:
        """Run `action(*args)` after `delay` [s]."""
        self.call_at(self.env._now / US + delay, action, *args)

    def every(
        self, period: float, action: Callable[[], object], start: float | None = None
    ) -> None:
        """Run `action()` each `period` [s] until it returns `False`; first at `start` [s]."""
        step = max(1, round(period * US))
        first = self.env._now if start is None else round(start * US)

        def tick() -> None:
            if action() is not False:
                self.env.schedule(_Call(tick, ()), NORMAL, step)

        self.env.schedule(_Call(tick, ()), NORMAL, max(0, first - self.env._now))

    def run(self, until: float) -> None:
        """Let time pass up to `until` [s]."""
        if until > self.now:
            self.env.run(until=round(until * US))
