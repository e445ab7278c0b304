"""Who is near a robot, as far as its sensors can know."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from dva_sim.worlds.physics import PersonBody, RobotBody, World

Point = tuple[float, float]

PERSONAL = 0.45  # where personal distance begins: 18 inches [m] (Hall, see `avoidance`)
KEEP_ROBOT = 0.10  # gap to other robots [m]; assumed


class Nearby(NamedTuple):
    """Somebody in sight and within reach of the robot's sensors.

    Attributes:
        kind: `robot` or `person`.
        name: Robots know each other by name; of people it only tells one from the other.
        x: Where [m].
        y: The same to the north [m].
        vx: How fast it goes east [m/s].
        vy: The same to the north [m/s].
        radius: Of the circle around it [m].
        keep: Gap between surfaces that a moving robot keeps to it [m].
    """

    kind: str
    name: str
    x: float
    y: float
    vx: float
    vy: float
    radius: float
    keep: float


def who_is_near(
    world: World, body: RobotBody, within: float, sees: Callable[[Point, Point], bool]
) -> tuple[Nearby, ...]:
    """Everybody in sight, the nearest first; tracked, so that velocities are known.

    Args:
        world: As of now.
        body: Whose sensors look.
        within: Their reach [m].
        sees: Whether nothing stands between two places.
    """
    here = body.x, body.y
    found = []
    for other, _ in world.neighbours(*here, within):
        if other is not body and sees(here, (other.x, other.y)):
            person = isinstance(other, PersonBody)
            kind, keep = ("person", PERSONAL) if person else ("robot", KEEP_ROBOT)
            found.append(
                Nearby(kind, other.name, other.x, other.y, *other.velocity, other.radius, keep)
            )
    return tuple(found)
