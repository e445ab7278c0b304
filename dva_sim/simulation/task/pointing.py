"""Trials in which a cursor, or the tip of an arm, is moved; what is to be done is a goal.

References:
    R. J. Snowden, O. J. Braddick: The temporal integration and resolution of velocity signals.
    Vision Research 31, 1991 (the speed of what is seen for longer than about 100 ms is told apart
    no better).
    D. C. Burr: Temporal summation of moving images by the human visual system. Proc. R. Soc.
    Lond. B 211, 1981 (moving dots are summed over about 100 ms).

The goal of steering through a tunnel: straight, or once around a circle.

The goals with a target: pointing, following a moving target, an arm's way from stop to stop.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections import deque
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dva_sim.agents.operator.strategies import (
    Driver,
    Oracle,
    PathView,
    PointView,
    Reach,
    Sighting,
    Truth,
    Velocity,
)
from dva_sim.agents.route_following import REACH, Route
from dva_sim.kernel.streams import Streams
from dva_sim.simulation.task import measures
from dva_sim.simulation.task.devices import Cursor, Pair, make_device
from dva_sim.simulation.task.scenario import Pointing, ReachTask, TaskScenario, Tracking, Tunnel
from dva_sim.simulation.task.trial import MACHINE_GAIN, Seat, Trace, Trial, WayKept

MOVED = 1e-3  # a cursor that has gone so far has moved [m]; assumed
SUMMED = 0.1  # over so long vision sums motion before it tells a velocity [s]


class Places(NamedTuple):
    """Where cursor and target were at a time [s, m]."""

    time: float
    x: float
    y: float
    target_x: float
    target_y: float


class Motion:
    """Velocities as they are seen: from the frames of the last tenth of a second, two at least.

    Steps that a device makes within that time are not seen one by one, so that a cursor which
    is updated at another rate than it is shown seems to move evenly all the same.
    """

    def __init__(self) -> None:
        self._frames: deque[Places] = deque()

    def add(self, frame: Places) -> None:
        """One more frame is shown."""
        frames, since = self._frames, frame.time - SUMMED - 1e-9
        while len(frames) > 1 and frames[0].time < since:
            frames.popleft()
        frames.append(frame)

    def velocities(self) -> tuple[float, float, float, float]:
        """Of cursor and target along x and y: slopes of the least-squares lines [m/s]."""
        frames = self._frames
        middle = sum(frame.time for frame in frames) / len(frames)
        squares = sum((frame.time - middle) ** 2 for frame in frames)
        sums = [0.0, 0.0, 0.0, 0.0]
        if squares:
            for time, *places in frames:
                share = (time - middle) / squares
                sums = [so_far + share * at for so_far, at in zip(sums, places, strict=True)]
        vx, vy, target_vx, target_vy = sums
        return vx, vy, target_vx, target_vy


def summed_over(rate: float) -> float:
    """The time from the first to the last frame of which a velocity is seen [s].

    Args:
        rate: Frames per second.
    """
    return max(1, math.floor(SUMMED * rate + 1e-6)) / rate


class Goal(ABC):
    """What is to be done with a cursor, and what is measured of it.

    Attributes:
        flat: Whether the cursor only moves along x.
        stands: Whether the target stands where it is; one that takes another's place has no
            velocity, and nobody leads it.
        path: The middle line, if the cursor is led along one.
        tolerance: Half the width of the target or tunnel [m].
    """

    flat = False
    stands = True
    path: Route | None = None
    tolerance: float

    @abstractmethod
    def target(self, now: float) -> Pair:
        """Where the target is [m]."""

    @abstractmethod
    def check(self, now: float, x: float, y: float, dt: float) -> bool:
        """The cursor is at a place [m] for `dt` [s]: is the trial over?"""

    @abstractmethod
    def corrected(self, share: float, now: float, at: Cursor, wanted: Velocity) -> Velocity:
        """The command when a machine makes a share of the correction itself [m/s]."""

    @abstractmethod
    def row(self, trial: CursorTrial) -> dict[str, Any]:
        """What is measured."""

    @abstractmethod
    def draw(self, trace: Trace) -> None:
        """Add the geometry to a picture."""

    def notice(self, now: float, seen: Sighting, delay: float) -> None:  # noqa: B027
        """The person has seen a frame; some goals are reached by what it then does."""

    def holds(self, now: float) -> bool:
        """Whether something else is being done now, during which the cursor stays."""
        return False


class CursorTrial(Trial[Sighting]):
    """One trial with a cursor.

    Args:
        scenario: Device, links, frames.
        seat: Who does it.
        goal: What is to be done.
        streams: The luck of this trial.
        reaction: See `Trial`.

    Attributes:
        path: Way gone so far [m].
        moved_at: When the cursor first moved [s], or None.
    """

    STEP = 0.004
    plant: Cursor

    def __init__(
        self,
        scenario: TaskScenario,
        seat: Seat,
        goal: Goal,
        streams: Streams,
        reaction: float = 0.0,
    ) -> None:
        top = math.inf if scenario.plant.speed_mps is None else scenario.plant.speed_mps
        config = scenario.device
        if isinstance(scenario.task, ReachTask):
            config = config.model_copy(update={"gain": top})
        device = make_device(config, seat.person, streams, self.STEP)
        self.plant = Cursor(scenario.plant.lag_s, top)
        reach = Reach(min(top, device.top), 0.0)
        super().__init__(scenario, seat, reach, device, streams, reaction)
        self.goal = goal
        self._motion, self._summed = Motion(), summed_over(scenario.frames.rate_hz)
        self.moved_at: float | None = None

    def sight(self) -> Sighting:
        """Velocities are those of the last frames; see `Motion`."""
        now, (x, y) = self.now, (self.plant.x, self.plant.y)
        tx, ty = self.goal.target(now)
        self._motion.add(Places(now, x, y, tx, ty))
        vx, vy, tvx, tvy = self._motion.velocities()
        if self.goal.stands:
            tvx = tvy = 0.0
        return Sighting(
            tick=round(1000 * now),
            x=x,
            y=y,
            vx=vx,
            vy=vy,
            target_x=tx,
            target_y=ty,
            target_vx=tvx,
            target_vy=tvy,
            tolerance=self.goal.tolerance,
        )

    def decide(self, driver: Driver, seen: Sighting, now: float) -> None:
        """See `Trial`."""
        delay = self.seat.delay
        delay.see(now, seen.vx, seen.vy, self._summed)
        vx, vy = self._ask(driver, seen, now, delay.value)
        self.goal.notice(self.now, seen, delay.value)
        if self.goal.flat:
            vy = 0.0
        self.device.aim(vx, vy)
        self.intended(now, vx, vy)

    def _ask(self, driver: Driver, seen: Sighting, now: float, delay: float) -> Velocity:
        path = self.goal.path
        if isinstance(driver, Oracle):
            truth = Truth(seen)
            return driver.point(truth) if path is None else driver.follow(path, truth)
        if path is None:
            return driver.point(PointView(now, seen, delay))
        return driver.follow(PathView(now, seen, delay, path))

    def advance(self, dt: float) -> None:
        """See `Trial`."""
        now, plant, goal, wanted = self.now, self.plant, self.goal, self.commanded(dt)
        if self.scenario.automation:
            wanted = goal.corrected(self.scenario.automation, now, plant, wanted)
        if goal.holds(now):
            wanted = 0.0, 0.0
        plant.step(wanted[0], 0.0 if goal.flat else wanted[1], dt)
        self.path += math.hypot(plant.vx, plant.vy) * dt
        if self.moved_at is None and self.path > MOVED:
            self.moved_at = now + dt
        self.over = goal.check(now + dt, plant.x, plant.y, dt)

    def draw_goal(self) -> None:
        """Add the geometry to the trace."""
        self.goal.draw(self.trace)


Floats = NDArray[np.float64]

RUN_OUT = 2.0  # the way goes on so far beyond the end, so that nobody stops before it [m]
WITHIN = 0.25  # of the tunnel one looks for one's place ahead of the last: laps lie on each other
CORNERS = 60  # of the polygon that stands for the middle of a circle, for the person


class TunnelGoal(Goal):
    """Get through, without crossing a wall; to cross the end is enough.

    A circle begins at its lowest point and is gone around counter-clockwise.

    Args:
        task: The shape, and what an error does.
        length: Along the middle [m].
        width: From wall to wall [m].
    """

    def __init__(self, task: Tunnel, length: float, width: float) -> None:
        self._task, self.length, self.width = task, length, width
        self.tolerance = 0.5 * width
        self._radius = length / (2.0 * math.pi) if task.shape == "circular" else 0.0
        self.path = Route(self._way(), min(REACH, WITHIN * length))
        self._kept, self._along, self._time = WayKept(self.tolerance), 0.0, 0.0

    def target(self, now: float) -> Pair:
        """The end of the tunnel."""
        return (0.0, 0.0) if self._radius else (self.length, 0.0)

    def place(self, x: float, y: float) -> tuple[float, float, Pair]:
        """Way along the middle [m], offset to its left [m], direction there."""
        radius = self._radius
        if not radius:
            return x, y, (1.0, 0.0)
        dx, dy = x, y - radius
        far = math.hypot(dx, dy) or 1e-12
        turned = math.atan2(dx, -dy)  # since the lowest point, counter-clockwise
        laps = round((self._along / radius - turned) / (2.0 * math.pi))
        return radius * (turned + 2.0 * math.pi * laps), radius - far, (-dy / far, dx / far)

    def check(self, now: float, x: float, y: float, dt: float) -> bool:
        """See `Goal`."""
        self._along, offset, _ = self.place(x, y)
        self._time += dt
        inside = self._kept.note(offset, (x, y), dt)
        return self._along >= self.length or (self._task.on_error == "over" and not inside)

    def corrected(self, share: float, now: float, at: Cursor, wanted: Velocity) -> Velocity:
        """The machine helps sideways; the way along the tunnel stays the person's."""
        _, offset, (tx, ty) = self.place(at.x, at.y)
        forward = wanted[0] * tx + wanted[1] * ty
        aside = wanted[1] * tx - wanted[0] * ty
        aside = (1.0 - share) * aside - share * MACHINE_GAIN * offset
        return forward * tx - aside * ty, forward * ty + aside * tx

    def row(self, trial: CursorTrial) -> dict[str, Any]:
        """See `Goal`."""
        through = self._along >= self.length
        return {
            "steering_id": measures.steering_id(self.length, self.width),
            "movement_time_s": trial.now - (trial.moved_at or 0.0),
            "completed": float(through),
            **self._kept.row(self._time),
        }

    def draw(self, trace: Trace) -> None:
        """See `Goal`."""
        for side in (-self.tolerance, self.tolerance):
            trace.walls.append([(x, y) for x, y in self._line(side).tolist()])
        trace.touched += self._kept.touched

    def _way(self) -> Floats:
        """The middle, going on after the end as before it: nobody has to stop there."""
        if not self._radius:
            return np.array([(0.0, 0.0), (self.length + RUN_OUT, 0.0)])
        ring = self._line(0.0)
        laps = 1 + math.ceil(RUN_OUT / self.length)
        return np.concatenate([ring, *[ring[1:]] * (laps - 1)])

    def _line(self, aside: float) -> Floats:
        """A line beside the middle, to its right [m]."""
        if not self._radius:
            return np.array([(0.0, -aside), (self.length, -aside)])
        angles = np.linspace(-0.5 * math.pi, 1.5 * math.pi, CORNERS + 1)
        ring = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        line: Floats = (self._radius + aside) * ring + np.array([0.0, self._radius])
        return line


