"""Where the delay comes from: one stack of stages for each cell, beside what was measured."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from dva_sim.experiments.effects import Factor, Floats, Setting, View, nan_mean
from dva_sim.experiments.figures.keys import box
from dva_sim.experiments.figures.numbers import Numbers
from dva_sim.experiments.figures.palette import INK, PAPER, STAGES
from dva_sim.experiments.figures.stacks import Stacks, stack
from dva_sim.experiments.figures.style import Drawn, finish
from dva_sim.experiments.labels import Level

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

_NAMES = {
    "delay_frame_s": "frame (until the next)",
    "delay_downlink_s": "down-link",
    "delay_human_s": "human (perception)",
    "delay_hand_s": "hand",
    "delay_filter_s": "filter",
    "delay_sampling_s": "sampling (command period)",
    "delay_pattern_s": "pattern (waits to be sent)",
    "delay_uplink_s": "up-link",
    "delay_processing_s": "processing",
    "delay_motor_s": "motor",
}
_MEASURED = "loop_delay_measured_s"


def delay_budget(view: View) -> Drawn | None:
    """The delay from a picture to its effect, as the sum it is and as it was measured."""
    stages = [column for column in _NAMES if view.part.has(column)]
    if not stages:
        return None
    view = _driven(view, stages[0])
    stacks, numbers = Stacks(view, "Delay [s]", _parts(stages)), Numbers()
    for ax, panel, level in stacks.panels():
        means = {stage: _means(view, stage, panel, level) for stage in stages}
        measured = _means(view, _MEASURED, panel, level)
        stack(ax, means, STAGES)
        _mark(ax, measured)
        told = view.along_x() | means | {_MEASURED: measured}
        numbers.add(view.setting(panel, level), told)
    stacks.close()
    caption = (
        "From what the camera saw to the effect of the command it led to, stage by stage; means "
        "over the time that commands were in force. Hatched stages: a value waits to be replaced "
        "by the next. Diamond: the same delay measured as a whole."
    )
    return finish(stacks.figure, "delay_budget", "Where the delay comes from", caption, numbers)


def _driven(view: View, stage: str) -> View:
    """Without the lines under which nobody drove, such as guards without robots."""
    if view.line is None:
        return view
    name, grid = view.line.name, view.part.grid(stage)
    there = [v for v in view.lines if np.isfinite(view.part.where(grid, {name: v})).any()]
    return replace(view, line=Factor(name, tuple(there)))


def _means(view: View, column: str, panel: Setting, level: Level) -> Floats:
    """Over all runs of each stop."""
    values = view.curve(view.part.grid(column), panel, level)
    return nan_mean(values.reshape(len(values), -1), axis=1)


def _mark(ax: Axes, measured: Floats) -> None:
    """The whole as it was measured."""
    stops = range(len(measured))
    ax.plot(measured, stops, "D", ms=4.5, color=PAPER, mec=INK, mew=1.1, zorder=3)


def _parts(stages: list[str]) -> dict[str, Artist]:
    """For the key, in the order of the stack."""
    from matplotlib.lines import Line2D

    mark = Line2D([], [], marker="D", ms=4.5, ls="", color=PAPER, mec=INK)
    return {_NAMES[stage]: box(STAGES[stage]) for stage in stages} | {"as measured": mark}
