"""Legends: a key above the panels, or names at the ends of lines."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from dva_sim.experiments.analysis.run_grid import Factor
from dva_sim.experiments.study.parts import Level
from dva_sim.simulation.labels import level_name

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
from dva_sim.experiments.report.figures.palette import PAPER, Fill, looks

_LINE = 112  # characters that a line of a key holds


_HANDLE = 7  # characters that a mark and the gap beside it take


_ROW = 0.22  # height of a line of a key [in]


_GAP = 0.075  # between names of lines, as a share of the axes' height


Ends = dict[Level, float]  # where each line ends


def key(figure: Figure, handles: Sequence[Artist], names: Sequence[str]) -> None:
    """Draw the key above all panels, in as many lines as it takes, to be read line by line."""
    columns = columns_of([len(name) for name in names])
    order = [i for column in range(columns) for i in range(column, len(names), columns)]
    figure.legend(
        [handles[i] for i in order],
        [names[i] for i in order],
        loc="outside upper left",
        ncols=columns,
        handlelength=1.4,
    )


def key_height(names: Sequence[str]) -> float:
    """Return the height that a legend needs in a figure [in]."""
    columns = columns_of([len(name) for name in names])
    return _ROW * -(-len(names) // columns)


def columns_of(lengths: Sequence[int]) -> int:
    """Return the number of columns that fit, each as wide as its longest name."""
    for columns in range(len(lengths), 1, -1):
        if sum(max(lengths[c::columns]) + _HANDLE for c in range(columns)) <= _LINE:
            return columns
    return 1


def legend(figure: Figure, factor: Factor | None, levels: Sequence[Level] | None = None) -> None:
    """Draw the mark of each level, or of some, where marks are too many to be named one by one."""
    from matplotlib.lines import Line2D

    if factor is None:
        return
    look = looks(factor)
    levels_shown = factor.levels if levels is None else levels
    handles = [
        Line2D([], [], color=look[v].colour, marker=look[v].mark, ls="") for v in levels_shown
    ]
    key(figure, handles, [level_name(factor.name, level) for level in levels_shown])


def box(fill: Fill) -> Artist:
    """Return a handle for the meaning of a surface."""
    from matplotlib.patches import Patch

    return Patch(facecolor=fill.colour, hatch=fill.hatch, edgecolor=PAPER, lw=0.5)


def name_lines(axes: Sequence[Axes], ends: Sequence[Ends], factor: Factor | None) -> None:
    """Write each line's name beside its mark at its end, apart where lines end close together.

    To be called last: the scale of y must be settled.
    """
    if factor is None:
        return
    look = looks(factor)
    for ax, heights in zip(axes, map(_in_axes, axes, ends), strict=True):
        for level, height in zip(heights, apart(list(heights.values()), _GAP), strict=True):
            ax.plot(
                1.02,
                height,
                look[level].mark,
                color=look[level].colour,
                ms=5,
                transform=ax.transAxes,
                clip_on=False,
            )
            name = level_name(factor.name, level, short=True)
            ax.annotate(
                name,
                (1.02, height),
                xycoords="axes fraction",
                xytext=(7, 0),
                textcoords="offset points",
                va="center",
                annotation_clip=False,
            )


def _in_axes(axes: Axes, ends: Ends) -> Ends:
    """Return heights as fractions of the axes, from the lowest up.

    Lines without an end are left out.
    """
    edges = axes.transData.transform([(0.0, y) for y in axes.get_ylim()])
    bottom = float(edges[0, 1])
    top = float(edges[1, 1])
    by_height = sorted((item for item in ends.items() if np.isfinite(item[1])), key=lambda i: i[1])
    return {
        level: (float(axes.transData.transform((0.0, end))[1]) - bottom) / (top - bottom)
        for level, end in by_height
    }


def apart(heights: Sequence[float], gap: float) -> list[float]:
    """Ascending heights, moved up where they are closer than `gap`, all of them below the top."""
    placed: list[float] = []
    for height in heights:
        placed.append(max(height, placed[-1] + gap) if placed else height)
    overshoot = max(0.0, placed[-1] - 1.0) if placed else 0.0
    return [height - overshoot for height in placed]