SAMPLE_STEPS = 5  # a tracking record keeps every fifth step


class ToTarget(Goal):
    """What goals with a target share."""

    def corrected(self, share: float, now: float, at: Cursor, wanted: Velocity) -> Velocity:
        """All that is wanted here is correction: it is shared as a whole."""
        tx, ty = self.target(now)
        own = 1.0 - share
        return (
            own * wanted[0] + share * MACHINE_GAIN * (tx - at.x),
            own * wanted[1] + share * MACHINE_GAIN * (ty - at.y),
        )


class PointGoal(ToTarget):
    """Select a target.

    Args:
        task: How it is selected.
        amplitude: To its centre [m].
        width: Of the target [m].
        angle: Direction of the target [rad].
        press: From the decision to press a button to the press at the machine [s].
    """

    def __init__(
        self, task: Pointing, amplitude: float, width: float, angle: float, press: float
    ) -> None:
        self._task, self.amplitude, self.width = task, amplitude, width
        self.flat = task.axes == 1
        self.tolerance = 0.5 * (width - task.cursor_m)
        self._axis = math.cos(angle), math.sin(angle)
        self._at = amplitude * self._axis[0], amplitude * self._axis[1]
        self._press, self._pressed_at = press, math.inf
        self._inside_since: float | None = None
        self._selected = False
        self._end, self._left = 0.0, 0
        self._touched: list[Pair] = []

    def target(self, now: float) -> Pair:
        """See `Goal`."""
        return self._at

    def notice(self, now: float, seen: Sighting, delay: float) -> None:
        """Who sees the cursor inside, so slow that it stays inside, presses."""
        if self._task.selection != "click" or self._pressed_at < math.inf:
            return
        off = math.hypot(seen.x - seen.target_x, seen.y - seen.target_y)
        if off + math.hypot(seen.vx, seen.vy) * delay <= self.tolerance:
            self._pressed_at = now + self._press

    def check(self, now: float, x: float, y: float, dt: float) -> bool:
        """See `Goal`."""
        dx, dy = x - self._at[0], y - self._at[1]
        inside = dx * dx + dy * dy <= self.tolerance * self.tolerance
        if inside and self._inside_since is None:
            self._inside_since = now
        elif not inside and self._inside_since is not None:
            self._inside_since = None
            self._left += 1
            self._touched.append((x, y))
        if self._is_selected(now, inside):
            self._selected = inside
            self._end = dx * self._axis[0] + dy * self._axis[1]
            return True
        return False

    def _is_selected(self, now: float, inside: bool) -> bool:
        if self._task.selection == "click":
            return now >= self._pressed_at
        since, wait = self._inside_since, self._task.dwell_s
        return inside and (self._task.selection == "first_entry" or now - (since or 0.0) >= wait)

    def row(self, trial: CursorTrial) -> dict[str, Any]:
        """See `Goal`; a trial that was given up counts with its horizon."""
        from_movement = self._task.timed_from == "movement"
        begun = (trial.moved_at or 0.0) if from_movement else 0.0
        return {
            "id_bits": measures.fitts_id(self.amplitude, self.width),
            "movement_time_s": trial.now - begun,
            "completed": float(trial.over),
            "error": float(trial.over and not self._selected),
            "end_m": self._end if trial.over else math.nan,
            "overshoots": self._left,
        }

    def draw(self, trace: Trace) -> None:
        """See `Goal`."""
        trace.marks.append((*self._at, 0.5 * self.width))
        trace.touched += self._touched


