"""Small closed loops for strategies: what is asked for happens exactly, a delay later."""

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from dva_sim.agents.observation import Observation
from dva_sim.agents.operator.strategies import (
    Intent,
    PathView,
    PointView,
    Reach,
    Sighting,
    Strategy,
    View,
)
from dva_sim.agents.population import Person, Population, median_person
from dva_sim.agents.route_following import Route

ROBOT = Reach(speed=0.5, turn_rate=math.pi / 6)
CURSOR = Reach(speed=0.5, turn_rate=1.0)
FRAME = 0.1  # [s]


class At(NamedTuple):
    """A moment of a drive: time [s], pose [m, rad], and what was asked for at it."""

    time: float
    x: float
    y: float
    heading: float
    wanted: Intent


def person(**traits: float) -> Person:
    """The median person, with some traits otherwise."""
    return replace(median_person(Population()), **traits)


def normals(seed: int) -> Iterator[float]:
    """Endless standard normal numbers, the random source of a person."""
    rng = np.random.default_rng(seed)
    while True:
        yield from rng.normal(size=1000).tolist()


def way(*corners: tuple[float, float]) -> Route:
    """A route over corners [m]."""
    return Route(np.array(corners, dtype=float))


def arc(radius: float, angle: float = math.pi / 2) -> Route:
    """A circular arc to the left, from the origin along x [m, rad]."""
    at = np.linspace(0.0, angle, 60)
    return Route(radius * np.stack([np.sin(at), 1.0 - np.cos(at)], 1))


def drive(
    strategy: Strategy,
    route: Route,
    delay: float,
    seconds: float,
    start: tuple[float, float, float] = (0.0, 0.0, 0.0),
    stop_before: float = 0.3,
    reported_delay: Callable[[float], float] | None = None,
    frame: float = FRAME,
) -> list[At]:
    """Drive a robot that does at once what it was asked for `delay` [s] ago.

    Args:
        route: Route to follow.
        delay: A multiple of a frame [s].
        seconds: Length of the drive [s].
        start: Pose [m, rad].
        stop_before: So far before the end [m].
        reported_delay: Delay as the person perceives it, by time [s]; by default the true one.
        frame: Interval between two frames [s].
    """
    x, y, heading = start
    late = round(delay / frame)
    asked = [Intent(0.0, 0.0)] * late
    track: list[At] = []
    for number in range(round(seconds / frame)):
        now = number * frame
        speed, turn = asked[-late - 1] if number and late < len(asked) else (0.0, 0.0)
        seen = Observation(round(1000 * now), x, y, heading, speed, turn, ())
        view = View(now, seen, reported_delay(now) if reported_delay else delay)
        wanted = strategy.drive(route, view, stop_before)
        asked.append(wanted)
        track.append(At(now, x, y, heading, wanted))
        speed, turn = asked[-late - 1]
        middle = heading + 0.5 * turn * frame
        x, y = x + speed * frame * math.cos(middle), y + speed * frame * math.sin(middle)
        heading += turn * frame
    return track


def point(
    strategy: Strategy,
    target: Callable[[float], float],
    delay: float,
    seconds: float,
    frame: float = 0.01,
    tolerance: float = 0.005,
) -> list[tuple[float, float, float]]:
    """Move a cursor along x to where a target is by time [s]: (time, x, wanted velocity)."""
    x, late = 0.0, round(delay / frame)
    asked = [0.0] * late
    track = []
    for number in range(round(seconds / frame)):
        now = number * frame
        at, rate = target(now), (target(now) - target(now - frame)) / frame
        v = asked[-late - 1] if late < len(asked) else 0.0
        seen = Sighting(round(1000 * now), x, 0.0, v, 0.0, at, 0.0, rate, 0.0, tolerance)
        wanted = strategy.point(PointView(now, seen, delay))[0]
        asked.append(wanted)
        track.append((now, x, wanted))
        x += asked[-late - 1] * frame
    return track


def follow(
    strategy: Strategy, path: Route, half_width: float, delay: float, seconds: float
) -> list[tuple[float, float, float]]:
    """Move a cursor through a tunnel from its beginning: (time, x, y)."""
    frame, (x, y) = 0.01, path.point_at(0.0)
    end = path.point_at(path.length)
    late = round(delay / frame)
    asked = [(0.0, 0.0)] * late
    track = []
    for number in range(round(seconds / frame)):
        now = number * frame
        v = asked[-late - 1] if late < len(asked) else (0.0, 0.0)
        seen = Sighting(round(1000 * now), x, y, *v, *end, 0.0, 0.0, half_width)
        asked.append(strategy.follow(PathView(now, seen, delay, path)))
        track.append((now, x, y))
        vx, vy = asked[-late - 1]
        x, y = x + vx * frame, y + vy * frame
    return track


def offsets(route: Route, track: list[At]) -> list[float]:
    """Distances of a drive from its path [m], by points 1 cm apart."""
    ways = np.array([route.point_at(s) for s in np.arange(0.0, route.length, 0.01)])
    return [float(np.hypot(*(ways - (at.x, at.y)).T).min()) for at in track]
