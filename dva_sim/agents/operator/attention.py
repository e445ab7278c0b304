"""Attention of an operator: the screen it looks at, and its equipment.

A person looks at one screen at a time, and takes a moment to find its way into another. A robot
that is where it was sent waits for a judgement: who has waited longest is served first, until
that is done. While none waits, the person glances from one screen to the next.

References:
    T. B. Sheridan: Telerobotics, Automation, and Human Supervisory Control. MIT Press, 1992.
    D. R. Olsen, S. B. Wood: Fan-out: measuring human control of multiple robots. CHI 2004.
    M. Colley et al., CHI 2025, doi:10.1145/3706598.3713476: looks at one of two vehicles.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import chain, repeat
from typing import Protocol

import numpy as np

from dva_sim.agents.device import AgentDevice
from dva_sim.agents.habits import AttentionHabits
from dva_sim.agents.observation import Observation, make_observation, topic_in
from dva_sim.agents.operator.delay_estimation import DelayEstimate, Timing
from dva_sim.agents.operator.strategies import Driver, Reach, Truth
from dva_sim.agents.population import Person
from dva_sim.agents.tilt import Phone
from dva_sim.kernel.clock import Clock
from dva_sim.kernel.recorder import DriveLog
from dva_sim.network.patterns import Pattern
from dva_sim.worlds.planning import Planner

OCCASIONS = 0.35  # source: Claypool et al. 2017: spread of the log of a person's times


class Screen(Protocol):
    """A robot's picture, and what the person knows of the robot.

    Attributes:
        waits_since: Time since which the robot has waited for a judgement [s]; None: it does not
            wait.
        log: Log of the drive, in which looks are counted.
    """

    waits_since: float | None
    log: DriveLog

    def look_away(self) -> None:
        """Turn to another screen."""


def next_screen(
    now: float,
    current: int | None,
    since: float,
    waits: Sequence[float | None],
    seen: Sequence[float],
    glance: float,
) -> int:
    """Choose the screen to look at.

    Args:
        now: [s]
        current: Index of the screen that is looked at, if any.
        since: Start of the present look [s].
        waits: Time since which each robot has waited for a judgement [s]; None: it does not wait.
        seen: Time of the latest look at each [s].
        glance: Duration of a look at a robot that only drives [s].
    """
    waiting = [(time, index) for index, time in enumerate(waits) if time is not None]
    if current is not None and waits[current] is not None:
        return current
    if waiting:
        return min(waiting)[1]
    if current is not None and now - since < glance:
        return current
    others = [index for index in range(len(seen)) if index != current]
    return min(others, key=seen.__getitem__)


class Attention:
    """Gaze of one person.

    Args:
        clock: The run's clock.
        switch: Time to find into another screen [s].
        habits: Habits of the person.
        noise: Standard normal numbers, one for each look.
    """

    def __init__(
        self, clock: Clock, switch: float, habits: AttentionHabits, noise: Iterator[float]
    ) -> None:
        self._clock = clock
        self._switch = switch
        self._habits = habits
        self._noise = noise
        self._glance = habits.glance_s
        self._screens: list[Screen] = []
        self._seen: list[float] = []
        self._current: Screen | None = None
        self._since = 0.0
        self._choosing = False

    def begin(self, screen: Screen) -> None:
        """Add a screen, and look at it if it is the only one."""
        self._screens.append(screen)
        self._seen.append(-math.inf)
        if self._current is None:
            self._look(screen, self._clock.now)
        elif not self._choosing:
            self._choosing = True
            self._clock.every(self._habits.reconsiders_s, self._reconsider)

    def end(self, screen: Screen) -> None:
        """Remove a screen that is switched off, and look at another one, if any."""
        if screen not in self._screens:
            return
        if screen is self._current:
            self._turn_away()
        index = self._screens.index(screen)
        del self._screens[index], self._seen[index]
        if self._current is None and self._screens:
            self._turn_to(self._best())

    def looks_at(self, screen: Screen) -> bool:
        """Return True if the person is looking at a screen now."""
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
        now = self._clock.now
        return next_screen(now, current, self._since, waits, self._seen, self._glance)

    def _turn_to(self, index: int) -> None:
        self._screens[index].log.turned_to += 1
        self._look(self._screens[index], self._clock.now + self._switch)

    def _look(self, screen: Screen, since: float) -> None:
        self._current = screen
        self._since = since
        habits = self._habits
        self._glance = habits.glance_s * math.exp(habits.glance_spread * next(self._noise))
        screen.log.looks_since = since

    def _turn_away(self) -> None:
        now = self._clock.now
        left = self._current
        assert left is not None
        if now > self._since:
            left.log.attended.append((self._since, now))
        left.log.looks_since = None
        self._seen[self._screens.index(left)] = now
        left.look_away()
        self._current = None


@dataclass(frozen=True, kw_only=True)
class OperatorSetup:
    """Equipment of an operator, apart from the person.

    Attributes:
        pattern: Function that makes the messaging pattern of a drive, by the id of the robot.
        window: Maximum number of unanswered commands, where the pattern allows several.
        rate_hz: Desired rate of commands [1/s].
        timeout: Time-out of a request [s].
        attempts: Number of attempts of a request.
        truth: The true state of a robot by id, if the strategy is the oracle; else None.
        guarded: True if a collision guard may hold a robot back.
        heeds: True if the app reacts to refusals; see `CommandSender`.
        topic: Topic of a camera's frames, by its URL; see `Cameras`.
    """

    pattern: Callable[[str], Pattern]
    window: int
    rate_hz: float
    timeout: float
    attempts: int
    truth: Callable[[str], Truth[Observation]] | None = None
    guarded: bool = False
    heeds: bool = True
    topic: Callable[[str], str | None] = topic_in


class DriverSeat:
    """Everything a person brings to a drive, and keeps from one to the next.

    Args:
        device: Identity and connections of the operator.
        phone: The phone in the hand.
        strategy: Function that makes the person's strategy for a robot with these limits.
        reach: Limits of a robot, by its id.
        planner: The person knows the building.
        setup: Pattern, rate, time-outs.
        rng: Random generator of this person's judgement.
        looks: Random generators for looks at an event, by the name of the visit.

    Attributes:
        delay: The person's estimate of the delay.
        attention: Choice of the robot's picture to look at.
    """

    def __init__(
        self,
        device: AgentDevice,
        person: Person,
        phone: Phone,
        *,
        strategy: Callable[[Person, Reach], Driver],
        reach: Callable[[str], Reach],
        planner: Planner,
        setup: OperatorSetup,
        rng: np.random.Generator,
        looks: Callable[[str], np.random.Generator],
    ) -> None:
        self.device = device
        self.person = person
        self.phone = phone
        self.strategy = strategy
        self.reach = reach
        self.planner = planner
        self.setup = setup
        habits = person.habits
        self.delay = DelayEstimate(0.0, habits.delay.first_guess_s, habits=habits.delay)
        glances = _normals(looks("glances"), block=64)
        self.attention = Attention(device.clock, person.switch, habits.attention, glances)
        self._readings = _normals(looks("readings"), block=64)
        self._timing = Timing(habits.aiming, looks("timing"))
        self._errors = _normals(rng)
        self._looks = looks
        self._times = Counter[int]()

    def judged_delay(self, now: float) -> float:
        """Return the delay as the person judges it at a moment [s]."""
        return self._timing.judged(self.delay.value, self.person.usual_delay, now)

    def reading(self) -> float:
        """Return the time from an order on the screen to acting on it, this time [s]."""
        return self.person.reading * math.exp(OCCASIONS * next(self._readings))

    def noise(self, event: int) -> Iterator[float]:
        """Return standard normal numbers for another visit to an event, alike for all patterns."""
        self._times[event] += 1
        return _normals(self._looks(f"{event}/{self._times[event]}"), block=64)

    def judge(self, seen: Observation) -> Observation:
        """Return a frame as the person takes it: place and heading with an error."""
        person = self.person
        error = self._errors
        return make_observation(
            tick=seen.tick,
            x=seen.x + person.position_error * next(error),
            y=seen.y + person.position_error * next(error),
            heading=seen.heading + person.heading_error * next(error),
            speed=seen.speed,
            turn_rate=seen.turn_rate,
            hazards=seen.hazards,
            visibility=seen.visibility,
        )


def _normals(rng: np.random.Generator, block: int = 512) -> Iterator[float]:
    """Return standard normal numbers without end, drawn in blocks."""
    return chain.from_iterable(rng.normal(size=block).tolist() for _ in repeat(None))
