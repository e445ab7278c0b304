"""How operators drive: from what they see, or (the reference) from what is.

References:
    T. B. Sheridan: Telerobotics, Automation, and Human Supervisory Control. MIT Press, 1992
    (driving under delay); R. C. Coulter, CMU-RI-TR-92-01 (pure pursuit).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from dva_sim.agents.camera import Observation
from dva_sim.agents.operator.person import Person
from dva_sim.agents.steering import Route

NEAREST_LOOK, FARTHEST_LOOK = 0.8, 1.8  # look-ahead inside a building [m]
TURN_FROM, TURN_UNTIL = 0.9, 0.25  # bearing at which one stops to turn, and drives on [rad]
TURN_MARGIN = 0.5  # crossover x delay kept below this: a third of the way to instability


@dataclass(frozen=True, slots=True)
class Truth:
    """The true state of a robot, told without delay or error: for the oracle alone."""

    state: Observation


class Intent(NamedTuple):
    """What an operator wants the robot to do now: speed [m/s], turn rate [rad/s]."""

    speed: float
    turn_rate: float


@dataclass(frozen=True)
class Reach:
    """What the robot can do.

    Attributes:
        speed: At most [m/s].
        turn_rate: At most, either way [rad/s].
        radius: Of its sharpest curve [m]; 0: it turns on the spot.
    """

    speed: float
    turn_rate: float
    radius: float = 0.0

    def turn(self, turn_rate: float) -> Intent:
        """Turn at a rate [rad/s], as nearly on the spot as the robot can."""
        return Intent(min(abs(turn_rate) * self.radius, self.speed), turn_rate)


class Strategy(Protocol):
    """How a kind of operator drives along a route, by frames."""

    def drive(self, route: Route, seen: Observation, delay: float, stop_before: float) -> Intent:
        """What to ask for.

        Args:
            route: The way to go.
            seen: The newest frame, as the person judges it.
            delay: What the person takes the whole delay to be [s].
            stop_before: Where to stop: so far before the end of the route [m].
        """


class Pursuit:
    """Aims at a point ahead on the route, the farther the longer the delay.

    Slows so that the way covered during the delay stays a fraction of the look-ahead, and
    stops to turn where the route bends sharply.

    Args:
        person: Gain, caution and pace.
        reach: Limits of the robot.
    """

    def __init__(self, person: Person, reach: Reach) -> None:
        self._person, self._reach = person, reach
        self._turning = False

    def drive(self, route: Route, seen: Observation, delay: float, stop_before: float) -> Intent:
        """See `Strategy`."""
        person, reach = self._person, self._reach
        wanted = person.pace * reach.speed
        look = min(max(wanted * delay / person.caution, NEAREST_LOOK), FARTHEST_LOOK)
        ahead = route.ahead(seen.x, seen.y, seen.heading, look)
        limit = TURN_UNTIL if self._turning else TURN_FROM
        self._turning = abs(ahead.bearing) > limit
        is_there = ahead.remaining < stop_before
        if is_there and reach.radius > 0.0:
            return Intent(0.0, 0.0)  # a car cannot turn towards what it has come to see
        if self._turning or is_there:
            gain = min(person.crossover, TURN_MARGIN / delay)
            return reach.turn(self._clamp(gain * ahead.bearing))
        speed = min(wanted, person.caution * look / delay, ahead.remaining / (2.0 * delay + 1.0))
        curvature = 2.0 * math.sin(ahead.bearing) / max(ahead.distance, 0.2)
        if abs(curvature) * speed > 0.8 * reach.turn_rate:
            speed = 0.8 * reach.turn_rate / abs(curvature)
        return Intent(speed, self._clamp(curvature * speed))

    def _clamp(self, turn_rate: float) -> float:
        return min(max(turn_rate, -self._reach.turn_rate), self._reach.turn_rate)


class Oracle:
    """The reference: the same driving without delay, on the true state. Not a person."""

    DELAY = 0.1  # its own period [s]

    def __init__(self, person: Person, reach: Reach) -> None:
        self._pursuit = Pursuit(person, reach)

    def drive_by_truth(self, route: Route, truth: Truth, stop_before: float) -> Intent:
        """What to ask for, knowing the true state."""
        return self._pursuit.drive(route, truth.state, self.DELAY, stop_before)


STRATEGIES: dict[str, type[Pursuit] | type[Oracle]] = {"pursuit": Pursuit, "oracle": Oracle}
