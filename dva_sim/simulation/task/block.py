"""Block of trials: one person does the task of a scenario, trial after trial."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from typing_extensions import override

from dva_sim.agents.operator.delay_estimation import DelayEstimate, Timing
from dva_sim.agents.operator.strategies import (
    Velocity,
    load_strategy,
)
from dva_sim.agents.population import Person, draw_person
from dva_sim.agents.route_following import REACH, Route
from dva_sim.kernel.streams import Streams, derive_seed
from dva_sim.simulation.scenario.scenario import population
from dva_sim.simulation.task import movement_laws
from dva_sim.simulation.task.driving import DriveTrial, HeadingTrial
from dva_sim.simulation.task.plants import Cursor, Pair
from dva_sim.simulation.task.pointing import CursorTrial, Goal
from dva_sim.simulation.task.recorded_delays import RecordedDelays
from dva_sim.simulation.task.scenario import TaskScenario
from dva_sim.simulation.task.target_goals import PointGoal, ReachGoal, TrackGoal, Wandering
from dva_sim.simulation.task.tasks import HeadingStep, Pointing, ReachTask, Task, Tracking, Tunnel
from dva_sim.simulation.task.trial import MACHINE_GAIN, Seat, Trace, WayKept

Floats = NDArray[np.float64]

RUN_OUT = 2.0  # length of the path beyond the end, so that nobody stops before it [m]
LAP_SHARE = (
    0.25  # of the tunnel one looks for one's place ahead of the last: laps lie on each other
)
CORNERS = 60  # corners of the polygon that represents a circle for the person


class TunnelGoal(Goal):
    """Get through, without crossing a wall; to cross the end is enough.

    A circle begins at its lowest point and is gone around counter-clockwise.

    Args:
        task: The shape, and what an error does.
        length: Along the middle [m].
        width: Width from wall to wall [m].
    """

    def __init__(self, task: Tunnel, length: float, width: float) -> None:
        self._task = task
        self.length = length
        self.width = width
        self.tolerance = 0.5 * width
        self._radius = length / (2.0 * math.pi) if task.shape == "circular" else 0.0
        self.path = Route(self._way(), min(REACH, LAP_SHARE * length))
        self._kept = WayKept(self.tolerance)
        self._along = 0.0
        self._time = 0.0

    def target(self, now: float) -> Pair:
        """Return the end of the tunnel."""
        return (0.0, 0.0) if self._radius else (self.length, 0.0)

    def place(self, x: float, y: float) -> tuple[float, float, Pair]:
        """Return the way along the middle [m], offset to its left [m], direction there."""
        radius = self._radius
        if not radius:
            return x, y, (1.0, 0.0)
        dx = x
        dy = y - radius
        far = math.hypot(dx, dy) or 1e-12
        turned = math.atan2(dx, -dy)  # since the lowest point, counter-clockwise
        laps = round((self._along / radius - turned) / (2.0 * math.pi))
        return radius * (turned + 2.0 * math.pi * laps), radius - far, (-dy / far, dx / far)

    @override
    def check(self, now: float, x: float, y: float, dt: float) -> bool:
        self._along, offset, _ = self.place(x, y)
        self._time += dt
        inside = self._kept.note(offset, (x, y), dt)
        return self._along >= self.length or (self._task.on_error == "over" and not inside)

    def corrected(self, share: float, now: float, at: Cursor, command: Velocity) -> Velocity:
        """Return the machine's help sideways; the way along the tunnel stays the person's."""
        _, offset, (tx, ty) = self.place(at.x, at.y)
        forward = command[0] * tx + command[1] * ty
        aside = command[1] * tx - command[0] * ty
        aside = (1.0 - share) * aside - share * MACHINE_GAIN * offset
        return forward * tx - aside * ty, forward * ty + aside * tx

    @override
    def row(self, trial: CursorTrial) -> dict[str, Any]:
        through = self._along >= self.length
        return {
            "steering_id": movement_laws.steering_id(self.length, self.width),
            "movement_time_s": trial.now - (trial.moved_at or 0.0),
            "completed": float(through),
            **self._kept.row(self._time),
        }

    @override
    def draw(self, trace: Trace) -> None:
        for side in (-self.tolerance, self.tolerance):
            trace.walls.append([(x, y) for x, y in self._line(side).tolist()])
        trace.touched += self._kept.touched

    def _way(self) -> Floats:
        """Return the middle, going on after the end as before it: nobody has to stop there."""
        if not self._radius:
            return np.array([(0.0, 0.0), (self.length + RUN_OUT, 0.0)])
        ring = self._line(0.0)
        laps = 1 + math.ceil(RUN_OUT / self.length)
        return np.concatenate([ring, *[ring[1:]] * (laps - 1)])

    def _line(self, aside: float) -> Floats:
        """Return a line beside the middle, to its right [m]."""
        if not self._radius:
            return np.array([(0.0, -aside), (self.length, -aside)])
        angles = np.linspace(-0.5 * math.pi, 1.5 * math.pi, CORNERS + 1)
        ring = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        line: Floats = (self._radius + aside) * ring + np.array([0.0, self._radius])
        return line


Row = dict[str, Any]
PRACTISED = 5  # trials after which a person has found a tempo; assumed
REACTIONS = 0.35  # standard deviation of the logarithm of reaction times; fitted (C4)
PAUSE = 1.0  # pause between two trials [s]
FINE = 0.01  # resolution at which the delay is learnt from a cursor [s]


def play(scenario: TaskScenario, seed: int, recording: RecordedDelays | None = None) -> list[Row]:
    """Do all trials; one row each, in order.

    The random numbers of a trial depend on seed, person and number alone, so that two
    devices or delays meet the same noise.

    Args:
        scenario: The task, the person and what lies between.
        seed: Random seed of everything but the choice of the person.
        recording: Recording that replaces the scenario's link, for a vehicle; each trial begins
            somewhere in it.
    """
    return [row for row, _ in _play(scenario, seed, drawn=None, recording=recording)]


def trace_of(scenario: TaskScenario, seed: int, number: int = 0) -> tuple[Row, Trace]:
    """Return the row and trace of one of the trials that are kept, to be drawn."""
    for index, (row, trace) in enumerate(_play(scenario, seed, drawn=number)):
        if index == number:
            return row, trace
    raise IndexError(f"there is no trial {number}")


def rehearse(scenario: TaskScenario) -> None:
    """Make the first trial without letting time pass.

    Raises:
        ConfigError: the person or the device cannot be made.
    """
    first = next(iter(scenario.task.conditions()))
    _trial(scenario, seat_of(scenario), first, 0, Streams(0))


def seat_of(scenario: TaskScenario) -> Seat:
    """Return the person who does the block, without any estimate of the link's delay yet."""
    operator = scenario.operator
    person = draw_person(population(operator), operator.population_seed, operator.person)
    guess = person.perceptual_delay + person.hand_lag
    habits = person.habits.delay
    delay = DelayEstimate(0.0, guess, habits=habits)
    if not scenario.is_driven:
        pace = max(first for first, _ in scenario.task.conditions())  # in a second; assumed
        delay = DelayEstimate(0.0, guess, FINE, (pace, pace), habits, person.hand_lag)
    return Seat(person, load_strategy(operator.strategy, operator.options), delay)


