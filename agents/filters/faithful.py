"""An example of an own filter: copy this file, change it, name it: `filter: faithful.py:Faithful`.

`dva-sim check filter faithful.py:Faithful` tells whether it keeps what every filter promises.
"""

import math

from dva_sim.agents.tilt import Filter
from dva_sim.kernel.errors import ConfigError


class Faithful(Filter):
    """A low-pass that lets go: small changes are smoothed, large ones followed at once.

    Args:
        period: Mean time between two samples [s].
        time_constant_s: In which small changes are followed [s].
        jump: A change that is followed at once: so many levels, or three times as many degrees
            per second.
    """

    def __init__(self, period, time_constant_s=0.3, jump=3.0):
        super().__init__(period)
        if not time_constant_s > 0:
            raise ConfigError(f"option 'time_constant_s' is {time_constant_s!r}; should be above 0")
        self.keep, self.jump = math.exp(-period / time_constant_s), jump
        self.level = self.turn = 0.0

    def add(self, sample):
        """Take the next sample."""
        self.level = self.follow(self.level, sample[0], self.jump)
        self.turn = self.follow(self.turn, sample[1], 3 * self.jump)

    def follow(self, value, sample, jump):
        """The new value of one axis."""
        keep = self.keep if abs(sample - value) < jump else 0.0
        return sample + (value - sample) * keep

    def value(self):
        """The filtered value now."""
        return self.level, self.turn

    @property
    def age(self):
        """Mean age of the value [samples], of an input that rises slowly."""
        return self.keep / (1 - self.keep)
