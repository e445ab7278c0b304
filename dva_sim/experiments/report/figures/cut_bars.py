"""Bars beyond the axes: the axes fit the persons' values, and marks show the cut bars."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from dva_sim.experiments.analysis.run_grid import Floats
from dva_sim.kernel.wording import number

if TYPE_CHECKING:
    from matplotlib.axes import Axes

from dva_sim.experiments.report.figures.style import NO_RESULT_LABEL

_ROOM = 0.15  # share of what persons span that is left free beyond them, where bands are cut


_HAIR = 1e-3  # of an axis, below which what is cut cannot be seen


_LINE_PT = 9.0  # height of a line of small print [pt]


def fit_to(axes: Axes, values: Floats) -> str:
    """Cut bands far beyond what any person did, lest they flatten all else; says if it did.

    To be followed by `mark_cuts`, once the limits are settled.
    """
    bottom, top = axes.get_ylim()
    if not len(values):
        return ""
    room = _ROOM * (float(np.ptp(values)) or abs(float(values[0])) or 1.0)
    low = max(bottom, values.min() - room)
    high = min(top, values.max() + room)
    axes.set_ylim(low, high)
    if (low, high) == (bottom, top):
        return ""
    return (
        "Bands and bars that go far beyond what any person did are cut: an arrow head at the edge "
        "of the axes, with the number at which they end."
    )


@dataclass(frozen=True)
class Bars:
    """Bars that may exceed the axes: position, low end and high end of each `(n,)`.

    Attributes:
        axes: In which they are drawn.
        at: Place of each, across it.
        low: Low end of each bar.
        high: High end of each bar.
        colour: Colour of all bars.
        along: The axis along which they lie.
    """

    axes: Axes
    at: Floats
    low: Floats
    high: Floats
    colour: str
    along: Literal["x", "y"] = "y"


def mark_cuts(every: Sequence[Bars]) -> None:
    """Draw an arrow head where an edge of the axes cuts a bar, with the bound out of sight.

    To be called last: the limits must be settled.
    """
    beside: Counter[tuple[Axes, str, int, int]] = Counter()
    for bars in every:
        is_up = bars.along == "y"
        low, high = sorted(bars.axes.get_ylim() if is_up else bars.axes.get_xlim())
        for ends, edge, side in ((bars.low, low, -1), (bars.high, high, 1)):
            for at, end in zip(bars.at, ends, strict=True):
                if side * (end - edge) > _HAIR * (high - low):
                    spot = (bars.axes, bars.along, side, round(at))
                    _arrow_head(bars, float(at), edge, side, beside[spot], number(float(end)))
                    beside[spot] += 1


def _arrow_head(bars: Bars, at: float, edge: float, side: int, row: int, bound: str) -> None:
    """Draw an arrow head at an edge; of several bounds at one stop one stands below the other."""
    look: dict[str, Any] = {
        "color": bars.colour,
        "label": NO_RESULT_LABEL,
        "clip_on": False,
        "zorder": 6,
    }
    if bars.along == "y":
        point = (at, edge)
        mark = "v^"[side > 0]
        offset = (6.0, -side * (2 + _LINE_PT * row))
        across = "left"
        up = "top" if side > 0 else "bottom"
    else:
        point = (edge, at)
        mark = "<>"[side > 0]
        offset = (-2.0 * side, 6 + _LINE_PT * row)
        across = "right" if side > 0 else "left"
        up = "bottom"
    bars.axes.plot(*point, mark, ms=6, **look)
    bars.axes.annotate(
        bound,
        point,
        xytext=offset,
        textcoords="offset points",
        ha=across,
        va=up,
        fontsize=7.5,
        color=bars.colour,
        zorder=6,
    )
