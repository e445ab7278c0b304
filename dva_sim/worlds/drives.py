"""What motors do: from what is wanted and what is measured to accelerations, without a clock.

A drive is one class, shipped or in a file of the user. It never sees the world: friction with
the floor, walls and other bodies come on top of what it asks for.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass


class Drive:
    """Motors of a robot that steers itself; derive from this to make another kind.

    It is told what is wanted within the limits of `spec`, and keeps nothing from one tick to
    the next: the same values give the same answer.

    Args:
        spec: Mass, size and limits of the robot.

    Attributes:
        turning_radius: Of the sharpest curve it can drive [m]; 0: it turns on the spot.
    """

    turning_radius = 0.0

    def __init__(self, spec: DriveSpec) -> None:
        self.spec = spec

    def set_point(self, speed: float, turn_rate: float) -> tuple[float, float]:
        """What the motors aim at [m/s, rad/s] when that is asked for; asked once per command."""
        return speed, turn_rate

    def accelerations(
        self, speed: float, turn_rate: float, now_speed: float, now_turn_rate: float, dt: float
    ) -> tuple[float, float]:
        """What the motors try to do during a tick, along [m/s^2] and turning [rad/s^2].

        Args:
            speed: Wanted [m/s].
            turn_rate: Wanted [rad/s].
            now_speed: Measured along the heading [m/s].
            now_turn_rate: Measured [rad/s].
            dt: Length of the tick [s].
        """
        raise NotImplementedError


class Differential(Drive):
    """Two driven wheels: speed and turn rate follow each with one time constant, limited."""

    def __init__(self, spec: DriveSpec) -> None:
        super().__init__(spec)
        self._up, self._down = spec.max_acceleration, -spec.max_deceleration
        self._turn, self._time = spec.max_turn_acceleration, spec.motor_time_constant

    def accelerations(
        self, speed: float, turn_rate: float, now_speed: float, now_turn_rate: float, dt: float
    ) -> tuple[float, float]:
        """First order towards what is wanted, within the limits of acceleration."""
        gain = 1.0 / max(self._time, dt)
        along = (speed - now_speed) * gain
        along = min(max(along, self._down), self._up)
        turn = (turn_rate - now_turn_rate) * gain
        return along, min(max(turn, -self._turn), self._turn)


@dataclass(frozen=True)
class DriveSpec:
    """Body and motors of a robot.

    Attributes:
        mass: [kg]
        radius: Of the circular footprint, or of the circle around the corners [m].
        max_speed: Forward only [m/s].
        max_turn_rate: Either way [rad/s].
        max_acceleration: [m/s^2]
        max_deceleration: [m/s^2]
        max_turn_acceleration: Either way [rad/s^2].
        motor_time_constant: How fast speed follows the set point [s].
        corners: Of a convex footprint, x ahead, y to the left [m]; none: a circle.
        drive: Makes the motors.
    """

    mass: float = 60.0
    radius: float = 0.30
    max_speed: float = 0.5
    max_turn_rate: float = math.pi / 6
    max_acceleration: float = 0.5
    max_deceleration: float = 1.0
    max_turn_acceleration: float = 1.5
    motor_time_constant: float = 0.15
    corners: tuple[tuple[float, float], ...] = ()
    drive: Callable[[DriveSpec], Drive] = Differential
