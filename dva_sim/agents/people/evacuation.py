"""What a person goes through: the air around it twice a second, its dose, and its pace in it.

The way out of one person: chosen, looked along while it is walked, and chosen again.

What guards and bystanders have in common: legs, and what the air does to them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Final

from dva_sim.agents.device import do_nothing
from dva_sim.agents.people.escape import (
    DEADLY,
    UNTENABLE,
    Limit,
    choose_escape,
    is_deadly,
    is_untenable,
    strain,
)
from dva_sim.agents.people.walking import Walking
from dva_sim.kernel.clock import Clock
from dva_sim.worlds.hazards import CLEAR, Conditions, Dose, pace_in_smoke, pace_in_water
from dva_sim.worlds.planning import Planner

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


THROUGH: Final = 0.8  # so near to the middle of an exit one is through [m]
CHOOSES_AGAIN: Final = 2.0  # no sooner than this after the last choice of a way [s] ...
AT_LATEST: Final = 16.0  # ... and twice as long after each that mended nothing, up to this [s]
LOOKS_AHEAD: Final = 6.0  # along its way, for what nobody endures [m]

Point = tuple[float, float]


class WayOut:
    """Leads a person to the nearest safe place, as long as there is a way.

    Who finds none stands still, and looks for one again and again.

    Args:
        clock: The run's.
        planner: It knows the building.
        walking: The person's legs.
        exposure: What it goes through, and what it keeps off.
        refuges: Where it is safe now [m].
    """

    def __init__(
        self,
        clock: Clock,
        planner: Planner,
        walking: Walking,
        exposure: Exposure,
        refuges: Callable[[], Sequence[Point]],
    ) -> None:
        self._clock, self._planner, self._walking = clock, planner, walking
        self._exposure, self._refuges = exposure, refuges
        self._arrived: Callable[[], object] = do_nothing
        self._chosen, self._pause = -math.inf, CHOOSES_AGAIN
        self._choices = 0

    def leave(self, arrived: Callable[[], object]) -> None:
        """Set out; `arrived` is called at a safe place."""
        self._arrived, self._pause = arrived, CHOOSES_AGAIN
        self._choose()

    def end(self) -> None:
        """Stand still for good."""
        self._choices += 1
        self._walking.stop()

    def look_ahead(self) -> None:
        """Choose again if what is next on the way has become bad; at once, if deadly."""
        ahead = self._walking.places_ahead(1.0, LOOKS_AHEAD)
        since = self._clock.now - self._chosen
        if since < CHOOSES_AGAIN or not ahead:
            return
        if not any(map(self._exposure.is_bad, ahead)):
            self._pause = CHOOSES_AGAIN
        elif since >= self._pause or any(map(self._exposure.is_deadly, ahead)):
            self._choose()

    def _choose(self) -> None:
        """Set out for the refuge that is best now; if none can be reached, wait."""
        self._chosen, self._choices = self._clock.now, self._choices + 1
        pause, self._pause = self._pause, min(2.0 * self._pause, AT_LATEST)
        here, limits = self._walking.place, self._exposure.limits
        escape = choose_escape(self._planner, here, self._refuges(), limits)
        if escape is None or not self._walking.go(
            escape.goal,
            self._arrived,
            self._choose,
            lambda at: math.dist(at, escape.goal) < THROUGH,
            escape.avoid,
        ):
            self._walking.stop()
            self._clock.call_after(pause, self._choose_again, self._choices)

    def _choose_again(self, choices: int) -> None:
        """Try once more, unless something else has been chosen since."""
        if choices == self._choices:
            self._choose()


class OnFoot:
    """A person on foot.

    Args:
        walking: Its legs.
        exposure: What it goes through.
    """

    def __init__(self, walking: Walking, exposure: Exposure) -> None:
        self.walking, self.exposure = walking, exposure

    @property
    def x(self) -> float:
        """Where the person is, or was last [m]."""
        return self.walking.place[0]

    @property
    def y(self) -> float:
        """Where the person is, or was last [m]."""
        return self.walking.place[1]

    @property
    def heading(self) -> float:
        """Where it looks [rad]."""
        return self.walking.heading

    @property
    def dose(self) -> Dose:
        """Of heat and poison, so far."""
        return self.exposure.dose
