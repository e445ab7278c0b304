"""Robots and people from above, with their goals, activities and trails."""

from __future__ import annotations

import math
from bisect import bisect_right
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgba
from matplotlib.markers import MarkerStyle
from matplotlib.patches import Circle, Wedge
from matplotlib.path import Path

from dva_sim.recordings.pictures import style
from dva_sim.recordings.pictures.colours import BYSTANDER, ROBOT
from dva_sim.recordings.pictures.moments import FRESH_FOR_S, Moments, kind_of

LARGER = 1.25  # bodies are drawn a little larger than they are


STEP = 0.5  # interval between the points of a trail [s]


CONE = 2.5  # length of the view cone [m]


class DrawnBody:
    """A body drawn with its trail; for a driven robot also what its operator sees.

    Args:
        ax: Axes to draw on.
        moments: The run.
        name: Name of the robot or person.
    """

    def __init__(self, ax: Axes, moments: Moments, name: str) -> None:
        self.name = name
        self.kind = kind_of(name)
        self._ax = ax
        self._moments = moments
        person = self.kind == BYSTANDER
        self._trail = LineCollection(
            [], linewidths=0.7 if person else 1.5, zorder=5, capstyle="round", animated=True
        )
        ax.add_collection(self._trail, autolim=False)
        (self._mark,) = ax.plot(
            [], [], ls="none", mec="white", mew=0.5 if person else 0.9, zorder=7, animated=True
        )
        self._ghost = _Ghost(ax, moments, name) if self.kind == ROBOT else None

    def size(self) -> float:
        """Diameter on the picture [points]: true to scale, but never too small to see."""
        (x0, _), (x1, _) = self._ax.transData.transform([(0, 0), (1, 0)])
        metre = (x1 - x0) * 72 / self._ax.figure.dpi
        return max(
            float(2 * LARGER * self._moments.radius(self.name) * metre), style.SMALLEST[self.kind]
        )

    def place(self, time: float) -> tuple[float, float]:
        """Return its position [m]."""
        here = self._moments.at(self.name, time)
        return here.x, here.y

    def is_there(self, time: float) -> bool:
        """Return True if it is still on the site."""
        return self._moments.is_there(self.name, time)

    def show(self, time: float) -> list[Artist]:
        """Return the body at a moment [s]."""
        past = self._moments.past(self.name, time)
        step = max(1, round(STEP / max(1e-3, (past[-1].time - past[0].time) / len(past))))
        past = [*past[:-1:step], past[-1]]
        places = np.array([(p.x, p.y) for p in past])
        moved = np.hypot(*np.diff(places, axis=0).T) > 1e-3
        self._trail.set_segments(np.stack([places[:-1], places[1:]], axis=1)[moved])
        colours = [
            to_rgba(
                style.choose_colour(self.kind, p.mode),
                0.1 + 0.75 * math.exp(-(time - p.time) / style.TRAIL_S),
            )
            for p, here in zip(past[1:], moved, strict=True)
            if here
        ]
        self._trail.set_color(colours)
        if not self.is_there(time):
            return [self._trail]
        here = self._moments.at(self.name, time)
        self._mark.set_data([here.x], [here.y])
        outline = style.OUTLINES[self.kind]
        pointed: Any = MarkerStyle(Path([*outline, outline[0]], closed=True))
        self._mark.set(
            marker=pointed.rotated(rad=here.heading),
            markersize=self.size() * style.LENGTHS[self.kind],
            markerfacecolor=style.choose_colour(self.kind, here.mode),
        )
        ghost = self._ghost.show(time) if self._ghost else []
        return [self._trail, *ghost, self._mark]


class _Ghost:
    """Position at which the operator believes a robot to be, while there is a picture."""

    def __init__(self, ax: Axes, moments: Moments, name: str) -> None:
        recording = moments.recording
        self._views = recording.recorder.views.get(recording.robot_named(name) or "", [])
        self._times = [p.time for p in self._views]
        self._half = recording.scenario.camera.field_of_view_deg / 2
        radius = LARGER * moments.radius(name)
        self._cone = Wedge((0, 0), CONE, 0, 1, fc=style.GHOST, ec="none", alpha=0.22, zorder=6.2,
                           animated=True)  # fmt: skip
        self._ring = Circle((0, 0), radius, fc="none", ec=style.GHOST, lw=1.4, ls="--", zorder=7.2,
                            animated=True)  # fmt: skip
        ax.add_patch(self._cone)
        ax.add_patch(self._ring)

    def show(self, time: float) -> list[Artist]:
        index = bisect_right(self._times, time) - 1
        if index < 0 or time - self._times[index] > FRESH_FOR_S:
            return []
        view = self._views[index]
        heading = math.degrees(view.heading)
        self._ring.center = view.x, view.y
        self._cone.set_center((view.x, view.y))
        self._cone.set_theta1(heading - self._half)
        self._cone.set_theta2(heading + self._half)
        return [self._cone, self._ring]
