"""Response time against time people spend in danger; smaller is better on both axes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dva_sim.experiments.analysis.run_grid import Floats, person_means, present
from dva_sim.experiments.analysis.study_view import StudyView
from dva_sim.experiments.report.figures import style
from dva_sim.experiments.report.figures.csv_numbers import Numbers, with_unit
from dva_sim.experiments.report.figures.cut_bars import Bars, mark_cuts
from dva_sim.experiments.report.figures.legend import legend
from dva_sim.experiments.report.figures.palette import looks
from dva_sim.experiments.report.prose import caption
from dva_sim.experiments.study.parts import Level
from dva_sim.simulation.labels import factor_name, level_name, measure_name
from dva_sim.statistics import Band, band

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from dva_sim.experiments.report.summary import Reading


_ROOM_BELOW = 0.3  # of that room, below: there is little that is less than none
_NAME_GAP_SHARE = 0.05  # share of an axis, below which two names would be written over each other
_ROOM = 0.15  # share of what persons span that is left free beyond them
EXPOSURES = ("exposure_look_s", "exposure_s", "person_exposure_s")
RESPONSES = ("response_mean_s", "confirmation_mean_s", "response_s", "drive_time_s")


class TradeOff(style.ReportFigure):
    name = "tradeoff"
    title = "The trade-off: response against exposure"
    pages = ("driving",)
    has_panels = True

    def draw(self, view: StudyView, reading: Reading) -> style.Drawn | None:
        """Draw the figure."""
        measured = [c for c in (view.measure, *EXPOSURES) if c in EXPOSURES and _varies(view, c)]
        responses = [c for c in (view.measure, *RESPONSES) if c in RESPONSES and _varies(view, c)]
        columns = (measured[0], responses[0]) if measured and responses else None
        if columns is None:
            return None
        figure, axes = style.panel_grid(view, 3.6)
        numbers = Numbers()
        ends = []
        bars = list[Bars]()
        for ax, panel in zip(axes, view.shown, strict=True):
            for level in view.series:
                grids = (view.curve(view.part.grid(column), panel, level) for column in columns)
                bands = [band(person_means(grid)) for grid in grids]
                bars += _line(ax, view, level, *bands)
                ends.append((ax, bands[0].mean, bands[1].mean))
                values = {
                    with_unit(f"{word}_{edge}", column): getattr(finding, name)
                    for word, column, finding in zip(
                        ("exposure", "response"), columns, bands, strict=True
                    )
                    for edge, name in _EDGES.items()
                }
                numbers.add(view.setting(panel, level), view.along_x() | values)
            style.panel_title(ax, panel, 78 // len(axes))
            ax.grid(True, axis="both")
            ax.margins(0.12)
        _fit(axes[0], view, columns)
        mark_cuts(bars)
        for ax, x, y in ends:
            _name_stops(ax, view, x, y)
        figure.supxlabel(style.axis_label(columns[0]), fontsize="medium")
        figure.supylabel(style.axis_label(columns[1]), fontsize="medium")
        legend(figure, view.series_factor)
        title = f"The trade-off: {measure_name(columns[1])} against {measure_name(columns[0])}"
        along = (
            factor_name(view.over.name) if style.leads_on(view) and view.over is not None else ""
        )
        return self.finish(figure, caption("tradeoff", along=along), numbers, title=title)


_EDGES = {"mean": "mean", "low": "pointwise_low", "high": "pointwise_high"}


def _varies(view: StudyView, column: str) -> bool:
    values = present(view.part.grid(column)) if view.part.has(column) else np.array([])
    return len(values) > 1 and bool(np.ptp(values) > 0)


def _fit(ax: Axes, view: StudyView, columns: tuple[str, str]) -> None:
    """Cut the crosses of few persons far beyond what any person did, lest they flatten all."""
    for name, column in zip("xy", columns, strict=True):
        grid = view.part.grid(column)
        every = [person_means(view.curve(grid, p, v)) for p in view.shown for v in view.series]
        points = present(np.concatenate([values.ravel() for values in every]))
        room = _ROOM * (float(np.ptp(points)) or 1.0)
        low, high = ax.get_xlim() if name == "x" else ax.get_ylim()
        low = max(low, points.min() - _ROOM_BELOW * room)
        high = min(high, points.max() + room)
        ax.set(**{f"{name}lim": (low, high)})


def _line(ax: Axes, view: StudyView, level: Level, exposure: Band, response: Band) -> list[Bars]:
    """Return a mark at each stop, joined where stops are numbers; gives the bars of its crosses."""
    paint, mark = looks(view.series_factor)[level]
    x = exposure.mean
    y = response.mean
    ax.hlines(y, exposure.pointwise_low, exposure.pointwise_high, color=paint, lw=0.8, alpha=0.7)
    ax.vlines(x, response.pointwise_low, response.pointwise_high, color=paint, lw=0.8, alpha=0.7)
    ax.plot(x, y, "-" if style.leads_on(view) else "", marker=mark, color=paint, ms=5, lw=1.2)
    across = Bars(ax, y, exposure.pointwise_low, exposure.pointwise_high, paint, "x")
    return [across, Bars(ax, x, response.pointwise_low, response.pointwise_high, paint)]


def _name_stops(ax: Axes, view: StudyView, x: Floats, y: Floats) -> None:
    """Name the ends of a line, or each word; none where it would cover another."""
    if view.over is None or len(x) < 2:
        return
    wide = np.ptp(ax.get_xlim())
    high = np.ptp(ax.get_ylim())
    named: list[int] = []
    for stop in (0, len(x) - 1) if style.leads_on(view) else range(len(x)):
        gaps = [(abs(x[i] - x[stop]) / wide, abs(y[i] - y[stop]) / high) for i in named]
        if any(max(gap) < _NAME_GAP_SHARE for gap in gaps):
            continue
        named.append(stop)
        ax.annotate(
            level_name(view.over.name, view.over.levels[stop], short=True),
            (float(x[stop]), float(y[stop])),
            xytext=(6, 4 if stop else -9),
            textcoords="offset points",
            fontsize=7.5,
        )
