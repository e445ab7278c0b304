"""Effect over two factors: where its sign changes, and where the sign is certain."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from dva_sim.experiments.analysis.run_grid import Factor, Floats, Setting
from dva_sim.experiments.analysis.study_view import MAX_PANELS, StudyView
from dva_sim.experiments.report.figures import style
from dva_sim.experiments.report.figures.csv_numbers import Numbers, in_units
from dva_sim.experiments.report.figures.palette import DIVERGING, INK, PAPER
from dva_sim.experiments.report.prose import caption
from dva_sim.experiments.study.parts import Level
from dva_sim.kernel.wording import capital, number
from dva_sim.simulation.labels import level_name, measure_name
from dva_sim.statistics import band

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.collections import QuadMesh

    from dva_sim.experiments.report.summary import Reading


_MIN_LEVELS = 3  # levels of a second factor, below which panels say it all


_MAX_WRITTEN = 12  # levels along x, beyond which numbers have no room


_DARK = 0.65  # of the strongest colour, from where on writing is white


_MARK_ABOVE = "▲"
_MARK_BELOW = "▼"


@dataclass(frozen=True)
class EffectField:
    """An effect at every pair of levels `(levels of the second, levels along x)`.

    Attributes:
        second: The factor along y.
        panel: Levels of all factors that are not along an axis.
        mean: First minus second level of the contrast.
        low: Lower edge of the band that covers all pairs at once.
        high: Its upper edge.
    """

    second: Factor
    panel: Setting
    mean: Floats
    low: Floats
    high: Floats

    @property
    def shown(self) -> Floats:
        """The mean where the band excludes zero, else 0: colour claims no more than the mark."""
        is_unclear = (self.low <= 0) & (self.high >= 0)
        return np.where(is_unclear, 0.0, self.mean)


class HeatMap(style.ReportFigure):
    name = "heat_map"
    title = "The contrast over two factors"
    pages = ("driving",)

    def draw(self, view: StudyView, reading: Reading) -> style.Drawn | None:
        """Draw the figure."""
        fields = _fields(view)
        if not fields or view.over is None or view.series_factor is None or view.contrast is None:
            return None
        second = fields[0].second
        figure, grid = style.panels(
            len(fields), 1, max(2.4, 1.0 + 0.38 * len(second.levels)), sharex=True
        )
        axes = [ax for (ax,) in grid]
        first, other = (level_name(view.series_factor.name, level) for level in view.contrast)
        reach = max(float(np.nanmax(abs(field.mean))) for field in fields) or 1.0
        has_zero = False
        for ax, field in zip(axes, fields, strict=True):
            image = _colours(ax, field.shown, reach)
            has_zero |= _contours(ax, field)
            _write(ax, field, image, reach)
            style.level_axis(ax, second)
            style.stops_axis(ax, view.over)
            style.panel_title(ax, field.panel)
            ax.grid(False)
        for ax in axes[:-1]:
            ax.set_xlabel("")
        bar = figure.colorbar(image, ax=axes, pad=0.02)
        bar.set_label(style.axis_label(view.measure, f"{first}\nminus {other}"))
        title = f"{capital(first)} minus {other} in {measure_name(view.measure)}, over two factors"
        marks = {"above": _MARK_ABOVE, "below": _MARK_BELOW}
        words = caption("heat_map", first=first, second=other, has_zero=has_zero, **marks)
        return self.finish(figure, words, _heat_numbers(view, fields), title=title)


def _fields(view: StudyView) -> list[EffectField]:
    """Return one for each setting of the factors not shown, as far as there is room."""
    second = _second(view)
    if second is None or view.contrast is None:
        return []
    rest = [{k: v for k, v in panel.items() if k != second.name} for panel in view.panels]
    settings = [panel for n, panel in enumerate(rest) if panel not in rest[:n]]
    fields = [_field(view, second, view.contrast, panel) for panel in settings[:MAX_PANELS]]
    return [field for field in fields if np.isfinite(field.mean).any()]


def _field(
    view: StudyView, second: Factor, contrast: tuple[Level, Level], panel: Setting
) -> EffectField:
    columns = [view.difference(panel | {second.name: x}, *contrast) for x in second.levels]
    values = np.stack(columns, axis=1)  # (persons, levels of the second, stops)
    bands = band(values.reshape(len(values), -1))
    shape = values.shape[1:]
    mean, low, high = (x.reshape(shape) for x in (bands.mean, bands.low, bands.high))
    return EffectField(second, panel, mean, low, high)


def _second(view: StudyView) -> Factor | None:
    """Return the other factor with most levels; of equal ones a quantity first."""
    if view.series_factor is None or view.over is None or len(view.over.levels) < 2:
        return None
    free = [f for f in view.part.factors if f not in (view.series_factor, view.over)]
    worth = [f for f in free if len(f.levels) >= _MIN_LEVELS]
    return max(worth, key=lambda f: (len(f.levels), f.is_numeric), default=None)


def _colours(ax: Axes, values: Floats, reach: float) -> QuadMesh:
    """Return fields from purple, below zero, over white to orange: far apart for every eye."""
    return ax.pcolormesh(
        *np.meshgrid(np.arange(values.shape[1] + 1) - 0.5, np.arange(values.shape[0] + 1) - 0.5),
        np.ma.masked_invalid(values),
        cmap=DIVERGING,
        vmin=-reach,
        vmax=reach,
        edgecolor=PAPER,
        linewidth=0.5,
    )


def _write(ax: Axes, field: EffectField, image: QuadMesh, reach: float) -> None:
    """Write numbers and marks: no colour is needed to read them, nor is it in a print."""
    for (y, x), mean in np.ndenumerate(field.mean):
        if not np.isfinite(mean):
            continue
        paint = image.to_rgba(np.asarray(field.shown[y, x]))
        mark = _MARK_ABOVE if field.low[y, x] > 0 else _MARK_BELOW if field.high[y, x] < 0 else ""
        text = number(float(mean)) if field.mean.shape[1] <= _MAX_WRITTEN else ""
        ax.text(
            x,
            y,
            " ".join(filter(None, (mark, text))),
            ha="center",
            va="center",
            fontsize=8,
            fontweight="bold" if mark else "normal",
            color=PAPER if abs(field.shown[y, x]) > _DARK * reach else INK,
            bbox={"fc": paint, "ec": "none", "pad": 0.6},  # no line through it
            zorder=5,
        )


def _contours(ax: Axes, field: EffectField) -> bool:
    """Draw the contours of no effect and of the band's edges; return True if there are any."""
    has_zero = False
    for values, dashes, width in (
        (field.mean, "-", 2.2),
        (field.low, "--", 1),
        (field.high, "--", 1),
    ):
        finite = values[np.isfinite(values)]
        crosses = len(finite) > 0 and finite.min() < 0 < finite.max()
        if crosses and min(values.shape) > 1:
            ax.contour(
                np.ma.masked_invalid(values), [0.0], colors=INK, linestyles=dashes, linewidths=width
            )
            has_zero |= dashes == "-"
    return has_zero


def _heat_numbers(view: StudyView, fields: Sequence[EffectField]) -> Numbers:
    numbers = Numbers()
    for field in fields:
        edges = {"mean": field.mean, "band_low": field.low, "band_high": field.high}
        columns = in_units(view.measure, **edges)
        for row, level in enumerate(field.second.levels):
            row_values = {name: values[row] for name, values in columns.items()}
            numbers.add(field.panel | {field.second.name: level}, view.along_x() | row_values)
    return numbers
