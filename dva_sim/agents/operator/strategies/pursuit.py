"""Steering by points ahead on the route: by one, or by a near and a far one.

The published law of two points gives increments of a car's steering: k_f d(theta_f) +
k_n d(theta_n) + k_I min(theta_n, theta_max) dt, of the visual directions theta of a far and a near
point. A robot is steered by its turn rate, which takes the place of the steering angle, and it is
slower by far. What is kept are proportions, nothing is fitted:

- of the three gains, 16 : 4 : 3/s; their size follows from the person's own crossover gain, under
  delay within its margin, which k_f + k_n becomes;
- of the near to the far point, 0.37 s to 0.93 s ahead; the far point is the look-ahead that the
  person takes under delay, and times scale with it.

References:
    D. D. Salvucci, R. Gray: A two-point visual control model of steering. Perception 33 (2004).
    D. D. Salvucci: Modeling driver behavior in a cognitive architecture. Human Factors 48 (2006):
    gains 16, 4, 3 and the bound of 0.07, as in the driver model published with it.
    M. Land, J. Horwood: Which parts of the road guide steering? Nature 377 (1995): the two points.
    P. Gawthrop et al.: Intermittent control: a computational theory of human control. Biological
    Cybernetics 104 (2011).
"""

from __future__ import annotations

import math

from typing_extensions import override

from dva_sim.agents.operator.strategies.base import Strategy
from dva_sim.agents.population import Person
from dva_sim.agents.route_following import (
    Ahead,
    Intent,
    PurePursuit,
    Reach,
    Route,
    View,
    gain_at,
    make_intent,
    wrap,
)

FAR_GAIN = 16.0  # source: Salvucci 2006: gain
NEAR_GAIN = 4.0  # source: Salvucci 2006: gain
INTEGRAL = 3.0  # source: Salvucci 2006: gain [1/s]
NEAR_TIME = 0.37  # source: Salvucci, Gray 2004: to the near point, on the road [s]
FAR_TIME = 0.93  # source: Salvucci, Gray 2004: to the far point, on the road [s]
LARGEST = 0.07  # source: Salvucci 2006: direction of the near point that counts at most [rad]


class Pursuit(PurePursuit, Strategy):
    """Steers towards a point ahead on the route (pure pursuit)."""


class TwoPoint(Pursuit):
    """Corrects the turn rate by changes in the directions of a near and a far point.

    Speed, stopping and turning on the spot are those of `Pursuit`, and so is pointing.
    """

    def __init__(self, person: Person, reach: Reach) -> None:
        super().__init__(person, reach)
        self._begin()

    @override
    def drive(self, route: Route, view: View, stop_before: float) -> Intent:
        intent = super().drive(route, view, stop_before)
        if self._turning:
            self._begin()
        return intent

    def _begin(self) -> None:
        """Begin as if it had driven straight along a straight road so far."""
        self._near = self._far = self._steering = self._turn_rate = 0.0
        self._corrected = -math.inf

    def _along(self, route: Route, view: View, ahead: Ahead, look: float, speed: float) -> Intent:
        speed = super()._along(route, view, ahead, look, speed).speed
        passed = view.now - self._corrected
        cycle = self._steering_habits.cycle_s
        if passed >= cycle - 1e-6:
            self._corrected = view.now
            self._correct(route, view, ahead, look, speed, min(passed, 2.0 * cycle))
        return make_intent(speed, self._clamp(self._turn_rate))

    def _correct(
        self, route: Route, view: View, ahead: Ahead, look: float, speed: float, passed: float
    ) -> None:
        """Correct once, `passed` [s] after the last correction."""
        seen = view.seen
        person = self.person
        x, y = route.point_at(route.length - ahead.remaining + look * NEAR_TIME / FAR_TIME)
        near = wrap(math.atan2(y - seen.y, x - seen.x) - seen.heading)
        counted = min(max(near, -LARGEST), LARGEST)
        slower = FAR_TIME * speed / look  # than on the road
        change = FAR_GAIN * (ahead.bearing - self._far) + NEAR_GAIN * (near - self._near)
        change += INTEGRAL * slower * counted * passed
        self._steering += change / (FAR_GAIN + NEAR_GAIN)
        # The gain is applied to the sum: it changes while the delay is being learnt.
        self._turn_rate = gain_at(person.crossover, person.margin, view.delay) * self._steering
        self._near = near
        self._far = ahead.bearing
