"""Fate of the commands: their age, and how many arrive."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from dva_sim.experiments.analysis.cadence import Cadence
from dva_sim.experiments.analysis.run_grid import Floats, nan_mean
from dva_sim.experiments.analysis.study_view import StudyView
from dva_sim.experiments.report.figures import style
from dva_sim.experiments.report.figures.cadence_line import cadences, mark_boundary
from dva_sim.experiments.report.figures.csv_numbers import Numbers
from dva_sim.experiments.report.figures.legend import Ends, legend, name_lines
from dva_sim.experiments.report.figures.palette import INK, Look, looks
from dva_sim.experiments.report.prose import caption
from dva_sim.network.patterns import PATTERNS

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from dva_sim.experiments.report.summary import Reading


_ROOM = 1.08  # above the highest mark


_QUANTILES = ("p05", "p25", "p50", "p75", "p95")


class CommandAge(style.ReportFigure):
    name = "command_age"
    title = "Age of commands when they take effect"
    pages = ("driving",)
    has_panels = True

    def draw(self, view: StudyView, reading: Reading) -> style.Drawn | None:
        """Draw it."""
        columns = [f"command_age_{q}_s" for q in _QUANTILES]
        if not all(view.part.has(column) for column in columns):
            return None
        figure, axes = style.panel_grid(view, 3.0)
        look = looks(view.line)
        grids, numbers = [view.part.grid(column) for column in columns], Numbers()
        for ax, panel in zip(axes, view.shown, strict=True):
            for level, offset in style.dodge(view.lines):
                ages = [_cell_means(view.curve(grid, panel, level)) for grid in grids]
                _ranges(ax, [stop + offset for stop in range(len(view.stops))], ages, look[level])
                by_column = dict(zip(columns, ages, strict=True))
                numbers.add(view.setting(panel, level), view.along_x() | by_column)
        style.log_axis(axes[0])
        style.label_panels(
            axes, view, style.axis_label("age_s", style.wrapped("Command age at application", 22))
        )
        legend(figure, view.line)
        return self.finish(figure, caption("command_age"), numbers)


class CommandRate(style.ReportFigure):
    name = "command_rate"
    title = "Commands applied per second"
    pages = ("driving",)
    columns = ("command_rate_hz",)
    has_panels = True

    def draw(self, view: StudyView, reading: Reading) -> style.Drawn | None:
        """Draw it."""
        there = cadences(view, reading.scenario_of(view.part.name))
        figure, axes = style.panel_grid(view, 3.0)
        look, every, numbers = looks(view.line), [], Numbers()
        grid = view.part.grid("command_rate_hz")
        for ax, panel, found in zip(axes, view.shown, there, strict=True):
            ends: Ends = {}
            for i, (level, place) in enumerate(style.dodge(view.lines)):
                means = _cell_means(view.curve(grid, panel, level))
                if style.has_lines(view):  # larger marks below, where lines lie on each other
                    _line(ax, means, look[level], 4 + 2.5 * (len(view.lines) - 1 - i))
                else:
                    x = np.arange(len(means)) + place
                    ax.plot(x, means, look[level].mark, ms=5, color=look[level].colour)
                ends[level] = float(means[-1])
                columns = view.along_x() | {"command_rate_hz": means}
                numbers.add(view.setting(panel, level), columns)
            _closed_form(ax, view, found)
            every.append(ends)
        tops = [ax.dataLim.y1 for ax in axes if np.isfinite(ax.dataLim.y1)]  # a panel may be empty
        axes[0].set_ylim(0, _ROOM * (max(tops, default=0.0) or 1.0))
        style.label_panels(axes, view, style.axis_label("command_rate_hz"))
        if style.has_lines(view):
            name_lines(axes, every, view.line)
        else:
            legend(figure, view.line)
        words = caption("command_rate", has_cadence=any(there))
        return self.finish(figure, words, numbers)


def _cell_means(values: Floats) -> Floats:
    """`(stops, persons, trials)` to means over all runs of a stop."""
    return nan_mean(values.reshape(len(values), -1), axis=1)


def _line(ax: Axes, means: Floats, look: Look, size: float) -> None:
    ax.plot(means, color=look.colour, lw=1, alpha=0.5)
    ax.plot(means, look.mark, ms=size, color=look.colour)


def _ranges(ax: Axes, x: Sequence[float], ages: list[Floats], look: Look) -> None:
    low, quarter, middle, three_quarters, high = ages
    ax.vlines(x, low, high, color=look.colour, lw=1)
    ax.vlines(x, quarter, three_quarters, color=look.colour, lw=4, alpha=0.55)
    ax.plot(x, middle, look.mark, color=look.colour, ms=4.5)


def _closed_form(ax: Axes, view: StudyView, cadence: Cadence | None) -> None:
    """A dash at each stop where a pattern stands that is bound by it."""
    if cadence is None or view.over is None or not view.over.is_numeric:
        return
    delays = [float(v) for v in view.over.levels if isinstance(v, int | float)]
    rates = [cadence.lock_step_rate(d) for d in delays]
    has_lines, half = style.has_lines(view), 0.4 / len(view.lines)
    for level, place in style.dodge(view.lines):
        if level in PATTERNS and PATTERNS[str(level)].in_step:
            x = np.arange(len(delays)) + (0.0 if has_lines else place)
            ax.hlines(rates, x - half, x + half, color=INK, lw=1, ls=(0, (4, 2)), zorder=3)
    mark_boundary(ax, view.over, cadence, text=False)