class TrackGoal(ToTarget):
    """Keep the cursor on a target that moves on a line.

    Args:
        task: The sines.
        phases: Of them, `(k,)` [rad].
    """

    flat, stands = True, False

    def __init__(self, task: Tracking, phases: list[float]) -> None:
        self._task, self.tolerance = task, 0.0
        self._waves = list(zip(task.amplitudes_m, task.frequencies, phases, strict=True))
        self._targets: list[float] = []
        self._cursors: list[float] = []
        self._steps, self._dt = 0, 0.0

    def target(self, now: float) -> Pair:
        """See `Goal`."""
        return sum(a * math.sin(w * now + p) for a, w, p in self._waves), 0.0

    def check(self, now: float, x: float, y: float, dt: float) -> bool:
        """See `Goal`."""
        task = self._task
        if now < task.warm_up_s + 0.5 * dt:
            return False
        self._steps, self._dt = self._steps + 1, SAMPLE_STEPS * dt
        if self._steps % SAMPLE_STEPS == 1:
            self._targets.append(self.target(now)[0])
            self._cursors.append(x)
        return self._steps * dt >= task.record_s - 0.5 * dt

    def row(self, trial: CursorTrial) -> dict[str, Any]:
        """See `Goal`; without a whole record there is no crossover."""
        targets, cursors = np.array(self._targets), np.array(self._cursors)
        found = measures.Crossover(math.nan, math.nan)
        if trial.over:
            frequencies = self._task.frequencies
            loop = measures.open_loop(targets, cursors, self._dt, frequencies)
            found = measures.crossover(frequencies, loop)
        return {
            "movement_time_s": trial.now,
            "completed": float(trial.over),
            "tracking_error_rms_m": float(np.sqrt(np.mean((targets - cursors) ** 2))),
            "target_rms_m": float(np.sqrt(np.mean(targets**2))),
            "crossover_rad_s": found.frequency,
            "phase_margin_deg": math.degrees(found.phase_margin),
        }

    def draw(self, trace: Trace) -> None:
        """The target beside the cursor, over time."""
        trace.walls.append([(t, self.target(t)[0]) for t in trace.times])


