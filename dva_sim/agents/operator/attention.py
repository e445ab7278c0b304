"""One person, several screens: which robot's picture is looked at, and when the eyes move on.

A person looks at one screen at a time, and takes a moment to find its way into another. A robot
that is where it was sent waits for a judgement: who has waited longest is served first, until
that is done. While none waits, the person glances from one screen to the next.

References:
    T. B. Sheridan: Telerobotics, Automation, and Human Supervisory Control. MIT Press, 1992.
    D. R. Olsen, S. B. Wood: Fan-out: measuring human control of multiple robots. CHI 2004.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Protocol

from dva_sim.clock import Clock
from dva_sim.recorder import DriveLog

GLANCE = 3.0  # at a robot that only drives [s]; assumed
RECONSIDER = 0.5  # how often a person thinks about which screen to look at [s]; assumed


class Screen(Protocol):
    """A robot's picture, and what the person knows of the robot.

    Attributes:
        waits_since: From when on the robot has waited for a judgement [s]; None: it does not.
        log: Told when it is looked at.
    """

    waits_since: float | None
    log: DriveLog

    def look_away(self) -> None:
        """The person looks at another screen."""


def next_screen(
    now: float,
    current: int | None,
    since: float,
    waits: Sequence[float | None],
    seen: Sequence[float],
) -> int:
    """Which screen to look at.

    Args:
        now: [s]
        current: Place of the one that is looked at, if any is.
        since: From when on it was [s].
        waits: From when on each robot has waited for a judgement [s]; None: it does not.
        seen: When each was looked at last [s].
    """
    waiting = [(time, place) for place, time in enumerate(waits) if time is not None]
    if current is not None and waits[current] is not None:
        return current
    if waiting:
        return min(waiting)[1]
    if current is not None and now - since < GLANCE:
        return current
    others = [place for place in range(len(seen)) if place != current]
    return min(others, key=seen.__getitem__)


class Attention:
    """The eyes of one person.

    Args:
        clock: The run's clock.
        switch: What it takes to find into another screen [s].
    """

    def __init__(self, clock: Clock, switch: float) -> None:
        self._clock, self._switch = clock, switch
        self._screens: list[Screen] = []
        self._seen: list[float] = []
        self._current: Screen | None = None
        self._since = 0.0
        self._choosing = False

    def begin(self, screen: Screen) -> None:
        """There is another screen; the only one is looked at at once."""
        self._screens.append(screen)
        self._seen.append(-math.inf)
        if self._current is None:
            self._look(screen, self._clock.now)
        elif not self._choosing:
            self._choosing = True
            self._clock.every(RECONSIDER, self._reconsider)

    def end(self, screen: Screen) -> None:
        """A screen goes off; another is looked at, if there is one."""
        if screen not in self._screens:
            return
        if screen is self._current:
            self._turn_away()
        place = self._screens.index(screen)
        del self._screens[place], self._seen[place]
        if self._current is None and self._screens:
            self._turn_to(self._best())

    def looks_at(self, screen: Screen) -> bool:
        """Whether the person sees what is on a screen now."""
        return screen is self._current and self._clock.now >= self._since

    def _reconsider(self) -> bool:
        """Look where it matters; False once there is nothing to choose."""
        self._choosing = len(self._screens) > 1
        if self._choosing and self._screens[self._best()] is not self._current:
            self._turn_away()
            self._turn_to(self._best())
        return self._choosing

    def _best(self) -> int:
        current = None if self._current is None else self._screens.index(self._current)
        waits = [screen.waits_since for screen in self._screens]
        return next_screen(self._clock.now, current, self._since, waits, self._seen)

    def _turn_to(self, place: int) -> None:
        self._screens[place].log.turned_to += 1
        self._look(self._screens[place], self._clock.now + self._switch)

    def _look(self, screen: Screen, since: float) -> None:
        self._current, self._since = screen, since
        screen.log.looks_since = since

    def _turn_away(self) -> None:
        now, left = self._clock.now, self._current
        assert left is not None
        if now > self._since:
            left.log.attended.append((self._since, now))
        left.log.looks_since = None
        self._seen[self._screens.index(left)] = now
        left.look_away()
        self._current = None
