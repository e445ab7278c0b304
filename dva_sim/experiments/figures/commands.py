"""What becomes of the commands: how old they are, and how many arrive."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from dva_sim.experiments.cadence import Cadence
from dva_sim.experiments.effects import Floats, View, nan_mean
from dva_sim.experiments.figures.effect import CadenceOf, mark_boundary
from dva_sim.experiments.figures.keys import Ends, legend, name_lines
from dva_sim.experiments.figures.numbers import Numbers
from dva_sim.experiments.figures.palette import INK, Look, looks
from dva_sim.experiments.figures.style import (
    Drawn,
    axis_label,
    dodge,
    finish,
    has_lines,
    label_panels,
    log_axis,
    panel_grid,
    wrapped,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_ROOM = 1.08  # above the highest mark
_QUANTILES = ("p05", "p25", "p50", "p75", "p95")


def command_age(view: View) -> Drawn | None:
    """How old a command is when it takes effect, as quantile ranges."""
    columns = [f"command_age_{q}_s" for q in _QUANTILES]
    if not all(view.part.has(column) for column in columns):
        return None
    figure, axes = panel_grid(view, 3.0)
    look = looks(view.line)
    grids, numbers = [view.part.grid(column) for column in columns], Numbers()
    for ax, panel in zip(axes, view.shown, strict=True):
        for level, offset in dodge(view.lines):
            ages = [_cell_means(view.curve(grid, panel, level)) for grid in grids]
            _ranges(ax, [stop + offset for stop in range(len(view.stops))], ages, look[level])
            told = dict(zip(columns, ages, strict=True))
            numbers.add(view.setting(panel, level), view.along_x() | told)
    log_axis(axes[0])
    label_panels(axes, view, axis_label("age_s", wrapped("Command age at application", 22)))
    legend(figure, view.line)
    caption = (
        "From the making of a command to its effect at the motors: mark, the median; thick, the "
        "middle half; thin, 5 to 95 % (averages over runs). The axis is logarithmic."
    )
    return finish(figure, "command_age", "Age of commands when they take effect", caption, numbers)


def command_rate(view: View, cadence_of: CadenceOf) -> Drawn | None:
    """Commands applied per second, beside what arithmetic allows request/reply."""
    if not view.part.has("command_rate_hz"):
        return None
    figure, axes = panel_grid(view, 3.0)
    look, every, numbers = looks(view.line), [], Numbers()
    grid = view.part.grid("command_rate_hz")
    for ax, panel in zip(axes, view.shown, strict=True):
        ends: Ends = {}
        for i, (level, place) in enumerate(dodge(view.lines)):
            means = _cell_means(view.curve(grid, panel, level))
            if has_lines(view):  # larger marks below, where lines lie on each other
                _line(ax, means, look[level], 4 + 2.5 * (len(view.lines) - 1 - i))
            else:
                x = np.arange(len(means)) + place
                ax.plot(x, means, look[level].mark, ms=5, color=look[level].colour)
            ends[level] = float(means[-1])
            told = view.along_x() | {"command_rate_hz": means}
            numbers.add(view.setting(panel, level), told)
        _closed_form(ax, view, cadence_of(panel))
        every.append(ends)
    tops = [ax.dataLim.y1 for ax in axes if np.isfinite(ax.dataLim.y1)]  # a panel may be empty
    axes[0].set_ylim(0, _ROOM * max(tops, default=1.0))
    label_panels(axes, view, axis_label("command_rate_hz"))
    if has_lines(view):
        name_lines(axes, every, view.line)
    else:
        legend(figure, view.line)
    caption = "Mean over runs, without commands that came too old or were overtaken."
    if any(cadence_of(panel) for panel in view.shown):
        caption += (
            " Dashed: what REQ/REP allows by arithmetic, min(1/T, 1/(2 d + P)), with wanted period "
            "T, one-way delay d and processing time P."
        )
    return finish(figure, "command_rate", "Commands applied per second", caption, numbers)


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


def _closed_form(ax: Axes, view: View, cadence: Cadence | None) -> None:
    if cadence is None or view.over is None or not view.over.is_numeric:
        return
    delays = np.array([float(v) for v in view.over.levels if isinstance(v, int | float)])
    x = np.linspace(0, len(delays) - 1, 40 * len(delays))
    rates = [cadence.lock_step_rate(d) for d in np.interp(x, np.arange(len(delays)), delays)]
    ax.plot(x, rates, color=INK, lw=1, ls=(0, (4, 2)), zorder=3)
    mark_boundary(ax, view.over, cadence, text=False)
