"""Trials in which a vehicle is driven: around a corner, a slalom, a course."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
from typing_extensions import override

from dva_sim.agents.observation import Observation
from dva_sim.agents.operator.strategies import (
    Driver,
    Intent,
    Oracle,
    Reach,
    Truth,
    View,
)
from dva_sim.agents.route_following import Route
from dva_sim.kernel.streams import Streams
from dva_sim.simulation.task import movement_laws
from dva_sim.simulation.task.delays import normals
from dva_sim.simulation.task.devices import Joystick
from dva_sim.simulation.task.plants import Pair, Unicycle
from dva_sim.simulation.task.recorded_delays import RecordedChannel, RecordedDelays
from dva_sim.simulation.task.scenario import TaskScenario
from dva_sim.simulation.task.tasks import Corner, Course, HeadingStep, Slalom, Task
from dva_sim.simulation.task.trial import Seat, Trial, WayKept

RUN_OUT = 5.0  # length of the path beyond the finish, so that nobody stops before it [m]
ENDLESS = 1000.0  # length of a path whose end nobody reaches [m]
MACHINE_LOOK = 1.0  # look-ahead of a machine that steers by itself [m]; assumed
CONE = 0.1  # radius of a cone in a picture [m]
REACHED = 0.9  # share of the first peak that counts as grown, as the rest is noise; assumed
ONSET = 0.1  # share of the first peak at which a correction counts as begun; assumed
SMOOTHED = 0.15  # time over which steering is averaged before it is analysed [s]; assumed
CONE_STEP = 0.1  # distance between the corners of the line that represents a slalom [m]
Points = list[Pair]


def way_of(task: Task, first: float, width: float) -> Points:
    """Return the middle of the way that a vehicle has to take, from (0, 0) along x at first [m].

    Args:
        task: A corner, slalom or course.
        first: The condition's length or spacing [m].
        width: Width of the path [m].
    """
    if isinstance(task, Corner):
        leg = 0.5 * first
        return [(0.0, 0.0), (leg, 0.0), (leg, leg)]
    if isinstance(task, Slalom):
        end = task.cones * first
        steps = np.linspace(0.0, end, max(2, round(end / CONE_STEP)) + 1)
        return [(float(x), task.swing_m * math.sin(math.pi * x / first)) for x in steps]
    if isinstance(task, HeadingStep):
        return [(0.0, 0.0), (ENDLESS, 0.0)]
    assert isinstance(task, Course)
    return list(task.points_m)


def extended(points: Points, by: float) -> Route:
    """Return the way, going straight on after its end [m]."""
    (ax, ay), (bx, by_) = points[-2:]
    step = math.dist((ax, ay), (bx, by_))
    on = bx + by * (bx - ax) / step, by_ + by * (by_ - ay) / step
    return Route(np.array([*points, on]))


class DriveTrial(Trial[Observation]):
    """One drive with a joystick: forward is speed, sideways is turn rate.

    The body is as wide as `plant.width_m`; that it crosses the edge of the way is counted once
    until it is back, and nothing holds it.

    Args:
        scenario: Vehicle, links, frames.
        seat: Person who drives.
        condition: See the kinds of tasks.
        streams: Random streams of the trial.
        reaction: See `Trial`.
    """

    STEP = 0.01
    plant: Unicycle

    def __init__(
        self,
        scenario: TaskScenario,
        seat: Seat,
        condition: tuple[float, float],
        streams: Streams,
        reaction: float = 0.0,
    ) -> None:
        plant = scenario.plant
        assert plant.speed_mps is not None
        self._top = plant.speed_mps, math.radians(plant.turn_rate_deg_s)
        unit = scenario.device.model_copy(update={"gain": 1.0})
        device = Joystick(unit, seat.person, streams, self.STEP)
        super().__init__(scenario, seat, Reach(*self._top), device, streams, reaction)
        self.points = way_of(scenario.task, *condition)
        self.length = sum(math.dist(a, b) for a, b in pairwise(self.points))
        self.width = condition[1]
        self._kept = WayKept(0.5 * (self.width - plant.width_m))
        self._seen_way, self._way = (extended(self.points, RUN_OUT) for _ in range(2))
        self.plant = Unicycle(plant.lag_s, *self._top)
        self.plant.heading = math.atan2(self.points[1][1], self.points[1][0])
        self._errors = normals(streams.fresh("judgement"))

    def replay(self, recording: RecordedDelays, begin: float) -> None:
        """Take the link from a recording, from `begin` [s] in it on; no link reaches the oracle."""
        if not self.is_oracle:
            self._up = RecordedChannel(recording.up, begin, 0.0)
            self._frames = RecordedChannel(recording.down, begin, self._late)

    @override
    def sight(self) -> Observation:
        at = self.plant
        tick = round(1000 * self.now)
        return Observation(
            tick=tick,
            x=at.x,
            y=at.y,
            heading=at.heading,
            speed=at.speed,
            turn_rate=at.turn_rate,
            hazards=(),
        )

    @override
    def decide(self, driver: Driver, observation: Observation, now: float) -> None:
        delay = self.seat.delay
        delay.see(now, *self._motion(observation))
        if isinstance(driver, Oracle):
            intent = driver.drive(self._seen_way, Truth(observation), 0.0)
        else:
            intent = driver.drive(
                self._seen_way, View(now, self._judged(observation), delay.value), 0.0
            )
        self.device.aim(self._held(intent), intent.turn_rate / self._top[1])
        self.intended(now, intent.speed, intent.turn_rate)

    def _held(self, intent: Intent) -> float:
        """Return the deflection for the speed, as a share of a full one."""
        return intent.speed / self._top[0]

    def _motion(self, observation: Observation) -> Pair:
        """Return the motion from which the person learns the delay [m/s, rad/s]."""
        return observation.speed, observation.turn_rate

    def _judged(self, observation: Observation) -> Observation:
        """Return the observation as the person judges it: place and heading with an error."""
        person = self.seat.person
        error = self._errors
        return observation._replace(
            x=observation.x + person.position_error * next(error),
            y=observation.y + person.position_error * next(error),
            heading=observation.heading + person.heading_error * next(error),
        )

    @override
    def advance(self, dt: float) -> None:
        plant = self.plant
        speed, turn = self.commanded(dt)
        intent = Intent(speed * self._top[0], turn * self._top[1])
        if self.scenario.automation:
            intent = self._corrected(self.scenario.automation, intent)
        plant.step(intent.speed, intent.turn_rate, dt)
        self.path += plant.speed * dt
        ahead = self._way.ahead(plant.x, plant.y, 0.0, 0.0)
        self._kept.note(ahead.offset, (plant.x, plant.y), dt)
        self.over = ahead.remaining <= RUN_OUT

    def _corrected(self, share: float, intent: Intent) -> Intent:
        """Return the command with the machine's help to steer (pure pursuit), at the same speed."""
        at = self.plant
        ahead = self._way.ahead(at.x, at.y, at.heading, MACHINE_LOOK)
        turn_rate = at.speed * 2.0 * math.sin(ahead.bearing) / max(ahead.distance, 0.1)
        return Intent(intent.speed, (1.0 - share) * intent.turn_rate + share * turn_rate)

    def row(self) -> dict[str, Any]:
        """Return what is measured."""
        return {
            "steering_id": movement_laws.steering_id(self.length, self.width),
            "movement_time_s": self.now,
            "completed": float(self.over),
            **self._kept.row(self.now),
        }

    def draw_goal(self) -> None:
        """Add the geometry to the trace."""
        self.trace.touched += self._kept.touched
        for side in (-1.0, 1.0):
            self.trace.walls.append(beside(self.points, side * 0.5 * self.width))
        task = self.scenario.task
        if isinstance(task, Slalom):
            spacing = self.points[-1][0] / task.cones
            self.trace.marks += [((n + 0.5) * spacing, 0.0, CONE) for n in range(task.cones)]


