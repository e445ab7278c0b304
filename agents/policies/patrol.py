"""An example of an own policy: copy this file, change it, and name it as `patrol.py:Patrol`.

`dva-sim check policy patrol.py:Patrol` tells whether it keeps what every policy promises.
"""

from collections.abc import Sequence

import numpy as np

from dva_sim.core.dispatch import Advice, Assignment, MinEta, Relocation, Situation
from dva_sim.kernel.errors import ConfigError


class Patrol(MinEta):
    """The earliest arrival goes; guards with nothing to do walk from station to station.

    Args:
        step: Number of stations that each walk advances by.
    """

    relocates = True  # asks for `situation.cover`: the stations, and how far it is to them

    def __init__(self, step: int = 1) -> None:
        if isinstance(step, bool) or not isinstance(step, int) or step < 1:
            raise ConfigError(f"option 'step' is {step!r}; should be a whole number from 1")
        self.step = step

    def advise(self, situation: Situation, rng: np.random.Generator) -> Sequence[Advice]:
        """Orders first; then a walk for each guard that is idle and not on one."""
        orders = super().advise(situation, rng)
        cover = situation.cover
        if cover is None or not cover.stations:
            return orders
        sent = {order.responder for order in orders if isinstance(order, Assignment)}
        walks = []
        for guard, bound_for in enumerate(cover.bound_for):
            if guard in sent or bound_for is not None:
                continue
            here = int(np.argmin(cover.eta[guard]))
            there = (here + self.step) % len(cover.stations)
            if there != here and np.isfinite(cover.eta[guard, there]):
                walks.append(Relocation(guard, there))
        return [*orders, *walks]
