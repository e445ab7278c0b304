"""Pure pursuit: aims at a point ahead on the route, the farther the longer the delay.

References:
    R. C. Coulter: Implementation of the pure pursuit path tracking algorithm. CMU-RI-TR-92-01,
    1992. T. B. Sheridan: Telerobotics, Automation, and Human Supervisory Control. MIT Press, 1992
    (driving under delay).
"""

from __future__ import annotations

import math

from dva_sim.agents.operator.person import Person
from dva_sim.agents.operator.strategies.base import Intent, Reach, Strategy, View
from dva_sim.agents.operator.strategies.cursor import SHORTEST, gain_at
from dva_sim.agents.route_following import Ahead, Route

NEAREST_LOOK, FARTHEST_LOOK = 0.8, 1.8  # look-ahead inside a building [m]
TURN_FROM, TURN_UNTIL = 0.9, 0.25  # bearing at which one stops to turn, and drives on [rad]
IN_CURVES = 0.8  # share of the highest turn rate that one plans a curve with


class Pursuit(Strategy):
    """Aims at a point ahead on the route, the farther the longer the delay.

    The look-ahead is at least the way covered during the delay over the person's caution (0.3):
    on a straight route the pursuit is stable up to 0.52. Where a building allows no such
    look-ahead, the person slows down instead. Where the route bends sharply it stops to turn.
    """

    def __init__(self, person: Person, reach: Reach) -> None:
        super().__init__(person, reach)
        self._turning = False

    def drive(self, route: Route, view: View, stop_before: float) -> Intent:
        """See `Strategy`."""
        person, reach, seen = self.person, self.reach, view.seen
        delay = max(view.delay, SHORTEST)
        wanted = person.pace * reach.speed
        look = min(max(wanted * delay / person.caution, NEAREST_LOOK), FARTHEST_LOOK)
        ahead = route.ahead(seen.x, seen.y, seen.heading, look)
        limit = TURN_UNTIL if self._turning else TURN_FROM
        self._turning = abs(ahead.bearing) > limit
        is_there = ahead.remaining < stop_before
        if is_there and reach.radius > 0.0:
            return Intent(0.0, 0.0)  # a car cannot turn towards what it has come to see
        if self._turning or is_there:
            gain = gain_at(person.crossover, person.margin, delay)
            return reach.turn(self._clamp(gain * ahead.bearing))
        speed = min(wanted, person.caution * look / delay, ahead.remaining / (2.0 * delay + 1.0))
        return self._along(route, view, ahead, look, speed)

    def _along(self, route: Route, view: View, ahead: Ahead, look: float, speed: float) -> Intent:
        """Towards the point ahead on an arc, slower where that would be too sharp.

        Args:
            route: The way to go.
            view: What is seen, and when.
            ahead: The point ahead.
            look: How far ahead on the route it lies [m].
            speed: As fast as one may [m/s].
        """
        curvature = 2.0 * math.sin(ahead.bearing) / max(ahead.distance, 0.2)
        most = IN_CURVES * self.reach.turn_rate
        if abs(curvature) * speed > most:
            speed = most / abs(curvature)
        return Intent(speed, self._clamp(curvature * speed))

    def _clamp(self, turn_rate: float) -> float:
        return min(max(turn_rate, -self.reach.turn_rate), self.reach.turn_rate)
