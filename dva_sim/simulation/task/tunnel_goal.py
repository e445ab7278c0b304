"""The goal of steering through a tunnel: straight, or once around a circle."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from typing_extensions import override

from dva_sim.agents.operator.strategies import (
    Velocity,
)
from dva_sim.agents.route_following import REACH, Route
from dva_sim.simulation.task import movement_laws
from dva_sim.simulation.task.plants import Cursor, Pair
from dva_sim.simulation.task.pointing import CursorTrial, Goal
from dva_sim.simulation.task.tasks import Tunnel
from dva_sim.simulation.task.trial import MACHINE_GAIN, Trace, WayKept

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
        width: Width from wall to wall [m].
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

    @override
    def check(self, now: float, x: float, y: float, dt: float) -> bool:
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