def practised(person: Person, number: int) -> Person:
    """Return the person after `number` trials: quicker by the power law of practice.

    References:
        A. Newell, P. S. Rosenbloom: Mechanisms of skill acquisition and the law of practice, 1981.
    """
    share = ((number + 1) / PRACTISED) ** -person.habits.aiming.practice
    return replace(person, tempo=person.tempo * share)


def in_a_moment(person: Person, alertness: float, task: Task) -> Person:
    """Return the person's state in one trial, quicker or slower to react.

    Where nothing but the first reaction is of interest, what it sees varies as well.

    Args:
        alertness: A standard normal number.
    """
    share = math.exp(REACTIONS * alertness)
    sees = share if isinstance(task, HeadingStep) else 1.0
    return replace(
        person,
        perceptual_delay=person.perceptual_delay * sees,
        reaction=person.reaction * share,
    )


def _play(
    scenario: TaskScenario, seed: int, drawn: int | None, recording: RecordedDelays | None = None
) -> Iterator[tuple[Row, Trace]]:
    seat = seat_of(scenario)
    operator = scenario.operator
    person = seat.person
    conditions = list(scenario.task.conditions())
    plan = [(conditions[0], -1)] * scenario.practice
    plan += [(c, n) for n, c in enumerate(conditions) for _ in range(scenario.trials)]
    for number, (condition, cell) in enumerate(plan):
        counted = number - scenario.practice
        streams = Streams(derive_seed(seed, operator.population_seed, operator.person, number))
        alertness = float(streams.fresh("reaction").normal())
        seat.person = in_a_moment(practised(person, number), alertness, scenario.task)
        seat.timing = Timing(person.habits.aiming, streams.fresh("timing"))
        trial = _trial(scenario, seat, condition, number, streams)
        if recording is not None and isinstance(trial, DriveTrial):
            trial.replay(recording, streams.fresh("recording").uniform(0.0, recording.length))
        trial.run(keep=counted == drawn)
        seat.delay.intend(seat.begun + trial.now, 0.0, 0.0)
        seat.delay.rest()
        seat.begun += trial.now + PAUSE
        if counted >= 0:
            trial.draw_goal()
            yield _row(trial, condition, cell, counted), trial.trace
        if drawn is not None and counted == drawn:
            return


