"""Motor models: from wanted and measured motion to accelerations; pure.

A drive is a class, shipped or in a file of the user. It does not see the world: friction with the
floor, walls and other bodies act in addition.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.plugins import Guard, Plugins

MAX_TICK: Final = 0.04  # longest tick for which profiles are made [s]
CREEP: Final = 0.01  # a slower car stands, and its steering has no effect [m/s]


class Drive:
    """Motors of a robot that steers itself; derive from this to make another kind.

    It gets a set point within the limits of `spec`, and keeps nothing from one tick to
    the next: the same values give the same answer.

    Args:
        spec: Mass, size and limits of the robot.

    Attributes:
        turning_radius: Radius of the sharpest curve it can drive [m]; 0: it turns on the spot.
        failures: Number of missing or invalid answers; only users' drives have any.
        first_failure: First failure, in one line.
    """

    turning_radius = 0.0
    failures = 0
    first_failure = ""

    def __init__(self, spec: DriveSpec) -> None:
        self.spec = spec

    def set_point(self, speed: float, turn_rate: float) -> tuple[float, float]:
        """Return the target of the motors [m/s, rad/s] for a request; called once per command."""
        return speed, turn_rate

    def accelerations(
        self, speed: float, turn_rate: float, now_speed: float, now_turn_rate: float, dt: float
    ) -> tuple[float, float]:
        """Return the accelerations of a tick: along [m/s^2] and turning [rad/s^2].

        Args:
            speed: Wanted speed [m/s].
            turn_rate: Wanted turn rate [rad/s].
            now_speed: Measured speed along the heading [m/s].
            now_turn_rate: Measured turn rate [rad/s].
            dt: Length of the tick [s].
        """
        raise NotImplementedError


class Differential(Drive):
    """Two driven wheels: speed and turn rate follow each with one time constant, limited."""

    def __init__(self, spec: DriveSpec) -> None:
        super().__init__(spec)
        self._up = spec.max_acceleration
        self._down = -spec.max_deceleration
        self._turn = spec.max_turn_acceleration
        self._time = spec.motor_time_constant

    def accelerations(
        self, speed: float, turn_rate: float, now_speed: float, now_turn_rate: float, dt: float
    ) -> tuple[float, float]:
        """Return first-order accelerations towards the wanted motion, within their limits."""
        # A time constant below a tick would overshoot the target.
        gain = 1.0 / (self._time if self._time > dt else dt)
        along = (speed - now_speed) * gain
        turn = (turn_rate - now_turn_rate) * gain
        if not self._down <= along <= self._up:
            along = self._up if along > 0.0 else self._down
        if not -self._turn <= turn <= self._turn:
            turn = math.copysign(self._turn, turn)
        return along, turn


class ThreeWay(Drive):
    """A model car: the motor by duty, steering that knows only left, straight and right.

    The car follows its front wheels: turn rate = speed / radius to either side, or zero, so it
    cannot turn on the spot. A wanted speed and turn rate are met as follows:

    - the speed is given to the motor as a whole percentage of the top speed;
    - the steering takes the position whose curvature is nearest to turn rate / speed: a side from
      half its curvature on, otherwise straight;
    - a turn rate without a speed has no effect.

    Args:
        spec: Mass, size and limits of the car.
        wheelbase_m: Distance between the axles [m].
        steering_deg: Angle of the front wheels at either side [deg].
        servo_s: Time of the steering from straight to a side [s].

    References:
        R. Rajamani: Vehicle Dynamics and Control, 2nd ed., Springer 2012, chapter 2: kinematic
        (bicycle) model, radius = wheelbase / tan(steering angle).
    """

    def __init__(
        self,
        spec: DriveSpec,
        wheelbase_m: float = 0.26,
        steering_deg: float = 25.0,
        servo_s: float = 0.15,
    ) -> None:
        super().__init__(spec)
        if not wheelbase_m > 0:
            raise ConfigError(f"option 'wheelbase_m' is {wheelbase_m!r}; should be above 0")
        if not 0 < steering_deg < 80:
            raise ConfigError(f"option 'steering_deg' is {steering_deg!r}; should be in (0, 80)")
        if not servo_s >= 0:
            raise ConfigError(f"option 'servo_s' is {servo_s!r}; should be at least 0")
        self.turning_radius = wheelbase_m / math.tan(math.radians(steering_deg))
        self._most = 1.0 / self.turning_radius  # curvature [1/m]
        self._servo = servo_s
        self._motor = Differential(spec)

    def set_point(self, speed: float, turn_rate: float) -> tuple[float, float]:
        """Return the nearest duty and the nearest of three positions."""
        speed = round(100.0 * speed / self.spec.max_speed) * self.spec.max_speed / 100.0
        if abs(turn_rate) < 0.5 * self._most * speed or speed == 0.0:
            return speed, 0.0
        speed = min(speed, self.spec.max_turn_rate * self.turning_radius)
        return speed, math.copysign(self._most * speed, turn_rate)

    def accelerations(
        self, speed: float, turn_rate: float, now_speed: float, now_turn_rate: float, dt: float
    ) -> tuple[float, float]:
        """Return a motor's acceleration along, and the turning that follows from the steering."""
        along, _ = self._motor.accelerations(speed, 0.0, now_speed, 0.0, dt)
        rolls = abs(now_speed) > CREEP
        now = min(max(now_turn_rate / now_speed, -self._most), self._most) if rolls else 0.0
        target = turn_rate / speed if speed > 0.0 else now  # a braking car keeps its steering
        step = self._most * dt / self._servo if rolls and self._servo > 0.0 else math.inf
        curvature = now + min(max(target - now, -step), step)
        return along, ((now_speed + along * dt) * curvature - now_turn_rate) / dt


