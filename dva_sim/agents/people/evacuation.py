"""The way out of one person: chosen, looked along while it is walked, and chosen again.

What guards and bystanders have in common: legs, and what the air does to them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Final

from dva_sim.agents.device import do_nothing
from dva_sim.agents.people.escape import choose_escape
from dva_sim.agents.people.exposure import Exposure
from dva_sim.agents.people.walking import Walking
from dva_sim.kernel.clock import Clock
from dva_sim.worlds.hazards import Dose
from dva_sim.worlds.planning import Planner

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
