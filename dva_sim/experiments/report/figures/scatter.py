"""Continuous factors: the outcome at every point against each of them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from dva_sim.experiments.analysis.run_grid import Floats, RunGrid, Setting, nan_mean
from dva_sim.experiments.analysis.study_view import StudyView, part_of
from dva_sim.experiments.report.figures import style
from dva_sim.experiments.report.figures.csv_numbers import Numbers, with_unit
from dva_sim.experiments.report.figures.legend import legend
from dva_sim.experiments.report.figures.palette import INK, PAPER, SINGLE_LOOK, Look, looks
from dva_sim.experiments.report.prose import caption
from dva_sim.experiments.study.parts import POINT, Level
from dva_sim.kernel.wording import capital
from dva_sim.simulation.labels import level_name, measure_name, setting
from dva_sim.simulation.labels import with_unit as head_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from dva_sim.experiments.report.summary import Reading


_PANELS_A_ROW = 3
_BINS = 8  # number of bins with equally many points, through whose means the trend is drawn
_MIN_IN_BIN = 6


class Cloud(NamedTuple):
    """Runs of one kind at every point.

    Attributes:
        name: Label of the runs: a level, a difference, or empty.
        values: `(points, persons, trials)`.
        level: The level, for its colour; None for a difference.
    """

    name: str
    values: Floats
    level: Level


class Points(NamedTuple):
    """Results at all sampled points.

    Attributes:
        clouds: Each line, or the contrast of two of them if one was declared.
        names: Continuous factors.
        where: Their values `(factors, points)`.
        panel: Levels of all other factors.
    """

    clouds: list[Cloud]
    names: list[str]
    where: Floats
    panel: Setting


def points_of(view: StudyView, reading: Reading) -> Points:
    """Return the runs of a design of points in ranges."""
    names = reading.points
    part = part_of(reading.study, reading.runs, view.part.name, are_points_trials=False)
    panel = view.panels[0] | ({view.over.name: view.stops[-1]} if view.over else {})
    where = nan_mean(np.stack([_per_point(part, name, {}) for name in names]), axis=-1)
    return Points(list(_clouds(view, part, panel)), names, where, panel)


def _per_point(part: RunGrid, column: str, setting_: Setting) -> Floats:
    """Return a column `(points, ...)`, the other factors at some levels, everything else flat."""
    axis = [f.name for f in part.factors if f.name not in setting_].index(POINT)
    grid = np.moveaxis(part.where(part.grid(column), setting_), axis, 0)
    return grid.reshape(len(grid), -1)


def _clouds(view: StudyView, part: RunGrid, panel: Setting) -> list[Cloud]:
    """Return each line, or the contrast of two of them if one was declared."""
    grid = part.outcome(view.measure)

    def at(level: Level) -> Floats:
        line_setting = {view.series_factor.name: level} if view.series_factor else {}
        return part.where(grid, panel | line_setting)

    if view.contrast is not None and view.series_factor is not None:
        first, second = view.contrast
        name = " minus ".join(level_name(view.series_factor.name, level) for level in view.contrast)
        return [Cloud(name, at(first) - at(second), None)]
    names = [
        level_name(view.series_factor.name, level) if view.series_factor else ""
        for level in view.series
    ]
    return [Cloud(name, at(level), level) for name, level in zip(names, view.series, strict=True)]


class Scatter(style.ReportFigure):
    name = "scatter"
    title = "The outcome against each continuous factor"
    pages = ("driving",)

    def applies(self, view: StudyView, reading: Reading) -> bool:
        """Return True only for designs of points in ranges."""
        return super().applies(view, reading) and bool(reading.points)

    def draw(self, view: StudyView, reading: Reading) -> style.Drawn | None:
        """Draw a panel for each varied range, with a dot for each point of the design."""
        clouds, names, where, panel = points_of(view, reading)
        ranges = (reading.study.get("design") or {}).get("ranges") or {}
        abreast = min(_PANELS_A_ROW, len(names))
        figure, grid, axes = style.places(len(names), abreast, 2.7, sharey=True)
        means = [nan_mean(c.values.reshape(len(c.values), -1), axis=1) for c in clouds]
        for ax, name, x in zip(axes, names, where, strict=True):
            for cloud, y in zip(clouds, means, strict=True):
                _dots(
                    ax,
                    x,
                    y,
                    SINGLE_LOOK if cloud.level is None else looks(view.series_factor)[cloud.level],
                )
            ax.set_xlabel(style.wrapped(capital(head_of(name)), 30))
            if (ranges.get(name) or {}).get("scale") == "log":
                style.log_axis(ax, "x")
            if len(clouds) == 1 and clouds[0].level is None and view.contrast is not None:
                ax.axhline(0, color=INK, lw=0.8, zorder=1)
        label = clouds[0].name if view.contrast is not None else measure_name(view.measure)
        for row in grid:
            row[0].set_ylabel(style.axis_label(view.measure, style.wrapped(label, 26)))
        if view.contrast is None:
            legend(figure, view.series_factor)
        numbers = Numbers()
        for cloud, y in zip(clouds, means, strict=True):
            columns = dict(zip(names, where, strict=True)) | {with_unit("mean", view.measure): y}
            numbers.add(panel | {"of": cloud.name}, {POINT: range(len(y))} | columns)
        panel_text = f" ({setting(panel)})" if panel else ""
        title = f"{capital(_what(view, clouds))} against each factor{panel_text}"
        return self.finish(figure, caption("scatter"), numbers, title=title)


def _what(view: StudyView, clouds: list[Cloud]) -> str:
    if view.contrast is None:
        return measure_name(view.measure)
    return f"{clouds[0].name} in {measure_name(view.measure)}"


def _dots(ax: Axes, x: Floats, y: Floats, look: Look) -> None:
    """Draw points, and the means of as many equal parts of them as there are enough for."""
    is_finite = np.isfinite(x) & np.isfinite(y)
    x = x[is_finite]
    y = y[is_finite]
    few: dict[str, Any] = {"s": 12 if len(x) < 200 else 5, "rasterized": len(x) > 500}
    ax.scatter(x, y, marker=look.mark, color=look.colour, alpha=0.35, lw=0, zorder=2, **few)
    middle, mean, half = trend(x, y)
    ax.fill_between(middle, mean - half, mean + half, color=look.colour, alpha=0.16, lw=0)
    style_of_line: dict[str, Any] = {
        "color": look.colour,
        "marker": look.mark,
        "mec": PAPER,
        "mew": 0.6,
    }
    ax.plot(middle, mean, "-", ms=5, lw=1.4, zorder=3, **style_of_line)


def trend(x: Floats, y: Floats) -> tuple[Floats, Floats, Floats]:
    """Return means of equally many points each, in order of x, with half their 95 % intervals.

    The points of a part differ by all other factors, as drawn: their scatter is what the interval
    is made of. Three empty arrays where there are too few.

    Returns:
        The middle of each part along x, the mean of y there, half the interval's width; `(parts,)`.
    """
    from scipy.stats import t

    parts = min(_BINS, len(x) // _MIN_IN_BIN)
    if parts < 2:
        return np.array([]), np.array([]), np.array([])
    order = np.array_split(np.argsort(x, kind="stable"), parts)
    spread = [np.std(y[i], ddof=1) / math.sqrt(len(i)) * t.ppf(0.975, len(i) - 1) for i in order]
    middle = [np.median(x[part]) for part in order]
    return np.array(middle), np.array([y[part].mean() for part in order]), np.array(spread)
