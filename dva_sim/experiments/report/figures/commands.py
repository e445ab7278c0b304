"""Figures of commands: their age when they take effect, and the gain of each transport."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dva_sim.experiments.analysis.run_grid import Floats, nan_mean, person_means
from dva_sim.experiments.analysis.study_view import StudyView
from dva_sim.experiments.report.figures import style
from dva_sim.experiments.report.figures.csv_numbers import Numbers, with_limits
from dva_sim.experiments.report.figures.legend import legend
from dva_sim.experiments.report.figures.palette import INK, Look, looks
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
        """Draw the figure."""
        columns = [f"command_age_{q}_s" for q in _QUANTILES]
        if not all(view.part.has(column) for column in columns):
            return None
        figure, axes = style.panel_grid(view, 3.0)
        look = looks(view.series_factor)
        grids = [view.part.grid(column) for column in columns]
        numbers = Numbers()
        for ax, panel in zip(axes, view.shown, strict=True):
            for level, offset in style.dodge(view.series):
                ages = [_cell_means(view.curve(grid, panel, level)) for grid in grids]
                _ranges(ax, [stop + offset for stop in range(len(view.stops))], ages, look[level])
                by_column = dict(zip(columns, ages, strict=True))
                numbers.add(view.setting(panel, level), view.along_x() | by_column)
        style.log_axis(axes[0])
        style.label_panels(
            axes, view, style.axis_label("age_s", style.wrapped("Command age at application", 22))
        )
        legend(figure, view.series_factor)
        return self.finish(figure, caption("command_age"), numbers)


def _cell_means(values: Floats) -> Floats:
    """Return `(stops, persons, trials)` to means over all runs of a stop."""
    return nan_mean(values.reshape(len(values), -1), axis=1)


def _ranges(ax: Axes, x: Sequence[float], ages: list[Floats], look: Look) -> None:
    low, quarter, middle, three_quarters, high = ages
    ax.vlines(x, low, high, color=look.colour, lw=1)
    ax.vlines(x, quarter, three_quarters, color=look.colour, lw=4, alpha=0.55)
    ax.plot(x, middle, look.mark, color=look.colour, ms=4.5)


WIDTH = 0.6  # of the marks of a stop, side by side


class ShownMeasure(NamedTuple):
    """A panel: a column, its title, the factor to its unit, and whether its axis is logarithmic."""

    column: str
    title: str
    scale: float = 1.0
    is_log: bool = False


SHOWN = (
    ShownMeasure("movement_time_s", "Driving time [s]", is_log=True),
    ShownMeasure("round_trip_p95_s", "Round trip, 95th percentile [s]", is_log=True),
    ShownMeasure("picture_rate_hz", "Pictures shown [Hz]"),
    ShownMeasure("picture_age_p95_s", "Age of pictures, 95th percentile [s]", is_log=True),
    ShownMeasure("command_rate_hz", "Commands applied [Hz]"),
    ShownMeasure("age_in_force_mean_s", "Age of the command in force [s]", is_log=True),
    ShownMeasure("share_of_fair_down", "Rate of the session, in equal shares"),
    ShownMeasure("jain_down", "Jain's index of fairness"),
)


class Brought(style.ReportFigure):
    """A panel for each of some measures that the runs have."""

    name = "brought"
    title = "What each transport brings, and what it leaves to TCP"
    pages = ("transport",)

    def draw(self, view: StudyView, reading: Reading) -> style.Drawn | None:
        """Draw the figure."""
        measures = [each for each in SHOWN if view.part.has(each.column)]
        if not measures:
            return None
        figure, _, axes = style.places(len(measures), 2, 2.3)
        for ax, each in zip(axes, measures, strict=True):
            _panel(ax, view, each)
        for ax in axes[: len(measures) - 2]:
            ax.set_xlabel("")
        legend(figure, view.series_factor)
        return self.finish(figure, caption("brought"), _numbers(view, measures))


def _numbers(view: StudyView, measures: Sequence[ShownMeasure]) -> Numbers:
    """Return means over persons and the middle 90 % of them, in the units of the table of runs."""
    numbers = Numbers()
    panel = view.panels[0]
    grids = {each.column: view.part.grid(each.column) for each in measures}
    for level in view.series:
        curves = {name: view.curve(grid, panel, level) for name, grid in grids.items()}
        columns: dict[str, Floats] = {}
        for name, curve in curves.items():
            persons = person_means(curve)
            columns |= with_limits(name, nan_mean(persons, axis=0), *_middle(persons))
        numbers.add(view.setting(panel, level), view.along_x() | columns)
    return numbers


def _panel(ax: Axes, view: StudyView, measure: ShownMeasure) -> None:
    grid = measure.scale * view.part.grid(measure.column)
    count = len(view.series)
    for index, (level, look) in enumerate(looks(view.series_factor).items()):
        values = person_means(view.curve(grid, view.panels[0], level))
        offset = WIDTH * ((index + 0.5) / count - 0.5)
        _marks(ax, offset, values, look)
    scale = ", log scale" if measure.is_log else ""
    ax.set_title(f"{measure.title}{scale}", fontweight="normal")
    style.stops_axis(ax, view.over)
    if measure.is_log:
        style.log_axis(ax)
    else:
        ax.set_ylim(bottom=0)
    if measure.column.startswith(("share_of_fair", "jain")):
        ax.axhline(1.0, color=INK, lw=0.8, ls=(0, (4, 2)), zorder=1)


def _middle(values: Floats) -> Floats:
    """Return ends of the middle 90 % of persons at each stop: `(2, stops)`."""
    ends = np.full((2, values.shape[1]), np.nan)
    has_values = np.isfinite(values).any(axis=0)
    ends[:, has_values] = np.nanpercentile(values[:, has_values], [5, 95], axis=0)
    return ends


def _marks(ax: Axes, offset: float, values: Floats, look: Look) -> None:
    """Draw means over persons of `values` `(persons, stops)`, with their middle 90 %."""
    means = nan_mean(values, axis=0)
    stops = np.flatnonzero(np.isfinite(means))
    if not len(stops):
        return
    low, high = _middle(values[:, stops])
    ax.vlines(stops + offset, low, high, color=look.colour, lw=1.2, zorder=2)
    ax.plot(stops + offset, means[stops], look.mark, color=look.colour, ms=4.5, zorder=3)
