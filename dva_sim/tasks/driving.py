"""Trials in which a vehicle is driven: around a corner, a slalom, a course."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np

from dva_sim.agents.camera import Observation
from dva_sim.agents.operator.strategies import Driver, Intent, Oracle, Reach, Truth, View
from dva_sim.agents.steering import Route
from dva_sim.streams import Streams
from dva_sim.tasks import measures
from dva_sim.tasks.channel import Channel, normals
from dva_sim.tasks.devices import Joystick, Pair
from dva_sim.tasks.kinds import Corner, Course, Slalom, Task
from dva_sim.tasks.plants import Unicycle
from dva_sim.tasks.recorded import RecordedChannel, Recording
from dva_sim.tasks.scenario import OneWay, TaskScenario
from dva_sim.tasks.trial import Seat, Trial

RUN_OUT = 5.0  # the way goes on so far beyond the finish, so that nobody stops before it [m]
MACHINE_LOOK = 1.0  # of a machine that steers by itself [m]; assumed
CONE = 0.1  # radius in a picture [m]
CONE_STEP = 0.1  # between corners of the line that stands for a slalom [m]
Points = list[Pair]


def way_of(task: Task, first: float, width: float) -> Points:
    """The middle of the way that a vehicle has to take, from (0, 0) along x at first [m].

    Args:
        task: A corner, slalom or course.
        first: The condition's length or spacing [m].
        width: Of the way [m].
    """
    if isinstance(task, Corner):
        leg = 0.5 * first
        return [(0.0, 0.0), (leg, 0.0), (leg, leg)]
    if isinstance(task, Slalom):
        end = task.cones * first
        steps = np.linspace(0.0, end, max(2, round(end / CONE_STEP)) + 1)
        return [(float(x), task.swing_m * math.sin(math.pi * x / first)) for x in steps]
    assert isinstance(task, Course)
    return list(task.points_m)


def length_of(points: Points) -> float:
    """Way along the corners [m]."""
    return sum(math.dist(a, b) for a, b in pairwise(points))


def extended(points: Points, by: float) -> Route:
    """The way, going straight on after its end [m]."""
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
        seat: Who drives.
        condition: See the kinds of tasks.
        streams: The luck of this trial.
        reaction: See `Trial`.
    """

    STEP = 0.01

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
        super().__init__(scenario, seat, Reach(*self._top), streams, reaction)
        self.points = way_of(scenario.task, *condition)
        self.length, self.width = length_of(self.points), condition[1]
        self._limit = 0.5 * (self.width - plant.width_m)
        self._seen_way, self._way = (extended(self.points, RUN_OUT) for _ in range(2))
        self.plant = Unicycle(plant.lag_s, *self._top)
        self.plant.heading = math.atan2(self.points[1][1], self.points[1][0])
        unit = scenario.device.model_copy(update={"gain": 1.0})
        self.device = Joystick(unit, seat.person, streams, self.STEP)
        way = OneWay() if self.is_oracle else scenario.link.up
        self._up: Channel[Pair] = Channel(way, 0.0, streams, "up")
        self._errors = normals(streams.fresh("judgement"))
        self._next_reading, self.path = 0.0, 0.0
        self._squares, self._crossings, self._inside = 0.0, 0, True

    def replay(self, recording: Recording, begin: float) -> None:
        """Take the link from a recording, from `begin` [s] in it on; no link reaches the oracle."""
        if not self.is_oracle:
            self._up = RecordedChannel(recording.up, begin, 0.0)
            self._frames = RecordedChannel(recording.down, begin, self._late)

    def sight(self) -> Observation:
        """See `Trial`."""
        at = self.plant
        tick = round(1000 * self.now)
        return Observation(tick, at.x, at.y, at.heading, at.speed, at.turn_rate, ())

    def decide(self, driver: Driver, seen: Observation, now: float) -> None:
        """See `Trial`."""
        delay = self.seat.delay
        delay.see(now, seen.speed, seen.turn_rate)
        if isinstance(driver, Oracle):
            intent = driver.drive(self._seen_way, Truth(seen), 0.0)
        else:
            intent = driver.drive(self._seen_way, View(now, self._judged(seen), delay.value), 0.0)
        self.device.aim(intent.speed / self._top[0], intent.turn_rate / self._top[1])
        self.intended(now, intent.speed, intent.turn_rate)

    def _judged(self, seen: Observation) -> Observation:
        """As the person takes it: place and heading with an error."""
        person, error = self.seat.person, self._errors
        return seen._replace(
            x=seen.x + person.position_error * next(error),
            y=seen.y + person.position_error * next(error),
            heading=seen.heading + person.heading_error * next(error),
        )

    def advance(self, dt: float) -> None:
        """See `Trial`."""
        now, plant = self.now, self.plant
        self.device.move(dt)
        if now >= self._next_reading - 0.5 * dt:
            self._up.put(now, self.device.reading())
            self._next_reading += self.device.period
        arrived = self._up.take(now + 0.5 * dt)
        speed, turn = self.device.command(arrived[-1] if arrived else None, dt)
        wanted = Intent(speed * self._top[0], turn * self._top[1])
        if self.scenario.automation:
            wanted = self._corrected(self.scenario.automation, wanted)
        plant.step(wanted.speed, wanted.turn_rate, dt)
        self.path += plant.speed * dt
        self._check(dt)

    def _corrected(self, share: float, wanted: Intent) -> Intent:
        """The machine helps to steer (pure pursuit); the speed stays the person's."""
        at = self.plant
        ahead = self._way.ahead(at.x, at.y, at.heading, MACHINE_LOOK)
        own = at.speed * 2.0 * math.sin(ahead.bearing) / max(ahead.distance, 0.1)
        return Intent(wanted.speed, (1.0 - share) * wanted.turn_rate + share * own)

    def _check(self, dt: float) -> None:
        ahead = self._way.ahead(self.plant.x, self.plant.y, 0.0, 0.0)
        self._squares += ahead.offset * ahead.offset * dt
        inside = ahead.offset <= self._limit
        if self._inside and not inside:
            self._crossings += 1
            self.trace.touched.append((self.plant.x, self.plant.y))
        self._inside = inside
        self.over = ahead.remaining <= RUN_OUT

    def row(self) -> dict[str, Any]:
        """What is measured."""
        return {
            "steering_id": measures.steering_id(self.length, self.width),
            "movement_time_s": self.now,
            "completed": float(self.over),
            "error": float(self._crossings > 0),
            "wall_crossings": self._crossings,
            "path_error_rms_m": math.sqrt(self._squares / self.now),
        }

    def place_now(self) -> Pair:
        """See `Trial`."""
        return self.plant.x, self.plant.y

    def draw_goal(self) -> None:
        """Add the geometry to the trace."""
        for side in (-1.0, 1.0):
            self.trace.walls.append(beside(self.points, side * 0.5 * self.width))
        task = self.scenario.task
        if isinstance(task, Slalom):
            spacing = self.points[-1][0] / task.cones
            self.trace.marks += [((n + 0.5) * spacing, 0.0, CONE) for n in range(task.cones)]


def beside(points: Points, aside: float) -> Points:
    """A line to the left of another one, mitred at its corners [m]."""
    steps = [math.atan2(b[1] - a[1], b[0] - a[0]) for a, b in pairwise(points)]
    before, after = [steps[0], *steps], [*steps, steps[-1]]
    line = []
    for (x, y), first, second in zip(points, before, after, strict=True):
        half = 0.5 * math.remainder(second - first, 2.0 * math.pi)
        far = aside / max(math.cos(half), 0.2)
        line.append((x - far * math.sin(first + half), y + far * math.cos(first + half)))
    return line
