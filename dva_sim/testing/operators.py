"""Checks of operator strategies, on arbitrary sightings and in drives."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Final, NamedTuple

import numpy as np
from shapely import LineString, Point

from dva_sim.agents.observation import Observation
from dva_sim.agents.operator.strategies import (
    Driver,
    GuardedStrategy,
    Intent,
    PathView,
    PointView,
    Reach,
    Sighting,
    Strategy,
    View,
    load_strategy,
)
from dva_sim.agents.population import Person, Population, draw_person, median_person
from dva_sim.agents.route_following import Route
from dva_sim.kernel.errors import ConfigError
from dva_sim.testing.promises import Case, Outcome, broken_in, kept, part_by_part

FRAME: Final = 0.1  # interval between two pictures [s]
ROBOTS: Final = (Reach(0.5, math.pi / 6), Reach(0.8, 1.4, 0.56))  # one turns on the spot
CURSOR: Final = Reach(0.5, 1.0)
ROUTES: Final = {
    "a straight way": ((0.0, 0.0), (10.0, 0.0)),
    "a corner": ((0.0, 0.0), (5.0, 0.0), (5.0, 5.0)),
    "a double bend": ((0.0, 0.0), (4.0, 0.0), (6.0, 2.0), (10.0, 2.0)),
}
STAIRS: Final = tuple((4.0 * (n // 2), 4.0 * ((n + 1) // 2)) for n in range(16))  # 60 m
WAYS: Final = {**ROUTES, "a long way": STAIRS}
LONG: Final = 120.0  # duration of such a drive, which shows late behaviour [s]
DELAYS: Final = (0.0, 1.0)  # delays of the loop [s]
STOP: Final = 0.5  # distance before the end of a path at which a drive stops [m]
CORRIDOR: Final = 1.0  # half the width of the corridor around a path [m]
MAX_TIME_FACTOR: Final = 30.0  # a drive longer than this many times that at full speed fails
SLOWER: Final = 6.0  # factor on the time at full speed above which a drive is slow
REST: Final = 10.0  # time for which the end of a path is watched [s]
CREEP: Final = 0.005  # a smaller command counts as standing [m/s]
SLOW: Final = 200e-6  # time of an answer above which an episode is slow [s]
SLACK: Final = 1e-9  # rounding error of limits
LOOKS: Final = 400  # number of random observations
EXTREME_OFFSETS: Final = (0.0, 1e-9, 1.0, 40.0, 1e4, -1e4)  # offsets [m], or [rad]
WAITS: Final = (0.0, 0.02, 0.1, 5.0)  # intervals between two pictures [s]
GUESSES: Final = (0.0, 0.05, 0.4, 3.0, 60.0)  # guesses of the delay [s]


def check_operator(
    operator: str | Callable[..., Driver],
    options: Mapping[str, Any] | None = None,
    *,
    slow: float = SLOW,
) -> Outcome:
    """See that a way of steering keeps what all promise.

    It is tried on things seen at random, then in drives of an ideal robot. What users bring is
    held within the limits when it runs; here it is tried without that, so that nothing is hidden.

    Args:
        operator: A strategy by name, as in a scenario, or its class.
        options: Keyword arguments of its constructor, besides person and reach.
        slow: An answer that takes longer earns a warning [s].

    Raises:
        BrokenPromises: it does not; a line for each promise.
        ConfigError: there is none of that name, it cannot be made with these options, or it sees
            nothing: the oracle.
    """
    trial = _Trial(load_strategy(operator, options), np.random.default_rng(1))
    trial.new(median_person(Population()), ROBOTS[0])
    broken = broken_in(part_by_part(trial.parts))
    slowest = min(trial.took, default=0.0)
    warnings = [f"is slow: {what}" for what in trial.late]
    if slowest > slow:
        warnings.append(f"thinks slowly: {slowest:.2g} s an answer; should be {slow:g} s")
    return kept(broken, warnings, trial.count, slowest)


class _Step(NamedTuple):
    """A moment of a drive: time [s], place [m] and the wanted motion."""

    time: float
    x: float
    y: float
    wanted: Intent


class _Trial:
    """All that is tried with one strategy.

    Attributes:
        count: Drives so far.
        took: Mean time of an answer, for each drive [s].
        late: Drives that ended well, but slowly.
    """

    def __init__(self, make: Callable[[Person, Reach], Driver], rng: np.random.Generator) -> None:
        self._make = make
        self._rng = rng
        self.count = 0
        self.took = list[float]()
        self.late = list[str]()
        population = Population()
        drawn = (draw_person(population, 1, index) for index in range(2))
        self._persons = (median_person(population), *drawn)
        self.parts = self._robots, self._cursors, self._alike, self._blind, self._ways

    def new(self, person: Person, reach: Reach) -> Strategy:
        """Return the strategy itself.

        Raises:
            ConfigError: it sees nothing.
        """
        made = self._make(person, reach)
        if not isinstance(made, Strategy):
            raise ConfigError("is told the truth, and sees nothing: there is nothing to try")
        while isinstance(made, GuardedStrategy):  # more than once, where it was loaded before
            made = made.strategy
        return made

    # --- whatever is seen --------------------------------------------------------------

    def _robots(self) -> Iterator[Case]:
        """Yield cases that must be finite and within reach, whatever is seen."""
        for reach in ROBOTS:
            strategy = self.new(self._persons[0], reach)
            now = 0.0
            route = _way(WAYS["a corner"])
            for number in range(LOOKS):
                now += self._one_of(WAITS)
                x, y, heading, speed, turn = (self._anything() for _ in range(5))
                observation = Observation(
                    tick=number, x=x, y=y, heading=heading, speed=speed, turn_rate=turn, hazards=()
                )
                got = strategy.drive(route, View(now, observation, self._one_of(GUESSES)), STOP)
                case = f"{got!r} on {observation!r}"
                if not _is_pair(got):
                    yield "answers no two finite numbers", case
                elif not -SLACK <= got[0] <= reach.speed + SLACK:
                    yield "wants a speed beyond reach", case
                elif abs(got[1]) > reach.turn_rate + SLACK:
                    yield "wants a turn rate beyond reach", case

    def _cursors(self) -> Iterator[Case]:
        """Check sightings of cursors."""
        strategy = self.new(self._persons[0], CURSOR)
        now = 0.0
        path = Route(np.array([(0.0, 0.0), (0.5, 0.0), (0.5, 0.5)]))
        for number in range(LOOKS):
            now += self._one_of(WAITS)
            sighting = Sighting._make(
                [number, *(self._anything() for _ in range(8)), 0.01, math.inf]
            )
            delay = self._one_of(GUESSES)
            point = PointView(now, sighting, delay)
            view = PathView(now, sighting, delay, path)
            for got in (strategy.point(point), strategy.follow(view)):
                case = f"{got!r} on {sighting!r}"
                if not _is_pair(got):
                    yield "gives a cursor no velocity", case
                elif math.hypot(*got) > CURSOR.speed * (1 + SLACK):
                    yield "gives a cursor a velocity beyond reach", case

    def _anything(self) -> float:
        far = self._one_of(EXTREME_OFFSETS)
        return far * float(self._rng.uniform(-1, 1)) if far else 0.0

    def _one_of(self, values: Sequence[float]) -> float:
        return values[int(self._rng.integers(len(values)))]

    # --- drives ------------------------------------------------------------------------

    def _alike(self) -> Iterator[Case]:
        """Check repeatability: alone, beside another strategy, and over a long drive."""
        for person in self._persons:
            is_first = person is self._persons[0]
            route, seconds = ("a long way", LONG) if is_first else ("a double bend", 20.0)
            alone = self._drive(person, ROBOTS[0], route, 1.0, seconds)
            beside = self.new(self._persons[-1], ROBOTS[1])
            self._drive(person, ROBOTS[1], "a corner", 0.0, seconds=20.0, strategy=beside)
            again = self._drive(person, ROBOTS[0], route, 1.0, seconds)
            if again != alone:
                yield "remembers what another one did, or draws random numbers", f"on {route}"

    def _blind(self) -> Iterator[Case]:
        """Yield cases in which nothing is answered otherwise before the picture shows why."""
        for person in self._persons:
            plain, pushed = (
                self._drive(person, ROBOTS[0], "a straight way", 1.0, seconds=12.0, push=push)
                for push in (0.0, 0.4)
            )
            for before, after in zip(plain, pushed, strict=True):
                if after.time < PUSHED_AT + 1.0 - SLACK and after.wanted != before.wanted:
                    yield "sees what no picture has shown yet", f"at {after.time:.1f} s"
                    break

    def _ways(self) -> Iterator[Case]:
        """Yield ways to their end, within a wide corridor; and there it stays."""
        for name, corners in ROUTES.items():
            route_line = LineString(corners)
            for delay in DELAYS:
                case = f"{name}, delay {delay:g} s"
                full = _way(corners).length / ROBOTS[0].speed
                track = self._drive(
                    self._persons[0], ROBOTS[0], name, delay, MAX_TIME_FACTOR * full
                )
                off = max(route_line.distance(Point(step.x, step.y)) for step in track)
                arrived = [s.time for s in track if math.dist((s.x, s.y), corners[-1]) < 1.5 * STOP]
                if off > CORRIDOR:
                    yield "leaves a wide corridor", f"{case}: by {off:.1f} m"
                elif not arrived:
                    yield "does not arrive", case
                elif any(step.wanted.speed > CREEP for step in track[-round(REST / FRAME) :]):
                    yield "does not stand at the end of its way", case
                elif arrived[0] > SLOWER * full:
                    self.late.append(f"{arrived[0]:.0f} s for {case}")

    def _drive(
        self,
        person: Person,
        reach: Reach,
        name: str,
        delay: float,
        seconds: float,
        push: float = 0.0,
        strategy: Strategy | None = None,
    ) -> list[_Step]:
        """Drive a robot that obeys at once, with pictures late by `delay`."""
        self.count += 1
        strategy = strategy or self.new(person, reach)
        route = _way(WAYS[name])
        x = y = heading = 0.0
        late = round(delay / FRAME)
        pictures = [
            Observation(tick=0, x=0.0, y=0.0, heading=0.0, speed=0.0, turn_rate=0.0, hazards=())
        ] * (late + 1)
        track = list[_Step]()
        spent = 0.0
        for number in range(round(seconds / FRAME)):
            view = View(number * FRAME, pictures[-late - 1], max(delay, FRAME))
            started = time.perf_counter()
            intent = Intent(*strategy.drive(route, view, STOP))
            spent += time.perf_counter() - started
            track.append(_Step(view.now, x, y, intent))
            middle = heading + 0.5 * intent.turn_rate * FRAME
            x += intent.speed * FRAME * math.cos(middle)
            y += intent.speed * FRAME * math.sin(middle)
            heading += intent.turn_rate * FRAME
            y += push if number == round(PUSHED_AT / FRAME) else 0.0
            tick = round(1000 * (number + 1) * FRAME)
            pictures.append(
                Observation(
                    tick, x, y, heading, speed=intent.speed, turn_rate=intent.turn_rate, hazards=()
                )
            )
            long = track[-round(2 * REST / FRAME) :]
            rests = (
                len(track) > len(long) and long[0][1:] == long[-1][1:] and not any(long[-1].wanted)
            )
            if rests:
                break
        self.took.append(spent / len(track))
        return track


PUSHED_AT: Final = 6.0  # time at which the robot is pushed aside in some drives [s]


def _way(corners: Sequence[tuple[float, float]]) -> Route:
    return Route(np.array(corners))


def _is_pair(got: Any) -> bool:
    """Return True if the value is a pair of finite numbers."""
    try:
        first, second = got
        return math.isfinite(first) and math.isfinite(second)
    except (TypeError, ValueError):
        return False
