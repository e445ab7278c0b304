"""What guards and bystanders have in common: legs, and what the air does to them."""

from __future__ import annotations

from dva_sim.agents.exposure import Exposure
from dva_sim.agents.walking import Walking
from dva_sim.worlds.hazards import Dose


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
