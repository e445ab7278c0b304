"""Collision guard: robots nearby, and slowing before contact; coordinated control.

The guard is a loop at the robot. It never makes a robot faster and never turns it: its driver
stays in charge of the direction, and can always turn away on the spot. It knows only the plan of
the site and the bodies nearby.

References:
    T. B. Sheridan: Telerobotics, Automation, and Human Supervisory Control. MIT Press, 1992
    (direct, coordinated and supervisory control); T. Fong, C. Thorpe, C. Baur: A Safeguarded
    Teleoperation Controller. IEEE International Conference on Advanced Robotics, 2001.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dva_sim.kernel.makers import maker
from dva_sim.worlds.bodies import RobotBody
from dva_sim.worlds.physics import PersonBody, World

Point = tuple[float, float]

PERSONAL = 0.45  # gap to people: personal distance begins at 18 inches [m] (Hall, see `avoidance`)
KEEP_ROBOT = 0.10  # gap to other robots [m]; assumed


class Nearby(NamedTuple):
    """Person or robot in sight and within reach of the robot's sensors.

    Attributes:
        kind: `robot` or `person`.
        name: Name of a robot, or identifier of a person.
        x: Position to the east [m].
        y: Position to the north [m].
        vx: Velocity to the east [m/s].
        vy: Velocity to the north [m/s].
        radius: Radius of the enclosing circle [m].
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


_make_nearby = maker(Nearby)


def who_is_near(
    world: World, body: RobotBody, within: float, sees: Callable[[Point, Point], bool]
) -> tuple[Nearby, ...]:
    """Return the bodies in sight with their velocities, the nearest first.

    Args:
        body: Robot with the sensors.
        within: Range of the sensors [m].
        sees: Predicate: True if nothing stands between two places.
    """
    here = body.x, body.y
    nearby = []
    for other, _ in world.neighbours(*here, within):
        if other is body:
            continue
        x = other.x
        y = other.y
        if sees(here, (x, y)):
            person = isinstance(other, PersonBody)
            kind, keep = ("person", PERSONAL) if person else ("robot", KEEP_ROBOT)
            nearby.append(
                _make_nearby(
                    kind, other.name, x, y, *other.velocity, radius=other.radius, keep=keep
                )
            )
    return tuple(nearby)


Floats = NDArray[np.float64]

KEEP_WALL = 0.01  # gap to walls; the grid is already safe by up to a cell [m]; assumed
TIME_TO_CONTACT = 1.0  # minimum time until contact at the scaled speed [s]; assumed
REACTION = 0.35  # delay of the brakes: a period of the loop and the motors' lag [s]; assumed
STEP = 0.05  # distance between the samples of an arc [m]
STEADY_GAP_M = 0.005  # a gap that shrinks by less counts as steady [m]
SLOWEST = 1e-3  # slower counts as standing [m/s]
ROUNDS = 4  # iterations: at a lower speed the arc is sharper, so its clearance changes


@dataclass(frozen=True)
class CollisionGuard:
    """Scales speed by the clearance ahead along the commanded arc.

    Attributes:
        radius: Radius of the robot [m].
        deceleration: Braking deceleration [m/s^2].
        room_at: Distance to the nearest wall at points `(n, 2)` [m].
    """

    radius: float
    deceleration: float
    room_at: Callable[[Floats], Floats]

    def limit(
        self,
        pose: tuple[float, float, float],
        speed: float,
        turn_rate: float,
        others: Sequence[Nearby] = (),
    ) -> float:
        """Return the speed at which the robot can still stop before contact; never above `speed`.

        Args:
            pose: Position and heading [m, rad].
            speed: Requested speed [m/s].
            turn_rate: Requested turn rate, which is not changed [rad/s].
            others: Others nearby.
        """
        for _ in range(ROUNDS):
            if not speed > SLOWEST:
                return 0.0
            reach = max(speed * TIME_TO_CONTACT, self.stopping_distance(speed)) + STEP
            free = self.free_way(pose, speed, turn_rate, others, reach)
            # The highest speed that satisfies both: braking v * REACTION + v^2 / (2 a) within the
            # free distance, and the time to contact.
            late = self.deceleration * REACTION
            braking = math.sqrt(late**2 + 2.0 * self.deceleration * free) - late
            allowed = min(braking, free / TIME_TO_CONTACT)
            if allowed >= speed:
                return speed
            speed = allowed
        return 0.0

    def stopping_distance(self, speed: float) -> float:
        """Return the distance from asking for a stop to standing [m]."""
        return speed * REACTION + speed**2 / (2.0 * self.deceleration)

    def free_way(
        self,
        pose: tuple[float, float, float],
        speed: float,
        turn_rate: float,
        others: Sequence[Nearby],
        reach: float,
    ) -> float:
        """Return how far the robot gets along an arc before it is too near to something [m].

        A gap counts only while it shrinks: what is too near already may be driven away from.

        Args:
            pose: Position and heading [m, rad].
            speed: Speed, above 0 [m/s].
            turn_rate: Turn rate [rad/s].
            others: Others nearby, at their current positions.
            reach: Maximum distance of interest [m].
        """
        lengths = np.arange(0.0, reach + STEP, STEP)
        points = _arc(pose, turn_rate / speed, lengths)
        gaps = [(self.room_at(points) - self.radius, KEEP_WALL)]
        for other in others:
            gap = np.hypot(points[:, 0] - other.x, points[:, 1] - other.y)
            gaps.append((gap - self.radius - other.radius, other.keep))
        stops = [_first(gap < min(keep, float(gap[0]) - STEADY_GAP_M)) for gap, keep in gaps]
        first = min(stops)
        return reach if first >= len(lengths) else float(max(lengths[first] - STEP, 0.0))


def _first(flags: NDArray[np.bool_]) -> int:
    """Return the index of the first true value; the length if all are false."""
    at = int(flags.argmax())
    return at if flags[at] else len(flags)


def _arc(pose: tuple[float, float, float], curvature: float, lengths: Floats) -> Floats:
    """Return points `(n, 2)` along an arc that begins at a pose.

    `curvature` [1/m], `lengths` `(n,)` [m].
    """
    x, y, heading = pose
    half = 0.5 * curvature * lengths
    # NumPy's sinc includes the factor pi; it stays exact for a straight line.
    chord = lengths * np.sinc(half / math.pi)
    return np.stack([x + chord * np.cos(heading + half), y + chord * np.sin(heading + half)], 1)
