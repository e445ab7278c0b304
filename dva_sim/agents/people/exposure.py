"""What a person goes through: the air around it twice a second, its dose, and its pace in it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from dva_sim.agents.device import do_nothing
from dva_sim.agents.people.escape import DEADLY, UNTENABLE, Limit, is_deadly, is_untenable, strain
from dva_sim.agents.people.walking import Walking
from dva_sim.kernel.clock import Clock
from dva_sim.worlds.hazards import CLEAR, Conditions, Dose, pace_in_smoke, pace_in_water

PERIOD: Final = 0.5  # between two looks at the air [s]
HURT: Final = 0.3
"""A dose beyond which a guard works no more; 1 stops half of all people (ISO 13571, which takes
0.3 as what all but the most susceptible still bear)."""

Air = Callable[[float, float, float], Conditions]


def clean_air(x: float, y: float, time: float) -> Conditions:
    """The air where there are no hazards."""
    return CLEAR


class Exposure:
    """One person in the air of a site.

    Args:
        clock: The run's.
        walking: Where the person is; smoke and water slow it down.
        air: What it is like at a place [m] and time [s].

    Attributes:
        dose: Of heat and poison, so far.
        conditions: What it was like when it was looked at last.
    """

    def __init__(self, clock: Clock, walking: Walking, air: Air = clean_air) -> None:
        self._clock, self._walking, self._air = clock, walking, air
        self.dose, self.conditions = Dose(), CLEAR
        self._over = self._is_outdoors = False

    def start(self, then: Callable[[], object] = do_nothing) -> None:
        """Look at the air from now on, and call `then` each time."""
        if self._air is not clean_air:
            self._clock.every(PERIOD, lambda: self._look(then))

    def end(self) -> None:
        """The person is out of it."""
        self._over = True

    def step_out(self) -> None:
        """The person stands just beyond an exit, in clean air, until it walks again."""
        self._is_outdoors = True

    def _look(self, then: Callable[[], object]) -> bool:
        """Sample; False when it is over."""
        if self._over:
            return False
        x, y = self._walking.place
        self._is_outdoors = self._is_outdoors and not self._walking.walks
        self.conditions = CLEAR if self._is_outdoors else self._air(x, y, self._clock.now)
        self.dose.add(self.conditions, PERIOD)
        in_smoke = pace_in_smoke(self.conditions.extinction)
        self._walking.pace = in_smoke * pace_in_water(self.conditions.water)
        then()
        return not self._over

    @property
    def is_too_much(self) -> bool:
        """Whether the person has to leave: the air is untenable, or its dose is."""
        return self.is_hurt or is_untenable(self.conditions)

    @property
    def is_hurt(self) -> bool:
        """Whether the dose is more than somebody goes on working with."""
        return max(self.dose.heat, self.dose.toxic) >= HURT

    def is_bad(self, place: tuple[float, float]) -> bool:
        """Whether it is untenable at a place [m] now."""
        return is_untenable(self._air(*place, self._clock.now))

    def is_deadly(self, place: tuple[float, float]) -> bool:
        """Whether nobody would go through a place [m] now."""
        return is_deadly(self._air(*place, self._clock.now))

    @property
    def limits(self) -> tuple[Limit, Limit]:
        """What to keep off: what is untenable, or where that cannot be, what is deadly."""
        return self._strain(UNTENABLE), self._strain(DEADLY)

    def _strain(self, most: Conditions) -> Limit:
        """How much of some limit it is at a place now."""
        return lambda place: strain(self._air(*place, self._clock.now), most)
