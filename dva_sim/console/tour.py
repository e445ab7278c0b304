"""The places of the guided tour: two robots, and for each a goal ahead on a free straight way."""

from __future__ import annotations

import math
from typing import Any

from dva_sim.simulation.full.run import Run

FAR, LEAST = 7.0, 3.0  # of a goal, along the way [m]
RADIUS = 1.0  # of the place that counts as the goal [m]
STEP = 0.25  # [m]
ROOM = 0.15  # on both sides of the robot, beside its own radius [m]
HEADINGS = 32  # that are tried


def tour_of(run: Run, things: list[dict[str, Any]]) -> dict[str, Any] | None:
    """Two robots and their goals; None where there are not two with a way."""
    robots = list(run.field.robots.values())
    if len(robots) < 2:
        return None
    goals = []
    for robot in robots[:2]:
        pose = robot.body.pose()
        goal = goal_ahead(run, (pose.x, pose.y), pose.heading, robot.body.radius)
        if goal is None:
            return None
        goals.append([round(goal[0], 2), round(goal[1], 2)])
    numbers = [thing["i"] for thing in things if thing["kind"] == "robot"][:2]
    return {"robots": numbers, "goals_m": goals, "radius_m": RADIUS}


def goal_ahead(
    run: Run, here: tuple[float, float], heading: float, radius: float
) -> tuple[float, float] | None:
    """The end of the longest free straight way, ahead rather than to a side, up to `FAR` [m]."""
    best: tuple[float, tuple[float, float]] | None = None
    for number in range(HEADINGS):
        off = 2.0 * math.pi * ((number + 1) // 2) / HEADINGS * (-1) ** number
        way = _free_way(run, here, heading + off, radius + ROOM)
        end = (here[0] + way * math.cos(heading + off), here[1] + way * math.sin(heading + off))
        worth = way - abs(off)
        if way >= LEAST and (best is None or worth > best[0]):
            best = worth, end
    return None if best is None else best[1]


def _free_way(run: Run, here: tuple[float, float], heading: float, clearance: float) -> float:
    """How far one gets straight on [m]."""
    site, way = run.stage.site, 0.0
    while way + STEP <= FAR:
        far = way + STEP
        x, y = here[0] + far * math.cos(heading), here[1] + far * math.sin(heading)
        if not site.is_free(x, y, clearance if far > 1.0 else 0.0):
            break
        way = far
    return way
