"""Where the delay comes from: one stack of stages for each cell, beside what was measured."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dva_sim.experiments.effects import Floats, Setting, View, nan_mean
from dva_sim.experiments.figures.numbers import Numbers
from dva_sim.experiments.figures.style import (
    INK,
    Drawn,
    bars,
    finish,
    outer_labels,
    panels,
    stops_axis,
    wrapped,
)
from dva_sim.experiments.labels import Level, level_name

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# The way around the loop, from what the camera saw: blue the link, grey the person, orange the
# phone, each of them pale or dark. Hatched is what holds a value until the next one comes.
_STAGES = {
    "delay_frame_s": ("frame (until the next)", "#d3ebf8", "////"),
    "delay_downlink_s": ("down-link", "#56b4e9", ""),
    "delay_human_s": ("human (perception)", "#d4d4d4", ""),
    "delay_hand_s": ("hand", "#8a8a8a", ""),
    "delay_filter_s": ("filter", "#e69f00", ""),
    "delay_sampling_s": ("sampling (command period)", "#fbe3a6", "////"),
    "delay_pattern_s": ("pattern (waits to be sent)", "#d55e00", ""),
    "delay_uplink_s": ("up-link", "#0072b2", ""),
    "delay_processing_s": ("processing", "#cc79a7", ""),
    "delay_motor_s": ("motor", "#3b3b3b", ""),
}
_MEASURED = "loop_delay_measured_s"


def delay_budget(view: View) -> Drawn | None:
    """The delay from a picture to its effect, as the sum it is and as it was measured."""
    stages = [column for column in _STAGES if view.part.has(column)]
    if not stages:
        return None
    shown, numbers = view.shown, Numbers()
    height = 2.7 if len(shown) < 3 else 2.2
    figure, axes = panels(len(shown), len(view.lines), height, sharex=True, sharey=True)
    for row, panel in zip(axes, shown, strict=True):
        for ax, level in zip(row, view.lines, strict=True):
            means = {stage: _means(view, stage, panel, level) for stage in stages}
            measured = _means(view, _MEASURED, panel, level)
            _stack(ax, means)
            _mark(ax, measured)
            told = view.along_x() | means | {_MEASURED: measured}
            numbers.add(view.setting(panel, level), told)
            stops_axis(ax, view.over)
            if view.line and row is axes[0]:
                ax.set_title(wrapped(level_name(view.line.name, level), 70 // len(view.lines)))
    axes[0][0].set_ylim(bottom=0)  # last: it ends the fitting of all axes to what is drawn
    outer_labels(axes, shown, "Delay [s]")
    _key(figure, stages)
    caption = (
        "Means over the time that commands were in force, from what a camera saw to the effect of "
        "the command it led to: stacked, because a delay is a sum. Hatched: a value stands until "
        "the next one replaces it, which counts once. Diamond: the same delay measured as a "
        "whole, by the time of capture that travels with each command. From sampling to "
        "processing it is the age of the command in force."
    )
    return finish(figure, "delay_budget", "Where the delay comes from", caption, numbers)


def _means(view: View, column: str, panel: Setting, level: Level) -> Floats:
    """Over all runs of each stop."""
    values = view.curve(view.part.grid(column), panel, level)
    return nan_mean(values.reshape(len(values), -1), axis=1)


def _stack(ax: Axes, means: dict[str, Floats]) -> None:
    """The stages on top of each other."""
    floor = np.zeros(len(next(iter(means.values()))))
    for stage, values in means.items():
        _, colour, hatch = _STAGES[stage]
        top = floor + np.nan_to_num(values)
        bars(ax, floor, top, colour, hatch)
        floor = top


def _mark(ax: Axes, measured: Floats) -> None:
    """The whole as it was measured."""
    ax.plot(measured, "D", ms=4.5, color="white", mec=INK, mew=1.1, zorder=3)


def _key(figure: Figure, stages: list[str]) -> None:
    """Beside the bars, in the order of the stack from the top down."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    mark = Line2D([], [], marker="D", ms=4.5, ls="", color="white", mec=INK, label="as measured")
    boxes = [
        Patch(facecolor=colour, hatch=hatch, edgecolor="white", lw=0.5, label=name)
        for name, colour, hatch in (_STAGES[stage] for stage in reversed(stages))
    ]
    figure.legend(handles=[mark, *boxes], loc="outside right upper", handlelength=1.4)
