"""An example of an own way of steering: copy it, change it, name it as `stepwise.py:Stepwise`.

`dva-sim check operator stepwise.py:Stepwise` tells whether it keeps what every operator promises.
"""

from dva_sim.agents.operator.strategies import Intent, Person, Reach, Route, Strategy, View, gain_at
from dva_sim.kernel.errors import ConfigError


class Stepwise(Strategy):
    """Never turns and drives at once: stops, turns to a point ahead, and drives there straight.

    Under delay the person drives no faster than it trusts. Pointing is as people do it.

    Args:
        person: Person with gain, caution and pace.
        reach: Limits of the robot.
        look_m: Distance of the point ahead [m].
    """

    def __init__(self, person: Person, reach: Reach, look_m: float = 1.0) -> None:
        super().__init__(person, reach)
        if not look_m > 0:
            raise ConfigError(f"option 'look_m' is {look_m!r}; should be above 0")
        self.look, self.turning = look_m, False

    def drive(self, route: Route, view: View, stop_before: float) -> Intent:
        """Turn until the point is ahead, then drive until it is not."""
        seen, person, delay = view.seen, self.person, max(view.delay, 0.01)
        ahead = route.ahead(seen.x, seen.y, seen.heading, self.look)
        if ahead.remaining < stop_before:
            return Intent(0.0, 0.0)
        self.turning = abs(ahead.bearing) > (0.05 if self.turning else 0.25)
        if self.turning:
            turn = gain_at(person.crossover, person.margin, delay) * ahead.bearing
            most = self.reach.turn_rate
            return self.reach.turn(min(max(turn, -most), most))
        fastest = person.caution * self.look / delay
        slower = ahead.remaining / (2.0 * delay + 1.0)
        return Intent(min(person.pace * self.reach.speed, fastest, slower), 0.0)
