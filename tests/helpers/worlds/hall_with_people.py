"""Bare halls with people in them, in virtual time and in the physics, for tests."""

import itertools
import math
from collections.abc import Callable, Sequence

import numpy as np
import shapely

from dva_sim.agents.people.pedestrian_avoidance import USUAL
from dva_sim.agents.people.walking import Walking
from dva_sim.kernel.clock import Clock
from dva_sim.worlds.geo import Pose
from dva_sim.worlds.maps import rasterise
from dva_sim.worlds.physics import World
from dva_sim.worlds.planning import Planner
from dva_sim.worlds.site import DEFAULT_FRAME, Site

Wall = tuple[float, float, float, float]
Point = tuple[float, float]


def hall(
    width: float, height: float, walls: Sequence[Wall] = (), doors: Sequence[Wall] = ()
) -> Site:
    """A hall with a corner at the origin, some walls and some doors in it [m]."""
    corners = [(0, 0), (width, 0), (width, height), (0, height), (0, 0)]
    border = [(*a, *b) for a, b in itertools.pairwise(corners)]
    lines = np.array([*border, *walls], float)
    return Site(
        name="hall",
        frame=DEFAULT_FRAME,
        walls=lines,
        doors=np.array(doors, float).reshape(-1, 4),
        extent=(0.0, 0.0, width, height),
        grid=rasterise(shapely.box(0, 0, width, height), lines, 0.05),
    )


def two_rooms(door: float, width: float = 12.0, height: float = 10.0) -> Site:
    """A hall that a wall with one door of that width in its middle parts in two [m]."""
    x, low, high = width / 2, (height - door) / 2, (height + door) / 2
    walls = [(x, 0, x, low), (x, high, x, height)]
    return hall(width, height, walls, [(x, low, x, high)])


class People:
    """Some people in a hall."""

    def __init__(self, site: Site) -> None:
        self.site, self.clock = site, Clock()
        self.world, self.planner = World(site, 0.04), Planner(site, 0.3)
        self.walkings: list[Walking] = []
        self.arrived: dict[int, float] = {}
        self.gave_up: dict[int, float] = {}

    def add(self, place: Point, goal: Point | None = None, speed: float = 1.34) -> Walking:
        """Somebody who stands there, or walks from there to a goal [m, m/s]."""
        number = len(self.walkings)
        pose = Pose(*place, 0.0)
        body = self.world.add_person(f"person-{number}", pose, radius=USUAL.radius_m)
        walking = Walking(
            self.clock, self.planner, self.world, body, speed=speed, doors=self.site.doors
        )
        self.walkings.append(walking)
        if goal is not None:
            now = lambda: self.clock.now  # noqa: E731
            arrived = lambda: self.arrived.setdefault(number, now())  # noqa: E731
            blocked = lambda: self.gave_up.setdefault(number, now())  # noqa: E731
            assert walking.go(goal, arrived, blocked)
        return walking

    def run_until(self, done: Callable[[], bool], limit: float, step: float = 0.1) -> None:
        """Let time pass until something is true, at most up to a time [s]."""
        while not done() and self.clock.now < limit:
            self.clock.run(self.clock.now + step)
            self.world.advance_to(self.clock.now)

    def all_settled(self) -> bool:
        return not any(walking.walks for walking in self.walkings)


def gap(first: Walking, second: Walking) -> float:
    """Return the gap between two bodies [m]; negative where they overlap."""
    return math.dist(first.place, second.place) - first.body.radius - second.body.radius
