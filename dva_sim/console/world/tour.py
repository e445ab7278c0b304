"""The places of the guided tour: two robots, and for each a goal at the end of a free straight way.

One person drives one after the other, so that both goals lie alike from where the robots stand
now: as far away, and as much to a side. Going straight on takes as long under any pattern, turning
to something and stopping there does not: goals behind or beside a robot come before those ahead.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import pairwise, product
from typing import NamedTuple

from dva_sim.agents.robot.robot import RobotAgent
from dva_sim.console.wire.seats import TourPlan
from dva_sim.simulation.full.run import Run
from dva_sim.worlds.site import Site

FAR, LEAST = 5.0, 3.0  # of a goal [m]
RADIUS = 0.6  # of the ring in which a robot has to stand [m]
STEP = 0.2
TURN = math.radians(15.0)
TURNS_FROM_RAD = math.radians(45.0)  # from here on a goal asks for a turn
WIDE, NARROW = (0.45, 0.3), (0.15,)  # room on both sides of a robot, beside its own radius [m]
BASE = 1.0  # so near where it stands, a robot has room anyway [m]


class FreeWay(NamedTuple):
    """A straight way from where a robot stands.

    Attributes:
        length: [m]
        side: From the robot's heading to it, to the left positive [rad].
    """

    length: float
    side: float


def tour_of(run: Run, numbers: Mapping[str, int]) -> TourPlan | None:
    """Return two robots and their goals, from where they stand now; None: no two have such a way.

    Args:
        numbers: Numbers of the robots, by id.
    """
    site = run.stage.site
    for pair in pairwise(run.field.robots.values()):
        way = way_of(site, pair)
        if way is not None:
            goals = [_ahead(robot, way) for robot in pair]
            return {
                "robots": [numbers[robot.device.id_tag] for robot in pair],
                "goals_m": [[round(x, 2), round(y, 2)] for x, y in goals],
                "radius_m": RADIUS,
                "length_m": round(way.length, 2),
                "side_rad": round(way.side, 3),
            }
    return None


def way_of(site: Site, robots: tuple[RobotAgent, ...]) -> FreeWay | None:
    """Return the longest way that all have: with room beside it and with a turn, if possible."""
    for rooms, turned in product((WIDE, NARROW), (True, False)):
        for room in rooms:
            sides = [side for side in _sides() if (abs(side) >= TURNS_FROM_RAD) is turned]
            ways = [
                FreeWay(min(_free(site, robot, side, room) for robot in robots), side)
                for side in sides
            ]
            best = max(ways, key=lambda way: way.length)
            if best.length >= LEAST:
                return best
    return None


def _sides() -> list[float]:
    return [number * TURN for number in range(-11, 13)]


def _ahead(robot: RobotAgent, way: FreeWay) -> tuple[float, float]:
    pose = robot.body.pose()
    angle = pose.heading + way.side
    return pose.x + way.length * math.cos(angle), pose.y + way.length * math.sin(angle)


def _free(site: Site, robot: RobotAgent, side: float, room: float) -> float:
    """Return how far a robot gets on a straight line to a side [m]."""
    way = 0.0
    while way + STEP <= FAR + 1e-9:
        x, y = _ahead(robot, FreeWay(way + STEP, side))
        if not site.is_free(x, y, robot.body.radius + room if way > BASE else 0.0):
            break
        way += STEP
    return way
