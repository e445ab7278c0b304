"""Where an operator sits: who it is, what is at hand, and what it knows."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from dva_sim.agents.camera import Observation
from dva_sim.agents.device import Device
from dva_sim.agents.operator.attention import Attention
from dva_sim.agents.operator.delay import DelayEstimate
from dva_sim.agents.operator.person import Person
from dva_sim.agents.operator.strategies import Driver, Reach, Truth
from dva_sim.agents.tilt import Phone
from dva_sim.worlds.planning import Planner

FIRST_GUESS = 0.6  # delay a person expects before having seen any [s]


@dataclass(frozen=True)
class OperatorSetup:
    """How an operator works, beside who it is.

    Attributes:
        window: Of the requests that carry SetTeleOp: how many may be unanswered at once; None
            if SetTeleOp is published instead.
        rate_hz: Wanted commands per second.
        timeout: Of a request [s].
        attempts: Of a request.
        truth: The true state of a robot by id, if the strategy is the oracle; else None.
        guarded: Whether a collision guard may hold a robot back.
    """

    window: int | None
    rate_hz: float
    timeout: float
    attempts: int
    truth: Callable[[str], Truth[Observation]] | None = None
    guarded: bool = False


class DriverSeat:
    """Everything a person brings to a drive, and keeps from one to the next.

    Args:
        device: Identity and ways to talk.
        person: Who it is.
        phone: The phone in the hand.
        strategy: How the person drives a robot that can do so much.
        reach: What a robot can do, by its id.
        planner: The person knows the building.
        setup: Pattern, rate, time-outs.
        rng: Luck of this person's judgement.
        looks: Luck of its looks at an event, by a name for each time that it goes there.

    Attributes:
        delay: What the person has learnt of the delay.
        attention: Which robot's picture it looks at.
    """

    def __init__(
        self,
        device: Device,
        person: Person,
        phone: Phone,
        strategy: Callable[[Person, Reach], Driver],
        reach: Callable[[str], Reach],
        planner: Planner,
        setup: OperatorSetup,
        rng: np.random.Generator,
        looks: Callable[[str], np.random.Generator],
    ) -> None:
        self.device, self.person, self.phone = device, person, phone
        self.strategy, self.reach = strategy, reach
        self.planner, self.setup = planner, setup
        self.delay = DelayEstimate(0.0, FIRST_GUESS)
        self.attention = Attention(device.clock, person.switch)
        self._errors = _normals(rng)
        self._looks, self._times = looks, Counter[int]()

    def luck(self, event: int) -> Iterator[float]:
        """Standard normal numbers for one more time at an event, whatever the pattern."""
        self._times[event] += 1
        return _normals(self._looks(f"{event}/{self._times[event]}"), block=64)

    def judge(self, seen: Observation) -> Observation:
        """A frame as the person takes it: place and heading with an error."""
        person, error = self.person, self._errors
        return seen._replace(
            x=seen.x + person.position_error * next(error),
            y=seen.y + person.position_error * next(error),
            heading=seen.heading + person.heading_error * next(error),
        )


def _normals(rng: np.random.Generator, block: int = 512) -> Iterator[float]:
    """Standard normal numbers without end, drawn in blocks."""
    while True:
        yield from rng.normal(size=block).tolist()
