"""The effect over two factors at once: where it turns round, and where that can be told."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from dva_sim.experiments.effects import Factor, Floats, Setting, View
from dva_sim.experiments.figures.numbers import Numbers, with_unit
from dva_sim.experiments.figures.style import (
    INK,
    Drawn,
    axis_label,
    finish,
    level_axis,
    panels,
    stops_axis,
)
from dva_sim.experiments.labels import level_name, measure_name, number, setting
from dva_sim.experiments.statistics import band

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.collections import QuadMesh

_FEWEST = 3  # levels of a second factor, below which panels say it all
_MOST_WRITTEN = 12  # levels along x, beyond which numbers have no room
_DARK = 0.65  # of the strongest colour, from where on writing is white
_ABOVE, _BELOW = "▲", "▼"


@dataclass(frozen=True)
class Field:
    """An effect at every pair of levels `(levels of the second, levels along x)`.

    Attributes:
        second: The factor along y.
        panel: Levels of all factors that are not shown.
        mean: First minus second level of the contrast.
        low: Lower edge of the band that covers all pairs at once.
        high: Its upper edge.
    """

    second: Factor
    panel: Setting
    mean: Floats
    low: Floats
    high: Floats


def heat_map(view: View) -> Drawn | None:
    """The declared contrast over two factors; None where there is no second one worth it."""
    field = _field(view)
    if field is None or view.over is None or view.line is None or view.contrast is None:
        return None
    rows = len(field.second.levels)
    figure, ((ax,),) = panels(1, 1, max(2.6, 1.3 + 0.42 * rows))
    first, second = (level_name(view.line.name, level) for level in view.contrast)
    image = _colours(ax, field.mean)
    has_zero = _contours(ax, field)
    _write(ax, field, image)
    stops_axis(ax, view.over)
    level_axis(ax, field.second)
    ax.grid(False)
    bar = figure.colorbar(image, ax=ax, pad=0.02)
    bar.set_label(axis_label(view.measure, f"{first}\nminus {second}"))
    within = f" ({setting(field.panel)})" if field.panel else ""
    title = f"{first} minus {second} in {measure_name(view.measure)}, over two factors{within}"
    return finish(
        figure, "heat_map", title, _caption(first, second, has_zero), _numbers(view, field)
    )


def _caption(first: str, second: str, has_zero: bool) -> str:
    line = (
        "Thick line: where the mean difference is zero, by straight lines between levels; dashed, "
        "where the edges of the band are, so that between the dashed lines nothing can be told."
        if has_zero
        else "The mean difference is zero nowhere between these levels, so there is no line."
    )
    return (
        f"In each field the mean difference, paired by person and trial. {_ABOVE}: {first} lies "
        f"above {second}, {_BELOW}: below, by the 95 % band that covers all fields at once; "
        f"without a mark it cannot be told from zero. {line}"
    )


def _field(view: View) -> Field | None:
    second = _second(view)
    if second is None or view.contrast is None or view.over is None:
        return None
    rest = {name: level for name, level in view.panels[0].items() if name != second.name}
    first, other = view.contrast
    columns = [
        view.difference(rest | {second.name: level}, first, other) for level in second.levels
    ]
    values = np.stack(columns, axis=1)  # (persons, levels of the second, stops)
    found, shape = band(values.reshape(len(values), -1)), values.shape[1:]
    mean, low, high = (x.reshape(shape) for x in (found.mean, found.low, found.high))
    return Field(second, rest, mean, low, high) if np.isfinite(mean).any() else None


def _second(view: View) -> Factor | None:
    """The other factor with most levels; of equal ones a quantity first."""
    if view.line is None or view.over is None or len(view.over.levels) < 2:
        return None
    others = [f for f in view.part.factors if f not in (view.line, view.over)]
    worth = [f for f in others if len(f.levels) >= _FEWEST]
    return max(worth, key=lambda f: (len(f.levels), f.is_numeric), default=None)


def _colours(ax: Axes, mean: Floats) -> QuadMesh:
    """Fields from purple, below zero, over white to orange: far apart for every eye."""
    reach = float(np.nanmax(abs(mean))) or 1.0
    return ax.pcolormesh(
        *np.meshgrid(np.arange(mean.shape[1] + 1) - 0.5, np.arange(mean.shape[0] + 1) - 0.5),
        np.ma.masked_invalid(mean),
        cmap="PuOr_r",
        vmin=-reach,
        vmax=reach,
        edgecolor="white",
        linewidth=0.5,
    )


def _write(ax: Axes, field: Field, image: QuadMesh) -> None:
    """Numbers and marks: no colour is needed to read them, nor is it in a print."""
    reach = float(np.nanmax(abs(field.mean))) or 1.0
    for (y, x), mean in np.ndenumerate(field.mean):
        if not np.isfinite(mean):
            continue
        paint = image.to_rgba(np.asarray(mean))
        told = _mark(float(field.low[y, x]), float(field.high[y, x]))
        text = number(float(mean)) if field.mean.shape[1] <= _MOST_WRITTEN else ""
        ax.text(
            x,
            y,
            " ".join(filter(None, (told, text))),
            ha="center",
            va="center",
            fontsize=8,
            fontweight="bold" if told else "normal",
            color="white" if abs(mean) > _DARK * reach else INK,
            bbox={"fc": paint, "ec": "none", "pad": 0.6},  # no line through it
            zorder=5,
        )


def _mark(low: float, high: float) -> str:
    return _ABOVE if low > 0 else _BELOW if high < 0 else ""


def _contours(ax: Axes, field: Field) -> bool:
    """The line of no effect with those of the band's edges; whether there is one."""
    has_zero = False
    for values, style, width in (
        (field.mean, "-", 2.2),
        (field.low, "--", 1),
        (field.high, "--", 1),
    ):
        known = values[np.isfinite(values)]
        crosses = len(known) > 0 and known.min() < 0 < known.max()
        if crosses and min(values.shape) > 1:
            ax.contour(
                np.ma.masked_invalid(values), [0.0], colors=INK, linestyles=style, linewidths=width
            )
            has_zero |= style == "-"
    return has_zero


def _numbers(view: View, field: Field) -> Numbers:
    numbers = Numbers()
    for row, level in enumerate(field.second.levels):
        edges = {"mean": field.mean, "band_low": field.low, "band_high": field.high}
        told = {with_unit(name, view.measure): values[row] for name, values in edges.items()}
        numbers.add(field.panel | {field.second.name: level}, view.along_x() | told)
    return numbers