class GuardedDrive(Guard, Drive):
    """Drive of a user, kept within the limits of its robot whatever it answers.

    Both accelerations stay within their limits, and so do the resulting speed and turn rate: never
    backwards, never too fast. An exception or an answer that is not two finite numbers is counted,
    and the robot brakes. Aiming at or driving at more than the profile allows is counted, too.

    Attributes:
        drive: The user's own.
    """

    def __init__(self, drive: Drive) -> None:
        super().__init__(drive.spec)
        self.turning_radius = drive.turning_radius
        self.drive = drive

    def set_point(self, speed: float, turn_rate: float) -> tuple[float, float]:
        """Limit the set point; stop on an invalid answer."""
        got = self._answer(self.drive.set_point, speed, turn_rate)
        if got is None:
            return 0.0, 0.0
        most = self.spec.max_turn_rate
        aims = self._clamp("aims at [m/s]", got[0], 0.0, self.spec.max_speed)
        return aims, self._clamp("aims at [rad/s]", got[1], -most, most)

    def accelerations(
        self, speed: float, turn_rate: float, now_speed: float, now_turn_rate: float, dt: float
    ) -> tuple[float, float]:
        """Limit the accelerations; brake on an invalid answer."""
        spec = self.spec
        motion = (speed, turn_rate, now_speed, now_turn_rate, dt)
        got = self._answer(self.drive.accelerations, *motion)
        along, turn = got or (-now_speed / dt, -now_turn_rate / dt)
        self._judge_motion(along, turn, now_speed, now_turn_rate, dt=dt)
        # A robot pushed beyond a limit comes back as fast as the accelerations allow.
        along = _within(along, -now_speed / dt, (spec.max_speed - now_speed) / dt)
        most = spec.max_turn_rate
        turn = _within(turn, (-most - now_turn_rate) / dt, (most - now_turn_rate) / dt)
        most = spec.max_turn_acceleration
        return _within(along, -spec.max_deceleration, spec.max_acceleration), _within(
            turn, -most, most
        )

    def _judge_motion(
        self, along: float, turn: float, now_speed: float, now_turn_rate: float, dt: float
    ) -> None:
        """Check the result of a tick; braking after a push beyond a limit is allowed."""
        spec = self.spec
        most = self.spec.max_turn_acceleration
        speed = now_speed + dt * _within(along, -spec.max_deceleration, spec.max_acceleration)
        turn_rate = now_turn_rate + dt * _within(turn, -most, most)
        brakes = min(now_speed, 0.0) <= speed <= max(now_speed, 0.0)
        spins = abs(turn_rate) > abs(now_turn_rate)
        most = spec.max_turn_rate
        self._clamp("drives at [m/s]", 0.0 if brakes else speed, 0.0, spec.max_speed)
        self._clamp("drives at [rad/s]", turn_rate if spins else 0.0, -most, most)


