"""The clock of a run: SimPy in whole microseconds, with an interface in seconds.

Whole microseconds make simultaneous events exactly simultaneous (no 0.1 + 0.2), so the order of a
run does not depend on rounding, and periodic events do not drift. Callbacks are put into SimPy's
queue directly: an event for each costs three times as much, and a process per packet nine times.
"""

from __future__ import annotations

from collections.abc import Callable
from heapq import heappop, heappush
from typing import Any

import simpy
from simpy.events import NORMAL

US = 1_000_000

Action = Callable[..., object]


class Agenda(simpy.Environment):
    """SimPy's environment, whose queue also holds plain calls.

    Attributes:
        queue: SimPy's queue. An entry has a time [us], a priority, a number, and an event or the
            function and arguments of a call.
    """

    def __init__(self) -> None:
        super().__init__(initial_time=0)
        self.queue: list[Any] = self._queue

    def call(self, at: int, action: Action, arguments: tuple[Any, ...]) -> None:
        """Queue a call, due at a time [us] that is not past, after all entries for that time."""
        heappush(self.queue, (at, NORMAL, next(self._eid), (action, arguments)))

    def step(self) -> None:
        """Process the next event or make the next call."""
        entry = heappop(self.queue)
        self._now, _, _, due = entry
        if type(due) is tuple:
            action, arguments = due
            action(*arguments)
        else:
            heappush(self.queue, entry)  # SimPy takes its events from the queue itself
            super().step()


class Clock:
    """Virtual time of one run.

    Times are seconds since the start of the run, with a resolution of a microsecond.

    Attributes:
        env: SimPy's environment, in microseconds.
        now: Time since the start [s].
    """

    def __init__(self) -> None:
        self.env = Agenda()
        self.now = 0.0
        self._now_us = 0

    def call_at(self, time: float, action: Action, *args: Any) -> None:
        """Run `action(*args)` at `time` [s], or as soon as possible if it is past."""
        at = round(time * US)
        self.env.call(at if at > self._now_us else self._now_us, action, args)

    def on_suspended(self, handler: Callable[[float], object]) -> None:
        """Register a handler for the duration of suspensions [s]; virtual time has none."""

    def call_after(self, delay: float, action: Action, *args: Any) -> None:
        """Run `action(*args)` after `delay` [s]."""
        at = round((self.now + delay) * US)
        self.env.call(at if at > self._now_us else self._now_us, action, args)

    def every(
        self, period: float, action: Callable[[], bool | None], start: float | None = None
    ) -> None:
        """Run `action()` each `period` [s] until it returns `False`; first at `start` [s]."""
        call = self.env.call
        step = max(1, round(period * US))
        at = self._now_us if start is None else max(self._now_us, round(start * US))

        def tick() -> None:
            nonlocal at
            if action() is not False:
                at += step
                call(at, tick, ())

        call(at, tick, ())

    def run(self, until: float) -> None:
        """Run all events before `until` [s]; events due at that time run in the next call."""
        end = round(until * US)
        if until > self.now:
            queue = self.env.queue
            step = self.step
            while queue and queue[0][0] < end:
                step()
            self._set(end)

    def step(self) -> None:
        """Process the next event."""
        self._now_us = at = self.env.queue[0][0]
        self.now = at / US
        self.env.step()

    def _set(self, now: int) -> None:
        """Set the time [us]; no earlier events may be due."""
        self._now_us = now
        self.now = now / US
