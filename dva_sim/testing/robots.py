"""Checks of robot motors, alone and in a hall."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from dva_sim.agents.robot.profile import RobotProfile, load_robot
from dva_sim.testing.promises import Case, Outcome, broken_in, is_slow, kept, part_by_part
from dva_sim.worlds.drives import MAX_TICK, Drive, DriveSpec, GuardedDrive, load_drive
from dva_sim.worlds.geo import Pose
from dva_sim.worlds.physics import World, hall

TICKS: Final = (0.01, 0.02, MAX_TICK)  # lengths of a tick [s]
DRIVES: Final = 40  # random drives of a minute each
COMMANDS: Final = 30  # commands of such a drive, 2 s each
APPROACHES: Final = 24  # angles at which a wall is hit at top speed
SLOW: Final = 50e-6  # time of an answer above which an episode is slow [s]
SLACK: Final = 1e-9  # rounding error of limits
CREEP: Final = 0.01  # allowed speed backwards while motors come to rest [m/s]
HOSTILE: Final = (math.nan, math.inf, -math.inf, 1e308, -1e308, -1.0, 1e-300, 0.0, 9.0)


def check_robot(
    robot: str | Callable[..., Drive],
    options: Mapping[str, Any] | None = None,
    *,
    slow: float = SLOW,
) -> Outcome:
    """Check that motors keep what all promise, first by themselves, then in the robot's body.

    Users' motors are held within the limits in a run; here they are tried without that, so
    that nothing is hidden.

    Args:
        robot: A profile, by name or path; or motors, as a profile names them or as a class,
            in the body of a profile that says nothing else.
        options: Options of the motors.
        slow: An answer that takes longer earns a warning [s].

    Raises:
        BrokenPromises: they do not; a line for each promise.
        ConfigError: there is none of that name, or it cannot be made with these options.
    """
    spec = _spec(robot, options or {})
    spec.drive(spec)
    trial = _Trial(spec, np.random.default_rng(1))
    broken = broken_in(part_by_part(trial.parts))
    slowest = min(trial.took, default=0.0)
    return kept(broken, is_slow(slowest, slow, "an answer"), trial.count, slowest)


def _spec(robot: str | Callable[..., Drive], options: Mapping[str, Any]) -> DriveSpec:
    if callable(robot):
        return replace(RobotProfile().drive_spec(), drive=load_drive(robot, options))
    profile = RobotProfile(drive=robot) if ".py" in robot else load_robot(robot)
    return profile.model_copy(update={"options": {**profile.options, **options}}).drive_spec()


@dataclass
class _State:
    """Motion on a floor with grip: the robot moves as its motors turn."""

    drive: Drive
    dt: float
    speed: float = 0.0
    turn_rate: float = 0.0
    way: float = 0.0

    def step(self, speed: float, turn_rate: float) -> None:
        """Advance by one tick; forces act after the body has moved, as in the world."""
        along, turn = self.drive.accelerations(
            speed, turn_rate, self.speed, self.turn_rate, self.dt
        )
        self.way += self.speed * self.dt
        self.speed += along * self.dt
        self.turn_rate += turn * self.dt


class _Trial:
    """All that is tried with one robot.

    Attributes:
        count: Drives so far.
        took: Mean time of an answer, for each drive [s].
    """

    def __init__(self, spec: DriveSpec, rng: np.random.Generator) -> None:
        self.spec = spec
        self.rng = rng
        self.count = 0
        self.took = list[float]()
        alone = self._set_points, self._answers, self._drives, self._stops
        self.parts = (*alone, self._obeys, self._walls)

    def _new(self) -> Drive:
        """Return the motors themselves."""
        drive = self.spec.drive(self.spec)
        while isinstance(drive, GuardedDrive):  # more than once, where it was loaded before
            drive = drive.drive
        return drive

    def _command(self) -> tuple[float, float]:
        """Return a command within the limits; often one of the limits, or nothing."""
        spec = self.spec
        rng = self.rng
        speed = rng.choice([0.0, spec.max_speed, rng.uniform(0, spec.max_speed)])
        most = spec.max_turn_rate
        return float(speed), float(rng.choice([0.0, most, -most, rng.uniform(-most, most)]))

    def _set_points(self) -> Iterator[Case]:
        drive = self._new()
        spec = self.spec
        for _ in range(500):
            command = self._command()
            speed, turn_rate = drive.set_point(*command)
            case = f"({speed!r}, {turn_rate!r}) for {_velocity_text(*command)}"
            if not (math.isfinite(speed) and math.isfinite(turn_rate)):
                yield "aims at what is no number", case
            elif not -SLACK <= speed <= spec.max_speed + SLACK:
                yield "aims at a speed beyond the limits", case
            elif abs(turn_rate) > spec.max_turn_rate + SLACK:
                yield "aims at a turn rate beyond the limit", case

    def _answers(self) -> Iterator[Case]:
        """Yield cases that must be finite, and the same from each copy, used or new."""
        used = self._new()
        spec = self.spec
        rng = self.rng
        for number in range(500):
            speed, turn_rate = used.set_point(*self._command())
            now = rng.uniform(-1, 1.5) * spec.max_speed, rng.uniform(-2, 2) * spec.max_turn_rate
            now = (0.0, 0.0) if number % 10 == 0 else now
            dt = TICKS[number % len(TICKS)]
            answer = used.accelerations(speed, turn_rate, *now, dt)
            case = f"{_velocity_text(speed, turn_rate)} at {_velocity_text(*now)}"
            if not all(map(math.isfinite, answer)):
                yield "answers what is no number", case
            elif answer != self._new().accelerations(speed, turn_rate, *now, dt):
                yield "remembers: a new copy answers differently", case

    def _drives(self) -> Iterator[Case]:
        """Yield limits of motion, over long random drives."""
        spec = self.spec
        for number in range(DRIVES):
            self.count += 1
            state = _State(self._new(), TICKS[number % len(TICKS)])
            ticks = 0
            started = time.perf_counter()
            for _ in range(COMMANDS):
                set_point = state.drive.set_point(*self._command())
                for _ in range(round(2.0 / state.dt)):
                    state.step(*set_point)
                    ticks += 1
                    yield from self._within(state, f"in drive {number + 1}")
            self.took.append((time.perf_counter() - started) / ticks)
            if not (math.isfinite(state.speed) and state.speed < 10 * spec.max_speed):
                return

    def _within(self, state: _State, where: str) -> Iterator[Case]:
        speed = state.speed
        turn_rate = state.turn_rate
        spec = self.spec
        case = f"{_velocity_text(speed, turn_rate)} {where}, tick {state.dt:g} s"
        if not speed <= spec.max_speed * (1 + SLACK):
            yield "drives faster than its limit", case
        if not speed >= -CREEP:
            yield "drives backwards", case
        if not abs(turn_rate) <= spec.max_turn_rate * (1 + SLACK):
            yield "turns faster than its limit", case

    def _stops(self) -> Iterator[Case]:
        """Yield stops from top speed within the distance that its profile states."""
        spec = self.spec
        stated = spec.stopping_distance
        for turn in (0.0, spec.max_turn_rate, -spec.max_turn_rate):
            for dt in TICKS:
                self.count += 1
                state = _State(self._new(), dt, spec.max_speed, turn)
                rest = state.drive.set_point(0.0, 0.0)
                for _ in range(round(60.0 / dt)):
                    state.step(*rest)
                if abs(state.speed) > CREEP or abs(state.turn_rate) > CREEP:
                    yield (
                        "does not stop within a minute",
                        _velocity_text(state.speed, state.turn_rate),
                    )
                elif state.way > stated + spec.max_speed * dt:
                    yield "stops too late", f"{state.way:.3f} m; its profile says {stated:.3f} m"

    def _obeys(self) -> Iterator[Case]:
        """Yield cases in its body, whatever it is asked for."""
        spec = self.spec
        world = World(hall(60.0, 60.0), MAX_TICK)
        robot = world.add_robot("robot", spec, Pose(30.0, 30.0, 0.3))
        for speed in HOSTILE:
            for turn_rate in HOSTILE:
                self.count += 1
                robot.drive(speed, turn_rate, world.time + 0.4)
                world.advance_to(world.time + 0.8)
                now = robot.speed, robot.turn_rate
                within = -CREEP <= now[0] <= spec.max_speed * 1.02
                if not (within and abs(now[1]) <= spec.max_turn_rate * 1.02):
                    yield "leaves its limits when asked for", f"{speed!r}, {turn_rate!r}"

    def _walls(self) -> Iterator[Case]:
        """Yield drives at top speed against a thin wall, at every angle, and against its end."""
        spec = self.spec
        run = 2.0 + spec.max_speed**2 / spec.max_acceleration + spec.radius
        size = 2 * run + 4
        for number in range(APPROACHES):
            self.count += 1
            heading = 2 * math.pi * number / APPROACHES
            x = size / 2 + run * math.cos(heading)
            y = size / 2 + run * math.sin(heading)
            far = 0.0 if math.sin(heading) >= 0 else size
            wall = (size / 2, far, size / 2, size - far if number % 2 else size / 2)
            world = World(hall(size, size, [wall]), MAX_TICK)
            robot = world.add_robot("robot", spec, Pose(x, y, heading + math.pi))
            robot.drive(spec.max_speed, 0.0, math.inf)
            world.advance_to(3 * size / spec.max_speed)
            inside = 0 < robot.x < size and 0 < robot.y < size
            if not inside or (number % 2 and (robot.x - size / 2) * (x - size / 2) < 0):
                yield "passes through a wall", f"at {math.degrees(heading):.0f} degrees"


def _velocity_text(speed: float, turn_rate: float) -> str:
    return f"{speed:.3g} m/s, {turn_rate:.3g} rad/s"
