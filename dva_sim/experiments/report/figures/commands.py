"""Age of the commands when they take effect."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from dva_sim.experiments.analysis.run_grid import Floats, nan_mean
from dva_sim.experiments.analysis.study_view import StudyView
from dva_sim.experiments.report.figures import style
from dva_sim.experiments.report.figures.csv_numbers import Numbers
from dva_sim.experiments.report.figures.legend import legend
from dva_sim.experiments.report.figures.palette import Look, looks
from dva_sim.experiments.report.prose import caption

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from dva_sim.experiments.report.summary import Reading


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
        grids = [view.part.grid(column) for column in columns]
        numbers = Numbers()
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


def _cell_means(values: Floats) -> Floats:
    """`(stops, persons, trials)` to means over all runs of a stop."""
    return nan_mean(values.reshape(len(values), -1), axis=1)


def _ranges(ax: Axes, x: Sequence[float], ages: list[Floats], look: Look) -> None:
    low, quarter, middle, three_quarters, high = ages
    ax.vlines(x, low, high, color=look.colour, lw=1)
    ax.vlines(x, quarter, three_quarters, color=look.colour, lw=4, alpha=0.55)
    ax.plot(x, middle, look.mark, color=look.colour, ms=4.5)
