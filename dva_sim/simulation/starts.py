"""Where robots and guards begin: at the site's bases and posts, or a given way from the event."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from dva_sim.errors import ConfigError
from dva_sim.simulation.stage import Stage, place_of
from dva_sim.worlds.geo import Pose
from dva_sim.worlds.site import FOOTPRINT

TRIES = 200
APART = 1.5  # between the middles of two who begin [m]

Point = tuple[float, float]


class Starts:
    """Gives everybody a place to begin at.

    Whoever is to begin a given way from the event begins on the way to it from anywhere else on
    the site, chosen by the run's seed: that way, cut off where so much of it is left.

    Args:
        stage: Where.
        goal: Where the first event is [m].
    """

    def __init__(self, stage: Stage, goal: Point) -> None:
        self._stage, self._goal = stage, goal
        self._taken: list[Point] = []

    def of_robot(self, number: int) -> Pose:
        """Where the `number`-th robot begins, and is charged.

        Raises:
            ConfigError: there is no such place.
        """
        stage = self._stage
        way, bases = stage.scenario.robot.way_m, stage.site.robot_bases
        if way is None:
            return place_of(bases, number, "robot base", stage.site)
        return self._away(f"robot-{number}", way)

    def of_guard(self, number: int) -> Pose:
        """Where the `number`-th guard waits.

        Raises:
            ConfigError: there is no such place.
        """
        stage = self._stage
        way, posts = stage.scenario.guard.way_m, stage.site.guard_posts
        if way is None:
            return place_of(posts, number, "guard post", stage.site)
        return self._away(f"guard-{number}", way)

    def _away(self, label: str, length: float) -> Pose:
        """A place so far [m] from the event, looking along the way there."""
        site, rng = self._stage.site, self._stage.streams.fresh(f"{label}/start")
        longest = 0.0
        for _ in range(TRIES):
            way = self._stage.planner.path(site.sample_free(rng, FOOTPRINT), self._goal)
            if way is None:
                continue
            longest = max(longest, _length(way))
            pose = _cut(way, length)
            if pose is not None and self._is_free(pose):
                self._taken.append((pose.x, pose.y))
                return pose
        problem = f"site {site.name!r} has no place {length:g} m from the event for {label}"
        raise ConfigError(f"{problem}; the longest way tried was {longest:.0f} m")

    def _is_free(self, pose: Pose) -> bool:
        here = pose.x, pose.y
        alone = all(math.dist(here, other) >= APART for other in self._taken)
        return alone and self._stage.site.is_free(*here, FOOTPRINT)


def _length(way: NDArray[np.float64]) -> float:
    return float(np.hypot(*np.diff(way, axis=0).T).sum())


def _cut(way: NDArray[np.float64], left: float) -> Pose | None:
    """Where so much of a way `(n, 2)` is left [m], looking along it; None if it is shorter."""
    steps = np.hypot(*np.diff(way, axis=0).T)
    gone = np.concatenate([[0.0], np.cumsum(steps)])
    at = float(gone[-1]) - left
    if at < 0.0:
        return None
    place = min(int(np.searchsorted(gone, at, side="right")) - 1, len(steps) - 1)
    (x, y), ahead = way[place], way[place + 1] - way[place]
    share = (at - gone[place]) / steps[place] if steps[place] > 0.0 else 0.0
    heading = math.atan2(ahead[1], ahead[0])
    return Pose(float(x + share * ahead[0]), float(y + share * ahead[1]), heading)
