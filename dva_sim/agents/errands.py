"""What a robot is sent to do, in metres, and how it drives when nobody else does."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from dva_sim.agents.modes import Mission
from dva_sim.agents.operator.person import Population, median_person
from dva_sim.protocol import messages as m

Point = tuple[float, float]

# The robot's own loop has no delay to speak of: a brisk, steady driver.
AUTOPILOT = replace(median_person(Population()), crossover=2.0, pace=1.0)


@dataclass(frozen=True)
class Errand:
    """A mission in metres.

    Attributes:
        goals: Places of a lap, in order [m].
        laps: How many; 0: without end.
        event: Kind of the event to be looked at, if there is one.
        home: Whether it is the way home.
    """

    goals: tuple[Point, ...]
    laps: int = 1
    event: str | None = None
    home: bool = False

    @classmethod
    def of(cls, mission: Mission, to_xy: Callable[[float, float], Point], base: Point) -> Errand:
        """The errand that a message asks for; `base` is the robot's own [m]."""
        match mission:
            case m.Inspect():
                place = to_xy(mission.position.latitude, mission.position.longitude)
                return cls((place,), event=mission.kind)
            case m.ReturnToBase():
                return cls((base,), home=True)
        goals = tuple(to_xy(p.latitude, p.longitude) for p in mission.waypoints)
        return cls(goals, mission.laps if isinstance(mission, m.Patrol) else 1)