def _trial(
    scenario: TaskScenario,
    seat: Seat,
    condition: tuple[float, float],
    number: int,
    streams: Streams,
) -> CursorTrial | DriveTrial:
    task = scenario.task
    reaction = seat.person.reaction
    if isinstance(task, HeadingStep):
        return HeadingTrial(scenario, seat, condition, streams, reaction, leftwards=number % 2 == 0)
    if scenario.is_driven:
        return DriveTrial(scenario, seat, condition, streams, reaction)
    surprises = isinstance(task, Pointing) and task.cue == "unexpected"
    goal = _goal(scenario, seat.person, condition, number, streams)
    return CursorTrial(scenario, seat, goal, streams, reaction if surprises else 0.0)


def _goal(
    scenario: TaskScenario,
    person: Person,
    condition: tuple[float, float],
    number: int,
    streams: Streams,
) -> Goal:
    task = scenario.task
    first, second = condition
    if isinstance(task, Pointing):
        angle = 0.0 if task.axes == 1 else number * (math.pi + math.pi / task.targets)
        target = Wandering(task, first, angle, streams.fresh("target"))
        return PointGoal(task, target, second, person.hand_lag + scenario.link.up.delay_s)
    if isinstance(task, Tunnel):
        return TunnelGoal(task, first, second)
    if isinstance(task, Tracking):
        rng = streams.fresh("forcing")
        return TrackGoal(task, rng.uniform(0.0, 2.0 * math.pi, len(task.frequencies)).tolist())
    assert isinstance(task, ReachTask)
    return ReachGoal(task, 0.5 * second)


def _row(
    trial: CursorTrial | DriveTrial, condition: tuple[float, float], cell: int, number: int
) -> Row:
    """Return the measures of a trial, with its number and conditions."""
    goal = trial.row() if isinstance(trial, DriveTrial) else trial.goal.row(trial)
    names = NAMES[trial.scenario.task.kind]
    return {
        "number": number,
        "condition": cell,
        **dict(zip(names, condition, strict=True)),
        "since_start": number + 1 + trial.scenario.practice,
        **goal,
        "trial_time_s": trial.now,
        "path_m": trial.path,
        "waits": trial.waits.count,
        "wait_s": trial.waits.seconds,
        "move_and_wait_share": trial.move_and_wait_share,
        "delay_felt_s": trial.seat.delay.value,
        **trial.device.farthest(),
        "plugin_failures": trial.failures + trial.device.failures,
    }


NAMES = {
    "pointing": ("amplitude_m", "width_m"),
    "tunnel": ("length_m", "width_m"),
    "tracking": ("excursion_m", "bandwidth_rad_s"),
    "corner": ("length_m", "width_m"),
    "slalom": ("spacing_m", "width_m"),
    "course": ("length_m", "width_m"),
    "heading_step": ("heading_error_deg", "width_m"),
    "reach": ("length_m", "width_m"),
}
"""Meanings of the two numbers of a condition, by kind of task."""
