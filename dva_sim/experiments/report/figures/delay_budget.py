"""Origin of the delay: one stack of stages for each cell, beside the measured loop delay."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from dva_sim.experiments.analysis.run_grid import Factor, Floats, Setting, nan_mean
from dva_sim.experiments.analysis.study_view import StudyView
from dva_sim.experiments.report.figures import style
from dva_sim.experiments.report.figures.csv_numbers import Numbers
from dva_sim.experiments.report.figures.legend import box, key, key_height
from dva_sim.experiments.report.figures.palette import INK, PAPER, STAGES, Fill
from dva_sim.experiments.report.prose import caption
from dva_sim.experiments.study.parts import Level
from dva_sim.kernel.wording import capital
from dva_sim.simulation.labels import brief

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from dva_sim.experiments.report.summary import Reading


_NAMES = {
    "delay_frame_s": "frame (until the next)",
    "delay_downlink_s": "down-link",
    "delay_human_s": "human (perception)",
    "delay_hand_s": "hand",
    "delay_filter_s": "filter",
    "delay_period_s": "command period (until the next)",
    "delay_wait_s": "pattern (waits for the reply)",
    "delay_uplink_s": "up-link",
    "delay_processing_s": "processing",
    "delay_motor_s": "motor",
}
_MEASURED = "loop_delay_measured_s"


class DelayBudget(style.ReportFigure):
    name = "delay_budget"
    title = "Where the delay comes from"
    pages = ("driving",)
    has_panels = True

    def draw(self, view: StudyView, reading: Reading) -> style.Drawn | None:
        """Draw the figure."""
        grids = stages_of(view)
        if not grids:
            return None
        view = _driven(view, next(iter(grids.values())))
        stacks = Stacks(view, "Delay [s]", _parts(list(grids)))
        numbers = Numbers()
        for ax, panel, level in stacks.panels():
            means = {stage: _means(view, grid, panel, level) for stage, grid in grids.items()}
            measured = _means(view, view.part.grid(_MEASURED), panel, level)
            stack(ax, means, STAGES)
            stops = range(len(measured))
            ax.plot(measured, stops, "D", ms=4.5, color=PAPER, mec=INK, mew=1.1, zorder=3)
            columns = view.along_x() | means | {_MEASURED: measured}
            numbers.add(view.setting(panel, level), columns)
        stacks.close()
        return self.finish(stacks.figure, caption("delay_budget"), numbers)


def stages_of(view: StudyView) -> dict[str, Floats]:
    """Return each stage run by run, in the order of the loop; their sum is that of the columns.

    While a request is open no command goes: the phone's newer ones are replaced by the newest. So
    the command in force stands longer than the phone's own period, which is the pattern's doing
    and not the sampling's. In a run of which `commands_sent` went and others were replaced before
    they were sent, the phone alone would have filled that time with all of them.
    """
    part = view.part
    stages = {name: part.grid(name) for name in _NAMES if part.has(name)}
    if not part.has("delay_sampling_s"):
        return stages
    in_force = part.grid("delay_sampling_s")
    wait = np.zeros_like(part.grid("delay_sampling_s"))
    if part.has("commands_superseded"):
        fates = ("sent", "superseded", "applied", "stale")
        sent, replaced, applied, stale = (
            np.nan_to_num(part.grid(f"commands_{fate}")) for fate in fates
        )
        # Of those replaced some were sent already, and skipped by the robot.
        unsent = np.maximum(replaced - np.maximum(sent - applied - stale, 0.0), 0.0)
        wait = in_force * unsent / np.maximum(sent + unsent, 1.0)
    before = part.grid("delay_pattern_s") if part.has("delay_pattern_s") else 0.0
    stages |= {"delay_period_s": in_force - wait, "delay_wait_s": wait + before}
    return {name: stages[name] for name in _NAMES if name in stages}


def _driven(view: StudyView, grid: Floats) -> StudyView:
    """Return the view without series in which nobody drove, such as guards without robots."""
    if view.series_factor is None:
        return view
    name = view.series_factor.name
    levels = [v for v in view.series if np.isfinite(view.part.where(grid, {name: v})).any()]
    return replace(view, series_factor=Factor(name, tuple(levels)))


def _means(view: StudyView, grid: Floats, panel: Setting, level: Level) -> Floats:
    """Return means over all runs of each stop."""
    values = view.curve(grid, panel, level)
    return nan_mean(values.reshape(len(values), -1), axis=1)


def _parts(stages: list[str]) -> dict[str, Artist]:
    """Return the parts for the key, in the order of the stack."""
    from matplotlib.lines import Line2D

    mark = Line2D([], [], marker="D", ms=4.5, ls="", color=PAPER, mec=INK)
    return {_NAMES[stage]: box(STAGES[stage]) for stage in stages} | {"as measured": mark}


_HALF = 0.36  # of a bar's width, in stops


_PANELS_A_ROW = 4  # panels


_BAR = 0.2  # height of a bar with the gap to the next [in]


_FRAME_HEIGHT_IN = 0.85  # height of a panel's title and axis [in]


_TITLE = 72  # characters of titles that stand abreast


_PER_INCH = 13  # characters of a factor's name along the height
_MIN_CHARACTERS = 12  # characters of it, at least


_NAME = 24  # characters of a stop's name in a line


class Stacks:
    """Stacked bars, horizontal so that names of any length fit beside them.

    Args:
        label: Label of the axis along the bars.
        parts: Names and handles of the legend: parts of the bars, and other marks.

    Attributes:
        figure: Figure to be finished.
        axes: One for each setting shown and line, in that order.
    """

    def __init__(self, view: StudyView, label: str, parts: Mapping[str, Artist]) -> None:
        count = len(view.series)
        lines = len(view.stops)
        columns = min(_PANELS_A_ROW, count)
        deep = -(-count // columns)
        if view.over is not None:
            lines = len(view.stops) * _most_lines(view.over)
        rows = deep * len(view.shown)
        height = _FRAME_HEIGHT_IN + _BAR * lines + key_height(list(parts)) / rows
        self.figure: Figure
        self.figure, grid = style.panels(rows, columns, height, sharex=True, sharey=True)
        key(self.figure, list(parts.values()), list(parts))
        self._view = view
        self._columns = columns
        blocks = [grid[n * deep : (n + 1) * deep] for n in range(len(view.shown))]
        flat = [[ax for row in block for ax in row] for block in blocks]
        self.axes: list[Axes] = [ax for block in flat for ax in block[:count]]
        for ax in (ax for block in flat for ax in block[count:]):
            ax.set_visible(False)
        self._label = label

    def panels(self) -> Iterator[tuple[Axes, Setting, Level]]:
        """Yield each panel with its setting and line."""
        view = self._view
        places = ((panel, level) for panel in view.shown for level in view.series)
        for ax, (panel, level) in zip(self.axes, places, strict=True):
            yield ax, panel, level

    def close(self) -> None:
        """Label the panels; to be called last, since it fixes the axes."""
        view = self._view
        columns = self._columns
        count = len(self._view.series)
        self.axes[0].set_xlim(left=0)
        for index, (ax, panel, level) in enumerate(self.panels()):
            words = capital(brief(view.setting(panel, level)))
            ax.set_title(style.wrapped(words, _TITLE // columns), fontsize=8.5)
            style.lying(ax)
            place = index % count
            _along_y(ax, view.over, is_first=place % columns == 0)
            is_lowest = index >= len(self.axes) - count and place + columns >= count
            ax.tick_params(labelbottom=is_lowest)
            ax.set_xlabel(self._label if is_lowest else "")


def stack(ax: Axes, parts: Mapping[str, Floats], fills: Mapping[str, Fill]) -> None:
    """Stack parts `(stops,)`, without those that are zero everywhere."""
    floor: Floats = np.zeros(len(next(iter(parts.values()))))
    for name, values in parts.items():
        top = floor + np.nan_to_num(values)
        if (top > floor).any():
            _bars(ax, floor, top, fills[name])
        floor = top


def _bars(ax: Axes, floor: Floats, top: Floats, fill: Fill) -> None:
    """Draw a bar at each stop, from `floor` to `top` `(stops,)`: one artist for all of them."""
    from matplotlib.collections import PolyCollection

    low = np.arange(len(floor)) - _HALF
    high = low + 2 * _HALF
    x = np.stack([floor, floor, top, top])
    y = np.stack([low, high, high, low])
    corners = np.stack([x, y], axis=-1).swapaxes(0, 1)
    look: dict[str, Any] = {"facecolor": fill.colour, "hatch": fill.hatch}
    ax.add_collection(PolyCollection(list(corners), **look, edgecolor=PAPER, lw=0.5))
    ax.update_datalim([(0.0, -_HALF), (float(np.max(top, initial=0.0)), len(floor) - 1 + _HALF)])
    ax.autoscale_view()


def _along_y(ax: Axes, over: Factor | None, is_first: bool) -> None:
    """Draw the stops along y, the first on top."""
    if over is None:
        ax.set_yticks([])
        ax.set_ylim(0.5, -0.5)
        return
    style.level_axis(ax, over, _NAME)
    ax.invert_yaxis()
    height = _BAR * len(over.levels) * _most_lines(over)
    words = style.wrapped(ax.get_ylabel(), max(_MIN_CHARACTERS, int(_PER_INCH * height)))
    ax.set_ylabel(words if is_first else "")


def _most_lines(over: Factor) -> int:
    return max(style.wrapped(name, _NAME).count("\n") + 1 for name in style.tick_names(over)[0])