def _within(value: float, least: float, most: float) -> float:
    return min(max(value, least), most)


@dataclass(frozen=True)
class DriveSpec:
    """Body and motors of a robot.

    Attributes:
        mass: Mass [kg].
        radius: Radius of the circular footprint, or of a circle around the corners [m].
        max_speed: Highest speed, forward only [m/s].
        max_turn_rate: Highest turn rate in either direction [rad/s].
        max_acceleration: Highest acceleration [m/s^2].
        max_deceleration: Highest deceleration [m/s^2].
        max_turn_acceleration: Highest angular acceleration in either direction [rad/s^2].
        motor_time_constant: Time constant of the speed [s].
        corners: Corners of a convex footprint, x ahead, y to the left [m]; none: a circle.
        drive: Function that makes the motors.
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

    @property
    def inner_radius(self) -> float:
        """Radius of the largest circle around the middle that lies within the footprint [m]."""
        if not self.corners:
            return self.radius
        sides = zip(self.corners, (*self.corners[1:], self.corners[0]), strict=True)
        return min(
            abs(ax * by - ay * bx) / math.dist((ax, ay), (bx, by)) for (ax, ay), (bx, by) in sides
        )

    def safe_speed(self, dt: float) -> float:
        """Return the highest speed at which a tick of `dt` [s] cannot skip a thin wall [m/s]."""
        return 0.5 * self.inner_radius / dt

    @property
    def stopping_distance(self) -> float:
        """Distance from top speed to a stop on a dry floor, with the motors' lag [m]."""
        braking = 0.5 * self.max_speed**2 / self.max_deceleration
        return braking + self.max_speed * self.motor_time_constant


DRIVES: Final[dict[str, Callable[..., Drive]]] = {
    "differential": Differential,
    "three_way": ThreeWay,
}

PLUGINS: Final = Plugins(
    "drive",
    Drive,
    DRIVES,
    folder="agents/robots",
    group="dva_sim.drives",
    key="drive",
    needs="accelerations(speed, turn_rate, now_speed, now_turn_rate, dt)",
    public="dva_sim.worlds.drives.Drive",
    finish=lambda drive: GuardedDrive(drive),
)


def load_drive(
    name: str | Callable[..., Drive],
    options: Mapping[str, Any] | None = None,
    base: Path | None = None,
) -> Callable[[DriveSpec], Drive]:
    """Return a factory for the motors of a name; motors of users are kept within the limits.

    Args:
        name: `differential`, `three_way`, a class in a file such as `mine.py:Mine`, or the name
            under which an installed package offers one (entry point, `dva_sim.drives`).
        options: Keyword arguments of its constructor, besides the spec.
        base: Folder that a file is looked for in first; then the working folder, and
            `agents/robots`.

    Raises:
        ConfigError: there is none of that name, its file or package cannot be loaded, or it is
            not a drive; a bad option is reported when it is made.
    """
    if isinstance(name, str) and name in DRIVES and not options:
        return DRIVES[name]
    return PLUGINS.load(name, options, base)
