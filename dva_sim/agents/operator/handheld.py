"""Devices in the hands of persons at a console, and their input."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from dva_sim.agents.operator.attention import OperatorSetup
from dva_sim.agents.operator.strategies import Reach
from dva_sim.agents.tilt import PhoneProfile

OnResult = Callable[[bool, str], object]
"""Callback with success or failure of an action, and a message."""


class Input(NamedTuple):
    """Input of a person: its number, when it came [s], and shares of the robot's limits."""

    number: int
    time: float
    speed: float
    turn: float


@dataclass(frozen=True, kw_only=True)
class Console:
    """Equipment of persons at a console.

    Attributes:
        setup: Pattern, rate, time-outs, as of simulated operators.
        phone: Converter of a person's input to commands.
        reach: Limits of a robot, by its id.
    """

    setup: OperatorSetup
    phone: PhoneProfile
    reach: Callable[[str], Reach]


class Gathered:
    """A common result of several actions: success only if all succeed, or the failures.

    Args:
        count: Number of expected answers.
        on_result: Callback once all results have arrived.

    Attributes:
        failed: Callback before `on_result`, if an answer was not good.
    """

    def __init__(self, count: int, on_result: OnResult) -> None:
        self._left = count
        self._on_result = on_result
        self._good: list[str] = []
        self._bad: list[str] = []
        self.failed: Callable[[], object] = lambda: None

    def __call__(self, done: bool, text: str, /, **_: object) -> None:
        """Take one sample."""
        self._left -= 1
        (self._good if done else self._bad).append(text)
        if self._left == 0:
            if self._bad:
                self.failed()
            self._on_result(not self._bad, "; ".join(dict.fromkeys(self._bad or self._good)))
