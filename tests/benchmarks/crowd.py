"""Cost of a crowd relative to real time. Fewer robots: `make bench`."""

import math
import time
from pathlib import Path

import numpy as np
from benchmarks.goals import goal

from dva_sim.worlds.drives import DriveSpec
from dva_sim.worlds.geo import Pose
from dva_sim.worlds.physics import World, hall

DT = 0.04  # of a tick, as in every run [s]
ROOM, DOOR = 4.0, 1.2  # of an office [m]


def offices(across):
    """A block of square offices, each with a door in the middle of every wall."""
    side, jamb, walls = across * ROOM, (ROOM - DOOR) / 2, []
    for line in range(1, across):
        at = line * ROOM
        for room in range(across):
            for low in (room * ROOM, room * ROOM + jamb + DOOR):
                walls += [(at, low, at, low + jamb), (low, at, low + jamb, at)]
    return hall(side, side, walls)


def a_thousand_robots(_: Path) -> None:
    """CPU seconds for a simulated second of robots that drive, turn about, and meet."""
    site, rng = offices(40), np.random.default_rng(1)
    world = World(site, DT)
    while len(world.robots) < 1000:
        x, y = site.sample_free(rng, 0.35)
        if not world.neighbours(x, y, 0.65):
            pose = Pose(x, y, float(rng.uniform(-math.pi, math.pi)))
            world.add_robot(f"robot-{len(world.robots)}", DriveSpec(), pose)

    def second():
        """One simulated; what it costs [s]."""
        began = time.process_time()
        for robot in world.robots:
            robot.drive(0.5, float(rng.uniform(-0.5, 0.5)), math.inf)
        world.advance_to(world.time + 1.0)
        return time.process_time() - began

    cost = min([second() for _ in range(12)][3:])  # at first nobody has met anybody
    way = np.mean([robot.distance for robot in world.robots])
    met = sum(robot.contacts > 0 for robot in world.robots)
    print(f"\n1000 robots, {len(site.walls)} walls: {1 / cost:.1f} times real time; ", end="")
    print(f"driven {way:.1f} m on average, {met} have met something")
    goal("CPU seconds for a simulated second", cost, most=1.0)
    assert way > 1.0
    assert met > 20