class ReachGoal(ToTarget):
    """Bring an arm's tip to one stop after another; the work there takes its time.

    Args:
        task: The stops.
        tolerance: Either way [m].
    """

    def __init__(self, task: ReachTask, tolerance: float) -> None:
        self._task, self.tolerance = task, tolerance
        self._at, self._inside_since, self._works_until = 0, math.inf, -math.inf
        self._left = 0
        self._touched: list[Pair] = []

    def target(self, now: float) -> Pair:
        """See `Goal`."""
        stop = self._task.stops[min(self._at, len(self._task.stops) - 1)]
        return stop.swing_m, stop.reach_m

    def holds(self, now: float) -> bool:
        """While the work is done, the tip stays."""
        return now < self._works_until

    def check(self, now: float, x: float, y: float, dt: float) -> bool:
        """See `Goal`."""
        if self.holds(now):
            return False
        if self._works_until > 0.0:
            self._at, self._works_until = self._at + 1, -math.inf
            self._inside_since = math.inf
            if self._at >= len(self._task.stops):
                return True
        tx, ty = self.target(now)
        if abs(x - tx) > self.tolerance or abs(y - ty) > self.tolerance:
            if self._inside_since < math.inf:
                self._left += 1
                self._touched.append((x, y))
            self._inside_since = math.inf
        elif self._inside_since == math.inf:
            self._inside_since = now
        if now - self._inside_since >= self._task.settle_s:
            self._works_until = now + self._task.stops[self._at].work_s + dt
        return False

    def row(self, trial: CursorTrial) -> dict[str, Any]:
        """See `Goal`."""
        work = sum(stop.work_s for stop in self._task.stops[: self._at])
        return {
            "movement_time_s": trial.now,
            "work_s": work,
            "completed": float(trial.over),
            "stops": self._at,
            "overshoots": self._left,
        }

    def draw(self, trace: Trace) -> None:
        """See `Goal`."""
        trace.marks += [(s.swing_m, s.reach_m, self.tolerance) for s in self._task.stops]
        trace.touched += self._touched
