"""A timer that is moved far more often than it rings.

Moving it later costs nothing: the event already scheduled looks, when it is due, whether
the deadline has moved on. Only an earlier deadline needs a new event.

Linux keeps such timers in a wheel of several rings, of which each outer one is eight times
coarser: the longer the wait, the later it may ring, and never early. At 250 ticks a second
a wait of 300 ms ends on a grid of 32 ms.

References:
    Corbet: Reinventing the timer wheel. LWN.net, 2015; seen in our own measurements.
"""

from __future__ import annotations

from collections.abc import Callable
from math import ceil, inf

from dva_sim.clock import Clock

_SLACK_S = 1e-6  # the clock counts whole microseconds
_INNERMOST = 64  # ticks that the finest ring covers
_COARSER = 8  # each next ring


class Timer:
    """One deadline at a time.

    Args:
        clock: The run's clock.
        action: Called when the deadline has come.
        tick: Grid of the finest ring [s]; 0 = exact.

    Attributes:
        deadline: When it rings [s]; infinite if it is not set.
    """

    __slots__ = ("_action", "_clock", "_due", "_tick", "deadline")

    def __init__(self, clock: Clock, action: Callable[[], object], tick: float = 0.0) -> None:
        self._clock, self._action, self._tick = clock, action, tick
        self.deadline = self._due = inf

    def set(self, deadline: float) -> None:
        """Ring at `deadline` [s] and not before, whatever was set earlier."""
        if self._tick:
            now = self._clock.now
            deadline = next_on_grid(now, max(0.0, deadline - now), self._tick)
        self.deadline = deadline
        if deadline < self._due:
            self._schedule(deadline)

    def stop(self) -> None:
        """Do not ring."""
        self.deadline = inf

    def _schedule(self, due: float) -> None:
        self._due = due
        self._clock.call_at(due, self._look, due)

    def _look(self, due: float) -> None:
        if due != self._due:
            return  # an earlier deadline came between
        self._due = inf
        if self.deadline > due + _SLACK_S:
            if self.deadline < inf:
                self._schedule(self.deadline)
            return
        self.deadline = inf
        self._action()


def next_on_grid(now: float, wait: float, tick: float) -> float:
    """When a timer rings that is set `now` [s] for `wait` [s], on a grid of `tick` [s].

    The time is rounded down and the wait up to ticks; the ring is then the next one of the
    wheel, never this one.
    """
    ticks, step = ceil(wait / tick - 1e-6), 1
    due = int(now / tick + 1e-6) + ticks
    while ticks >= _INNERMOST * step:
        step *= _COARSER
    return (due // step + 1) * step * tick
