"""The places of the guided tour: two robots, and for each a goal ahead on a free straight way.

One person drives both by the same input, so that both goals lie alike: as far away, and as much to
a side. Goals straight ahead are taken before others, far ones before near ones.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

from dva_sim.agents.robot.robot import RobotAgent
from dva_sim.simulation.full.run import Run
from dva_sim.worlds.site import Site

FAR, LEAST = 8.0, 4.0  # of a goal [m]
SIDE_COSTS = 3.0  # a goal by so much nearer is as good as one a radian more to a side [m]
RADIUS = 1.0  # of the place that counts as the goal [m]
STEP, TURN = 0.2, math.radians(5.0)
ROOM = 0.15  # on both sides of a robot, beside its own radius [m]
BASE = 1.0  # so near where it stands, a robot has room anyway [m]


def tour_of(run: Run, things: list[dict[str, Any]]) -> dict[str, Any] | None:
    """Two robots and their goals; None where there are no two with a way."""
    site, robots = run.stage.site, list(run.field.robots.values())
    numbers = [thing["i"] for thing in things if thing["kind"] == "robot"]
    for one, other in pairwise(range(len(robots))):
        pair = robots[one], robots[other]
        found = goal_of(site, pair)
        if found is not None:
            goals = [_ahead(robot, *found) for robot in pair]
            return {
                "robots": [numbers[one], numbers[other]],
                "goals_m": [[round(x, 2), round(y, 2)] for x, y in goals],
                "radius_m": RADIUS,
            }
    return None


def goal_of(site: Site, robots: tuple[RobotAgent, ...]) -> tuple[float, float] | None:
    """How far [m] and how much to the left [rad] a goal lies that all of them can go to."""
    best: tuple[float, float, float] | None = None
    for number in range(round(math.pi / TURN)):
        for side in {number * TURN, -number * TURN}:
            way = min(_free_way(site, robot, side) for robot in robots)
            worth = way - SIDE_COSTS * abs(side)
            if way >= LEAST and (best is None or worth > best[0]):
                best = worth, way, side
    return None if best is None else best[1:]


def _ahead(robot: RobotAgent, far: float, side: float) -> tuple[float, float]:
    pose = robot.body.pose()
    angle = pose.heading + side
    return pose.x + far * math.cos(angle), pose.y + far * math.sin(angle)


def _free_way(site: Site, robot: RobotAgent, side: float) -> float:
    """How far a robot gets straight on [m]."""
    way = 0.0
    while way + STEP <= FAR + 1e-9:
        x, y = _ahead(robot, way + STEP, side)
        if not site.is_free(x, y, robot.body.radius + ROOM if way > BASE else 0.0):
            break
        way += STEP
    return way
