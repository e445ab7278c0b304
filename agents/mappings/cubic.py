"""An example of an own mapping: copy this file, change it, name it: `mapping: cubic.py:Cubic`.

`dva-sim check mapping cubic.py:Cubic` tells whether it keeps what every mapping promises.
"""

import math

from dva_sim.agents.tilt import Mapping
from dva_sim.agents.tilt.calibration import MAX_TURN_DEG
from dva_sim.agents.tilt.mappings import limited
from dva_sim.kernel.errors import ConfigError


class Cubic(Mapping):
    """Fine around straight on, coarse towards the limit: a blend of the tilt and its cube.

    Args:
        cube: Share of the cube, from 0 (as `absolute`) to below 1.
    """

    integrates = False

    def __init__(self, cube=0.7):
        if not 0 <= cube < 1:
            raise ConfigError(f"option 'cube' is {cube!r}; should be at least 0, below 1")
        self.cube = cube

    def command(self, level, turn, dt):
        """The command now."""
        _, turn = limited(0.0, turn)
        share = turn / MAX_TURN_DEG
        return limited(level, MAX_TURN_DEG * ((1 - self.cube) * share + self.cube * share**3))

    def tilt_for(self, wanted, shown, within):
        """The reading whose command is what is wanted: the real root of the cubic, by Newton."""
        share = goal = min(abs(wanted[1]) / MAX_TURN_DEG, 1.0)
        for _ in range(20):
            slope = 1 - self.cube + 3 * self.cube * share**2
            share -= ((1 - self.cube) * share + self.cube * share**3 - goal) / slope
        return wanted[0], math.copysign(share * MAX_TURN_DEG, wanted[1])
