"""What people do when their robot's collision guard holds it back: close quarters, step by step."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from dva_sim.agents.camera import Observation
from dva_sim.agents.operator.person import Person
from dva_sim.agents.operator.strategies import SHORTEST, Intent, Reach, gain_at
from dva_sim.agents.steering import Route
from dva_sim.worlds.planning import Planner

Floats = NDArray[np.float64]
Point = tuple[float, float]

LOOK = 0.35  # look-ahead [m]; assumed
TURN_FROM, TURN_UNTIL = 0.2, 0.1  # bearing at which one stops to turn, and drives on [rad]
SLOWLY = 0.3  # share of the top speed; assumed
CRAWL = 0.1  # slower one would not see whether it moves [m/s]; assumed
HELD_FOR = 1.5  # held back for so long, beside the delay, a person understands it [s]; assumed
STEP_OUT = 0.5  # how far one goes to where there is room [m]; assumed
HEADINGS = 16  # looked at for that
CLEAR = 1.0  # driven so far, a person drives as before [m]; assumed
ASKED, STILL = 0.05, 0.02  # asked for more, seen less: that is being held back [m/s]


def roomiest(here: Point, planner: Planner) -> Point:
    """The place a step away that is farthest from walls, and is reached straight [m]."""
    angles = np.arange(HEADINGS) * (2.0 * math.pi / HEADINGS)
    ring = np.array(here) + STEP_OUT * np.stack([np.cos(angles), np.sin(angles)], 1)
    half = 0.5 * (ring + np.array(here))
    least = np.minimum(planner.room_at(half), planner.room_at(ring))
    x, y = ring[int(least.argmax())].tolist()
    return x, y


class Careful:
    """Notices that the robot is held back, and then follows a new way closely for a moment.

    Args:
        person: Gain and caution.
        reach: Limits of the robot.
    """

    def __init__(self, person: Person, reach: Reach) -> None:
        self._person, self._reach = person, reach
        self._held, self._last_look = 0.0, math.inf
        self._from: tuple[float, float] | None = None
        self._turning = self._again = False

    @property
    def on(self) -> bool:
        """Whether the person drives carefully now."""
        return self._from is not None

    def notice(self, now: float, seen: Observation, asked: float, delay: float) -> bool:
        """A frame is perceived: True if from now on the person drives carefully, on a new way.

        Args:
            now: [s]
            seen: The frame, as the person judges it.
            asked: Speed that the person asks for [m/s].
            delay: What the person takes the whole delay to be [s].
        """
        here = seen.x, seen.y
        if self._from is not None and math.dist(here, self._from) > CLEAR:
            self._from = None
        if seen.speed >= STILL:
            self._held = 0.0
        elif asked > ASKED:  # while turning on the spot is asked for, nothing is learnt
            self._held += max(now - self._last_look, 0.0)
        self._last_look = now
        if self._held <= HELD_FOR + 2.0 * delay:
            return False
        self._again = self._from is not None
        self._held, self._from = 0.0, here
        return True

    def way(self, here: Point, goal: Point, planner: Planner) -> Floats | None:
        """The new way `(n, 2)` [m]; who is held back again first goes to where there is room."""
        via = roomiest(here, planner) if self._again else here
        points = planner.path(via, goal)
        return points if points is None or not self._again else np.vstack([here, points])

    def drive(self, route: Route, seen: Observation, delay: float, stop_before: float) -> Intent:
        """See `Strategy`: turn on the spot towards a point close by on the way, then go there."""
        ahead = route.ahead(seen.x, seen.y, seen.heading, LOOK)
        most = self._reach.turn_rate
        gain = gain_at(self._person.crossover, self._person.margin, delay)
        turn = min(max(gain * ahead.bearing, -most), most)
        self._turning = abs(ahead.bearing) > (TURN_UNTIL if self._turning else TURN_FROM)
        speed = min(SLOWLY * self._reach.speed, self._person.caution * LOOK / max(delay, SHORTEST))
        speed = max(speed, CRAWL)
        stands = self._turning or ahead.remaining < stop_before
        return Intent(0.0 if stands else speed, turn)
