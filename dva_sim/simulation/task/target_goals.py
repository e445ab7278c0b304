"""The goals with a target: pointing, following a moving target, an arm's way from stop to stop."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from typing_extensions import override

from dva_sim.agents.operator.strategies import Velocity
from dva_sim.simulation.task import movement_laws
from dva_sim.simulation.task.plants import Cursor, Pair
from dva_sim.simulation.task.pointing import CursorTrial, Goal
from dva_sim.simulation.task.tasks import Pointing, ReachTask, Tracking
from dva_sim.simulation.task.trial import MACHINE_GAIN, Trace

SAMPLE_STEPS = 5  # a tracking record keeps every fifth step


class ToTarget(Goal):
    """Base class of goals with a target."""

    def corrected(self, share: float, now: float, at: Cursor, command: Velocity) -> Velocity:
        """Return the whole of what is wanted: all of it is correction."""
        tx, ty = self.target(now)
        weight = 1.0 - share
        return (
            weight * command[0] + share * MACHINE_GAIN * (tx - at.x),
            weight * command[1] + share * MACHINE_GAIN * (ty - at.y),
        )


class Wandering:
    """Target of a pointing trial that stands, or moves straight on until it turns.

    Args:
        task: Its speed and how often it turns.
        amplitude: Way to where it appears [m].
        angle: Direction of that place [rad].
        rng: Random generator of its motion.
    """

    LIMIT = 1.5  # amplitudes from the start at which it turns back

    def __init__(
        self, task: Pointing, amplitude: float, angle: float, rng: np.random.Generator
    ) -> None:
        self.amplitude = amplitude
        self.axis = (math.cos(angle), math.sin(angle))
        self._task = task
        self._rng = rng
        self.edge = self.LIMIT * amplitude
        self._time = 0.0
        self._place = (amplitude * self.axis[0], amplitude * self.axis[1])
        self._velocity = (0.0, 0.0)
        self._turns_at = math.inf
        if task.target_mps:
            self._turn()

    def at(self, now: float) -> Pair:
        """Return its position [m]; time must not go back."""
        if not self._task.target_mps:
            return self._place
        while self._turns_at <= now:
            self._go_on(self._turns_at)
            self._turn()
        self._go_on(now)
        return self._place

    def _go_on(self, now: float) -> None:
        """Go straight on until `now` [s], and back from the limit."""
        passed = now - self._time
        limit = self.edge
        x, y = self._place
        vx, vy = self._velocity
        x = x + vx * passed
        y = y + vy * passed
        vx = -abs(vx) if x > limit else abs(vx) if x < -limit else vx
        vy = -abs(vy) if y > limit else abs(vy) if y < -limit else vy
        self._time = now
        self._place = (x, y)
        self._velocity = (vx, vy)

    def _turn(self) -> None:
        task = self._task
        rng = self._rng
        angle = float(rng.uniform(0.0, 2.0 * math.pi))
        if task.axes == 1:
            angle = math.pi * (angle < math.pi)
        self._velocity = task.target_mps * math.cos(angle), task.target_mps * math.sin(angle)
        every = task.turns_every_s
        self._turns_at = self._time + float(rng.exponential(every)) if every else math.inf


class PointGoal(ToTarget):
    """Goal of selecting a target.

    Args:
        task: Rules of selection.
        target: Motion of the target.
        width: Width of the target [m].
        press: Time from the decision to press a button to the press at the machine [s].
    """

    def __init__(self, task: Pointing, target: Wandering, width: float, press: float) -> None:
        self._task = task
        self._way = target
        self.width = width
        self.amplitude = target.amplitude
        self.flat = task.axes == 1
        self.is_stationary = not task.target_mps
        self.tolerance = 0.5 * (width - task.cursor_m)
        self.edge = target.edge
        self._press = press
        self._pressed_at = math.inf
        self._presses = 0
        self._inside_since: float | None = None
        self._selected = False
        self._end = 0.0
        self._off = 0.0
        self._left = 0
        self._touched: list[Pair] = []

    @override
    def target(self, now: float) -> Pair:
        return self._way.at(now)

    @override
    def press(self, now: float) -> None:
        self._pressed_at = now + self._press
        self._presses += 1

    @property
    @override
    def awaits_press(self) -> bool:
        return self._task.selection == "click" and self._pressed_at == math.inf

    @override
    def check(self, now: float, x: float, y: float, dt: float) -> bool:
        tx, ty = self.target(now)
        axis = self._way.axis
        dx = x - tx
        dy = y - ty
        inside = dx * dx + dy * dy <= self.tolerance * self.tolerance
        if inside and self._inside_since is None:
            self._inside_since = now
        elif not inside and self._inside_since is not None:
            self._inside_since = None
            self._left += 1
            self._touched.append((x, y))
        if not self._is_selected(now, inside):
            return False
        if not inside and self._task.misses == "again":
            self._pressed_at = math.inf
            return False
        self._selected = inside
        self._end = dx * axis[0] + dy * axis[1]
        self._off = math.hypot(dx, dy)
        return True

    def _is_selected(self, now: float, inside: bool) -> bool:
        if self._task.selection == "click":
            return now >= self._pressed_at
        since = self._inside_since
        wait = self._task.dwell_s
        return inside and (self._task.selection == "first_entry" or now - (since or 0.0) >= wait)

    @override
    def row(self, trial: CursorTrial) -> dict[str, Any]:
        # A trial that was given up counts with its horizon.
        from_movement = self._task.timed_from == "movement"
        begun = (trial.moved_at or 0.0) if from_movement else 0.0
        return {
            "id_bits": movement_laws.fitts_id(self.amplitude, self.width),
            "movement_time_s": trial.now - begun,
            "completed": float(trial.over),
            "error": float(trial.over and not self._selected),
            "end_m": self._end if trial.over else math.nan,
            "presses": self._presses,
            "miss_m": self._off if trial.over else math.nan,
            "overshoots": self._left,
        }

    @override
    def draw(self, trace: Trace) -> None:
        trace.marks.append((*self._way.at(0.0), 0.5 * self.width))
        trace.touched += self._touched


class TrackGoal(ToTarget):
    """Keep the cursor on a target that moves on a line.

    Args:
        task: The sines.
        phases: Phases of the sines, `(k,)` [rad].
    """

    flat = True

    def __init__(self, task: Tracking, phases: list[float]) -> None:
        self.is_stationary = self.is_pushed = task.moves == "cursor"
        self._task = task
        self.tolerance = 0.0
        self._waves = list(zip(task.amplitudes_m, task.frequencies, phases, strict=True))
        self._targets: list[float] = []
        self._cursors: list[float] = []
        self._steps = 0
        self._dt = 0.0
        self._last_command = 0.0

    @override
    def target(self, now: float) -> Pair:
        return (0.0 if self.is_stationary else self._sum(now)), 0.0

    @override
    def pushed(self, now: float, command: Velocity) -> Velocity:
        # The command is kept, as the answer to the push.
        self._last_command = command[0]
        return (command[0] + self._sum(now), command[1]) if self.is_stationary else command

    def _sum(self, now: float) -> float:
        return sum(a * math.sin(w * now + p) for a, w, p in self._waves)

    @override
    def check(self, now: float, x: float, y: float, dt: float) -> bool:
        task = self._task
        if now < task.warm_up_s + 0.5 * dt:
            return False
        self._steps += 1
        self._dt = SAMPLE_STEPS * dt
        if self._steps % SAMPLE_STEPS == 1:
            self._targets.append(self._sum(now - dt if self.is_stationary else now))
            self._cursors.append(-self._last_command if self.is_stationary else x)
        return self._steps * dt >= task.record_s - 0.5 * dt

    @override
    def row(self, trial: CursorTrial) -> dict[str, Any]:
        # Without a whole record the crossover is nan.
        targets = np.array(self._targets)
        cursors = np.array(self._cursors)
        crossover = movement_laws.Crossover(math.nan, math.nan)
        if trial.over:
            frequencies = self._task.frequencies
            loop = movement_laws.open_loop(targets, cursors, self._dt, frequencies)
            crossover = movement_laws.crossover(frequencies, loop)
        return {
            "movement_time_s": trial.now,
            "completed": float(trial.over),
            "tracking_error_rms_m": float(np.sqrt(np.mean((targets - cursors) ** 2))),
            "target_rms_m": float(np.sqrt(np.mean(targets**2))),
            "crossover_rad_s": crossover.frequency,
            "phase_margin_deg": math.degrees(crossover.phase_margin),
        }

    def draw(self, trace: Trace) -> None:
        """Draw the target beside the cursor, over time."""
        trace.walls.append([(t, self._sum(t)) for t in trace.times])


class ReachGoal(ToTarget):
    """Bring an arm's tip to one stop after another; the work there takes its time.

    Args:
        task: The stops.
        tolerance: Either way [m].
    """

    def __init__(self, task: ReachTask, tolerance: float) -> None:
        self._task = task
        self.tolerance = tolerance
        self._at = 0
        self._inside_since = math.inf
        self._works_until = -math.inf
        self._left = 0
        self._touched: list[Pair] = []

    @override
    def target(self, now: float) -> Pair:
        stop = self._task.stops[min(self._at, len(self._task.stops) - 1)]
        return stop.swing_m, stop.reach_m

    def holds(self, now: float) -> bool:
        """Return True while the tip stays in the work."""
        return now < self._works_until

    @override
    def check(self, now: float, x: float, y: float, dt: float) -> bool:
        if self.holds(now):
            return False
        if self._works_until > 0.0:
            self._at += 1
            self._works_until = -math.inf
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

    @override
    def row(self, trial: CursorTrial) -> dict[str, Any]:
        work = sum(stop.work_s for stop in self._task.stops[: self._at])
        return {
            "movement_time_s": trial.now,
            "work_s": work,
            "completed": float(trial.over),
            "stops": self._at,
            "overshoots": self._left,
        }

    @override
    def draw(self, trace: Trace) -> None:
        trace.marks += [(s.swing_m, s.reach_m, self.tolerance) for s in self._task.stops]
        trace.touched += self._touched
