"""The goals with a target: pointing, following a moving target, an arm's way from stop to stop."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from dva_sim.agents.operator.strategies import (
    Sighting,
    Velocity,
)
from dva_sim.simulation.task import movement_laws
from dva_sim.simulation.task.plants import Cursor, Pair
from dva_sim.simulation.task.pointing import CursorTrial, Goal
from dva_sim.simulation.task.tasks import Pointing, ReachTask, Tracking
from dva_sim.simulation.task.trial import MACHINE_GAIN, Trace

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
            "id_bits": movement_laws.fitts_id(self.amplitude, self.width),
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
        found = movement_laws.Crossover(math.nan, math.nan)
        if trial.over:
            frequencies = self._task.frequencies
            loop = movement_laws.open_loop(targets, cursors, self._dt, frequencies)
            found = movement_laws.crossover(frequencies, loop)
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
