"""Equal circles in our world and in ir-sim: walls of caparica, the same tick, asked every tick.

ir-sim moves robots by velocity alone and pushes what collides. Ours has forces, friction and
contacts at all times.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from dva_sim.worlds.drives import DriveSpec
from dva_sim.worlds.geo import Pose
from dva_sim.worlds.physics import World
from dva_sim.worlds.site import Site

DT = 0.04  # of a tick, as in every run [s]
SPEED, TURN_RATE = 0.4, 0.5  # each robot drives a circle of 0.8 m, and meets nothing
RADIUS = SPEED / TURN_RATE


def circles(site: Site, count: int) -> list[Pose]:
    """Start poses of circling robots that touch neither walls nor each other."""
    rng, middles = np.random.default_rng(1), []
    while len(middles) < count:
        x, y = site.sample_free(rng, RADIUS + 0.5)
        if all(math.dist((x, y), other) > 2 * RADIUS + 0.8 for other in middles):
            middles.append((x, y))
    return [Pose(x + RADIUS, y, math.pi / 2) for x, y in middles]


def ours(site: Site, starts: list[Pose]) -> Callable[[float], None]:
    """Our world, its robots told again before every tick."""
    world = World(site, DT)
    robots = [world.add_robot(f"robot-{i}", DriveSpec(), start) for i, start in enumerate(starts)]

    def advance(seconds: float) -> None:
        for _ in range(round(seconds / DT)):
            for robot in robots:
                robot.drive(SPEED, TURN_RATE, math.inf)
            world.advance_to(world.time + DT)

    return advance


def theirs(site: Site, starts: list[Pose], folder: Path) -> Callable[[float], None]:
    """Set up the circles in ir-sim: one line per wall, discs of the same size, no drawing."""
    irsim = pytest.importorskip("irsim", reason="ir-sim is not installed: pip install '.[bench]'")
    xmin, ymin, xmax, ymax = site.extent
    spec, document = DriveSpec(), folder / "circles.yaml"
    lines = [f"world: {{width: {xmax - xmin + 2}, height: {ymax - ymin + 2}, step_time: {DT}, "]
    lines += [f"  sample_time: {DT}, offset: [{xmin - 1}, {ymin - 1}], "]
    lines += ["  collision_mode: contact, control_mode: auto}", "robot:"]
    for x, y, heading in starts:
        lines += ["  - kinematics: {name: diff}", f"    state: [{x}, {y}, {heading}]"]
        lines += [f"    shape: {{name: circle, radius: {spec.radius}}}"]
        lines += ["    goal: [1000, 1000, 0]"]
        lines += [f"    mass: {spec.mass}", f"    vel_max: [{spec.max_speed}, 0.53]"]
        lines += [f"    acce: [{spec.max_acceleration}, {spec.max_turn_acceleration}]"]
    lines += ["obstacle:"]
    for x1, y1, x2, y2 in site.walls.tolist():
        vertices = f"[[{x1}, {y1}], [{x2}, {y2}]]"
        lines += [f"  - {{shape: {{name: linestring, vertices: {vertices}}}, state: [0, 0, 0]}}"]
    document.write_text("\n".join(lines))
    env = irsim.make(str(document), display=False, disable_all_plot=True, log_level="ERROR")
    robots = list(range(len(starts)))

    def advance(seconds: float) -> None:
        for _ in range(round(seconds / DT)):
            env.step([np.array([[SPEED], [TURN_RATE]]) for _ in robots], robots)

    return advance
