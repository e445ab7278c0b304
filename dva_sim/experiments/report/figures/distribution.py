"""Whole distributions: every run is seen, not only its mean."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from dva_sim.experiments.analysis.run_grid import Floats, present
from dva_sim.experiments.analysis.study_view import StudyView
from dva_sim.experiments.report.figures import style
from dva_sim.experiments.report.figures.csv_numbers import Numbers
from dva_sim.experiments.report.figures.legend import legend
from dva_sim.experiments.report.figures.palette import INK, PAPER, SOFT, Look, looks
from dva_sim.experiments.report.prose import caption
from dva_sim.kernel.wording import capital
from dva_sim.simulation.labels import measure_name

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from dva_sim.experiments.report.summary import Reading


_CROWD = 60  # runs of a cell from which on dots must be small
_MIN_RUNS = 5  # runs of a cell: quarters of fewer are made up between them
_GOLDEN = 0.6180339887498949


class Distributions(style.ReportFigure):
    name = "distributions"
    title = "Every run"
    pages = ("driving",)
    has_panels = True

    def draw(self, view: StudyView, reading: Reading) -> style.Drawn | None:
        """Draw the figure."""
        panels = view.shown
        figure, axes = style.panels(
            len(panels), 1, 2.7 if len(panels) < 3 else 2.2, sharex=True, sharey=True
        )
        look = looks(view.series_factor)
        raw = view.part.grid(view.measure)
        confirmed = _confirmed(view)
        numbers = Numbers()
        for (ax,), panel in zip(axes, panels, strict=True):
            for level, offset in style.dodge(view.series):
                values = view.curve(raw, panel, level).reshape(len(view.stops), -1)
                ok = view.curve(confirmed, panel, level).reshape(values.shape) != 0
                width = min(0.3, 0.62 / len(view.series))
                _dots(ax, offset, width, values, ok, look[level])
                _boxes(ax, offset, width, values)
                for stop, columns in enumerate(values):
                    where = view.setting(panel, level) | view.at_stop(stop)
                    numbers.add(where, _columns(view, columns, ok[stop]))
            _reference_line(ax, view)
            style.panel_title(ax, panel)
            style.stops_axis(ax, view.over)
            style.hatch_stops(ax, view.stops_outside(panel))
            if ax is not axes[-1][0]:
                ax.set_xlabel("")
            ax.set_ylabel(
                style.axis_label(view.measure, style.wrapped(measure_name(view.measure), 24))
            )
        there = present(raw)
        if len(there) and there.min() > 0 and there.max() > 5 * there.min():
            style.log_axis(axes[0][0])
        legend(figure, view.series_factor)
        words = caption("distributions", has_missed=bool((confirmed == 0).any()))
        title = f"{capital(measure_name(view.measure))} of all {len(view.part):,} runs"
        return self.finish(figure, words, numbers, title=title, reads=(style.hatch_words(view),))


def _columns(view: StudyView, values: Floats, ok: NDArray[np.bool_]) -> dict[str, Any]:
    """Return the runs of a cell that gave a value, with who drove and whether it was confirmed."""
    part = view.part
    is_finite = np.isfinite(values)
    columns = {
        "person": part.person[is_finite],
        "trial": np.tile(part.trials, len(part.persons))[is_finite],
        view.measure: values[is_finite],
    }
    return columns | ({"confirmed": ok[is_finite]} if part.has("confirmed") else {})


def _dots(
    ax: Axes, offset: float, width: float, values: Floats, ok: NDArray[np.bool_], look: Look
) -> None:
    """Draw every run `(stops, runs)` as a dot, side by side with the others of its stop."""
    stops, runs = values.shape
    spots = width * ((np.arange(runs) * _GOLDEN) % 1 - 0.5)  # even, and the same every time
    x = np.arange(stops)[:, np.newaxis] + offset + spots
    good = np.isfinite(values) & ok
    missed = np.isfinite(values) & ~ok
    dots: dict[str, Any] = {
        "s": 5 if runs > _CROWD else 14,
        "lw": 0.5,
        "marker": look.mark,
        "rasterized": True,
        "zorder": 2,
    }
    ax.scatter(x[good], values[good], color=look.colour, alpha=0.35, **dots)
    ax.scatter(x[missed], values[missed], facecolor=PAPER, edgecolor=look.colour, **dots)


def _boxes(ax: Axes, offset: float, width: float, values: Floats) -> None:
    """Draw median and middle half of each stop `(stops, runs)` with runs enough for them."""
    stops = np.flatnonzero(np.isfinite(values).sum(axis=1) >= _MIN_RUNS)
    if not len(stops):
        return
    low, middle, high = np.nanquantile(values[stops], [0.25, 0.5, 0.75], axis=1)
    left = stops + offset - width / 2
    right = stops + offset + width / 2
    box: dict[str, Any] = {"color": INK, "zorder": 3}
    for x in (left, right):
        ax.vlines(x, low, high, lw=0.8, **box)
    for y in (low, high):
        ax.hlines(y, left, right, lw=0.8, **box)
    ax.hlines(middle, left, right, lw=2, **box)


def _reference_line(ax: Axes, view: StudyView) -> None:
    reference = present(view.part.reference(view.measure))
    if not len(reference):
        return
    ax.axhline(float(np.median(reference)), color=SOFT, lw=1, ls=":")
    ax.annotate(
        "reference (median)",
        (1.0, float(np.median(reference))),
        xycoords=("axes fraction", "data"),
        xytext=(0, -2),
        textcoords="offset points",
        ha="right",
        va="top",
        fontsize=7.5,
        color=SOFT,
    )


def _confirmed(view: StudyView) -> Floats:
    """Return 1 for runs that ended in a confirmation; all runs if the study has no misses."""
    if view.part.has("confirmed"):
        return view.part.grid("confirmed")
    return np.ones_like(view.part.grid(view.measure))
