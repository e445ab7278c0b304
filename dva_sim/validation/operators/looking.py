"""Decisions that people make by looking, simulated with parts of an operator and no task.

Looks at one of two screens, two vehicles that ask at once, choices in a hurry, items found by a
searcher, an alarm, people who walk in a street. Each is asked of one person after the other.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from dva_sim.agents.operator.attention import Attention
from dva_sim.agents.operator.inspection import WeighedEvidence, clearness
from dva_sim.agents.people.profiles import Walker
from dva_sim.agents.population import Person
from dva_sim.kernel.clock import Clock
from dva_sim.kernel.recorder import DriveLog
from dva_sim.kernel.streams import Streams
from dva_sim.validation.operators.exact import guard_profile

Row = dict[str, Any]
Part = Callable[[Person, str, int], list[Row]]
"""Plays one person in one cell with a seed."""

WATCHED_S = 240.0  # two screens that nothing waits on
LEG_S = 40.0  # that a vehicle drives; published: 39.7 s
GOES_ON_S = 10.0  # without being looked at, on the way that it was given; assumed
TICK_S = 0.1
TRIALS = 60  # of each choice
HALF_CLEAR = 0.25  # half as clear as an event; assumed
SHORTER = 1.0 / 3.0  # a third of its criterion; assumed
PICTURE_S = 1.0 / 30.0
ANGLE = 0.05  # of an item beside the way of a searcher; assumed
PASSED_S = 4.0  # how long it is passed; assumed
ITEMS = 20
WALKERS = 40


@dataclass
class _Vehicle:
    """A screen with a vehicle that asks from the beginning on."""

    waits_since: float | None = None
    log: DriveLog = field(default_factory=lambda: DriveLog("vehicle", "operator", 1, 0.0))
    left: float = LEG_S
    unseen: float = 0.0
    done: float = 0.0

    def look_away(self) -> None:
        """Do nothing: the vehicle drives on by itself."""

    def drive(self, seen: bool, dt: float) -> None:
        """Go on, unless the way that it was given is used up."""
        self.unseen = 0.0 if seen else self.unseen + dt
        if self.unseen <= GOES_ON_S:
            self.left -= dt


def looks(person: Person, cell: str, seed: int) -> list[Row]:
    """Return every look at one of two screens on which nothing waits."""
    clock = Clock()
    attention = _attention(clock, person, seed)
    screens = _Vehicle(), _Vehicle()
    for screen in screens:
        attention.begin(screen)
    clock.run(WATCHED_S)
    spans = sorted(span for screen in screens for span in screen.log.attended)
    return [{"look_s": until - since} for since, until in spans]


def vehicles(person: Person, cell: str, seed: int) -> list[Row]:
    """Finishing times of vehicles that ask at the same time, opening the picture included."""
    clock = Clock()
    every = [_Vehicle() for _ in range(int(cell))]
    attention = _attention(clock, person, seed)
    for vehicle in every:
        attention.begin(vehicle)

    def tick() -> bool:
        for vehicle in (v for v in every if not v.done):
            vehicle.drive(attention.looks_at(vehicle), TICK_S)
            if vehicle.left <= 0.0:
                vehicle.done = clock.now
                attention.end(vehicle)
        return any(not vehicle.done for vehicle in every)

    clock.every(TICK_S, tick)
    clock.run(20.0 * LEG_S)
    return [{"finish_s": person.reading + vehicle.done} for vehicle in every]


def choices(person: Person, cell: str, seed: int) -> list[Row]:
    """Return choices between two things: what more evidence speaks for first, is said."""
    noise = _normals(seed)
    rows = []
    for _ in range(TRIALS):
        right, wrong = (_evidence(person, cell, noise, SHORTER) for _ in range(2))
        looked = 0.0
        while not (right.sure or wrong.sure):
            right.weigh(PICTURE_S, 0.5 + HALF_CLEAR, 1.0)
            wrong.weigh(PICTURE_S, 0.5 - HALF_CLEAR, 1.0)
            looked += PICTURE_S
        rows.append(
            {"time_s": person.reaction + looked, "error": float(wrong.sure and not right.sure)}
        )
    return rows


def items(person: Person, cell: str, seed: int) -> list[Row]:
    """Return items beside the way of a searcher: found or not."""
    noise = _normals(seed)
    rows = []
    clear = clearness(ANGLE, person.habits.looking.half_seen_rad)
    for _ in range(ITEMS):
        evidence = _evidence(person, "accuracy", noise)
        for _ in range(round(PASSED_S / PICTURE_S)):
            if not evidence.sure:
                evidence.weigh(PICTURE_S, clear, 1.0)
        rows.append({"found": float(evidence.sure)})
    return rows


def alarms(person: Person, cell: str, seed: int) -> list[Row]:
    """Return times from a request on the screen to its picture."""
    return [{"opened_s": person.reading}]


def walkers(person: Person, cell: str, seed: int) -> list[Row]:
    """Return people on foot who are in no hurry; who is at the screen does not matter."""
    rng = Streams(seed).fresh("walkers")
    guard = guard_profile()
    return [{"speed_mps": Walker.draw(guard, rng).speed} for _ in range(WALKERS)]


def _attention(clock: Clock, person: Person, seed: int) -> Attention:
    return Attention(clock, person.switch, person.habits.attention, _normals(seed))


def _evidence(
    person: Person, cell: str, noise: Iterator[float], share: float = 1.0
) -> WeighedEvidence:
    looking = person.habits.looking
    share *= looking.hurried if cell == "speed" else 1.0
    return WeighedEvidence(person.sensitivity, share * person.confirm_look, noise, looking)


def _normals(seed: int) -> Iterator[float]:
    rng: np.random.Generator = Streams(seed).fresh("looks")
    while True:
        yield from rng.normal(size=512).tolist()


PARTS: dict[str, Part] = {
    "looks": looks,
    "vehicles": vehicles,
    "choices": choices,
    "items": items,
    "alarms": alarms,
    "walkers": walkers,
}
