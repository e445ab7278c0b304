"""Bars of shares that add up: a panel for each setting and line, a bar for each stop."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from dva_sim.experiments.analysis.run_grid import Factor, Floats, Setting
from dva_sim.experiments.analysis.study_view import StudyView
from dva_sim.experiments.report.figures import style
from dva_sim.experiments.report.figures.legend import key, key_height
from dva_sim.experiments.report.figures.palette import PAPER, Fill
from dva_sim.experiments.study.parts import Level
from dva_sim.kernel.wording import capital
from dva_sim.simulation.labels import brief

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


_HALF = 0.36  # of a bar's width, in stops


_ABREAST = 4  # panels


_BAR = 0.2  # height of a bar with the gap to the next [in]


_AROUND = 0.85  # height of a panel's title and axis [in]


_TITLE = 72  # characters of titles that stand abreast


_PER_INCH, _LEAST = 13, 12  # characters of a factor's name along the height, and the fewest


_NAME = 24  # characters of a stop's name in a line


class Stacks:
    """Bars lie, so that names of any length stand beside them.

    Args:
        label: Label of the axis along the bars.
        parts: Names and handles of the legend: parts of the bars, and other marks.

    Attributes:
        figure: Figure to be finished.
        axes: One for each setting shown and line, in that order.
    """

    def __init__(self, view: StudyView, label: str, parts: Mapping[str, Artist]) -> None:
        count, lines = len(view.lines), len(view.stops)
        columns = min(_ABREAST, count)
        deep = -(-count // columns)
        if view.over is not None:
            lines = len(view.stops) * _most_lines(view.over)
        rows = deep * len(view.shown)
        height = _AROUND + _BAR * lines + key_height(list(parts)) / rows
        self.figure: Figure
        self.figure, grid = style.panels(rows, columns, height, sharex=True, sharey=True)
        key(self.figure, list(parts.values()), list(parts))
        self._view, self._columns = view, columns
        blocks = [grid[n * deep : (n + 1) * deep] for n in range(len(view.shown))]
        flat = [[ax for row in block for ax in row] for block in blocks]
        self.axes: list[Axes] = [ax for block in flat for ax in block[:count]]
        for ax in (ax for block in flat for ax in block[count:]):
            ax.set_visible(False)
        self._label = label

    def panels(self) -> Iterator[tuple[Axes, Setting, Level]]:
        """Each panel with its setting and line."""
        view = self._view
        places = ((panel, level) for panel in view.shown for level in view.lines)
        for ax, (panel, level) in zip(self.axes, places, strict=True):
            yield ax, panel, level

    def close(self) -> None:
        """Label the panels; to be called last, since it ends the fitting to what is drawn."""
        view, columns, count = self._view, self._columns, len(self._view.lines)
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
    """Parts `(stops,)` on end; those that are zero everywhere take no place."""
    floor: Floats = np.zeros(len(next(iter(parts.values()))))
    for name, values in parts.items():
        top = floor + np.nan_to_num(values)
        if (top > floor).any():
            _bars(ax, floor, top, fills[name])
        floor = top


def _bars(ax: Axes, floor: Floats, top: Floats, fill: Fill) -> None:
    """A bar at each stop, from `floor` to `top` `(stops,)`: one artist for all of them."""
    from matplotlib.collections import PolyCollection

    low = np.arange(len(floor)) - _HALF
    high = low + 2 * _HALF
    x, y = np.stack([floor, floor, top, top]), np.stack([low, high, high, low])
    corners = np.stack([x, y], axis=-1).swapaxes(0, 1)
    look: dict[str, Any] = {"facecolor": fill.colour, "hatch": fill.hatch}
    ax.add_collection(PolyCollection(list(corners), **look, edgecolor=PAPER, lw=0.5))
    ax.update_datalim([(0.0, -_HALF), (float(np.max(top, initial=0.0)), len(floor) - 1 + _HALF)])
    ax.autoscale_view()


def _along_y(ax: Axes, over: Factor | None, is_first: bool) -> None:
    """The stops, the first on top."""
    if over is None:
        ax.set_yticks([])
        ax.set_ylim(0.5, -0.5)
        return
    style.level_axis(ax, over, _NAME)
    ax.invert_yaxis()
    height = _BAR * len(over.levels) * _most_lines(over)
    words = style.wrapped(ax.get_ylabel(), max(_LEAST, int(_PER_INCH * height)))
    ax.set_ylabel(words if is_first else "")


def _most_lines(over: Factor) -> int:
    return max(style.wrapped(name, _NAME).count("\n") + 1 for name in style.tick_names(over)[0])