class HeadingTrial(DriveTrial):
    """A vehicle at a steady speed whose heading is wrong from the first picture on.

    Args:
        scenario: Vehicle, links, frames.
        seat: Person who drives.
        condition: Error [deg] and width [m].
        streams: Random streams of the trial.
        reaction: See `Trial`.
        leftwards: True if the vehicle points to the left of its path.
    """

    def __init__(
        self,
        scenario: TaskScenario,
        seat: Seat,
        condition: tuple[float, float],
        streams: Streams,
        reaction: float = 0.0,
        *,
        leftwards: bool = True,
    ) -> None:
        super().__init__(scenario, seat, condition, streams, reaction)
        task = scenario.task
        assert isinstance(task, HeadingStep)
        self._watched = task.watched_s
        self._side = 1.0 if leftwards else -1.0
        self.plant.heading += self._side * math.radians(condition[0])
        self.plant.speed = self._top[0]
        self._steered: list[float] = []  # against the error, step by step

    def intended(self, now: float, one: float, other: float) -> None:
        """Do nothing: the machine holds the speed, which tells nothing of the delay."""
        super().intended(now, 0.0, other)

    def _held(self, intent: Intent) -> float:
        """Return nothing: only steering is in the hand, so only that is noisy."""
        return 0.0

    def _motion(self, observation: Observation) -> Pair:
        return 0.0, observation.turn_rate

    def commanded(self, dt: float) -> Pair:
        """Return the speed that the machine holds."""
        _, turn = super().commanded(dt)
        self._steered.append(-self._side * self.device.reading()[1])
        return 1.0, turn

    @override
    def advance(self, dt: float) -> None:
        super().advance(dt)
        self.over = self.now + dt >= self._watched

    def row(self) -> dict[str, Any]:
        """Return when the first correction began, and how long it grew [s]."""
        over = round(SMOOTHED / self.STEP)
        steered = np.convolve(self._steered, np.full(over, 1.0 / over), "same").tolist()
        peak = movement_laws.first_peak(steered)
        peak = movement_laws.first_above(steered, REACHED * steered[peak])
        begun = movement_laws.first_above(steered, ONSET * steered[peak])
        return {
            **super().row(),
            "reaction_s": begun * self.STEP,
            "pulse_s": (peak - begun) * self.STEP,
        }


def beside(points: Points, aside: float) -> Points:
    """Return a line to the left of another one, mitred at its corners [m]."""
    steps = [math.atan2(b[1] - a[1], b[0] - a[0]) for a, b in pairwise(points)]
    before = [steps[0], *steps]
    after = [*steps, steps[-1]]
    line = []
    for (x, y), first, second in zip(points, before, after, strict=True):
        half = 0.5 * math.remainder(second - first, 2.0 * math.pi)
        far = aside / max(math.cos(half), 0.2)
        line.append((x - far * math.sin(first + half), y + far * math.cos(first + half)))
    return line
