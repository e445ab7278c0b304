"""Strokes that the figures of experiments share: means with intervals, bands, rings, lines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from dva_sim.experiments.figures.style import FAINT, INK, SOFT
from dva_sim.experiments.validation.operators.judging import Verdict
from dva_sim.experiments.validation.operators.targets import Line
from dva_sim.experiments.validation.operators.trials import Cells, Floats, Trials, person_means
from dva_sim.tasks.measures import fit_line

if TYPE_CHECKING:
    from matplotlib.axes import Axes

TIME = "movement_time_s"
BLUE, ORANGE = "#0072B2", "#D55E00"


def by(trials: Trials, key: str) -> tuple[Floats, Floats]:
    """Mean movement time of each value of a column."""
    rows = [(value, some[TIME].mean()) for (value,), some in trials.by(key)]
    values, times = np.array(rows).T
    return values, times


def ratios_of(cells: Cells, reference: str) -> list[Floats]:
    """Each person's mean time in each cell, against its own in one of them."""
    own = person_means(cells[reference], TIME)
    return [person_means(trials, TIME) / own for trials in cells.values()]


def half(values: Floats) -> float:
    """Half of a 95 % interval of a mean over persons."""
    return float(1.96 * values.std(ddof=1) / np.sqrt(len(values)))


def points(axes: Axes, x: list[float], persons: Sequence[Floats], colour: str) -> None:
    """Means over persons with their intervals, and a line through them."""
    paired(axes, x, [p.mean() for p in persons], persons, colour)


def paired(
    axes: Axes,
    x: list[float],
    means: Sequence[float],
    persons: Sequence[Floats],
    colour: str = BLUE,
) -> None:
    """The same with the means given, and intervals from the persons."""
    halves = [half(p) for p in persons]
    look: dict[str, Any] = {"fmt": "o-", "color": colour, "ms": 5, "lw": 1.2, "elinewidth": 1.4}
    axes.errorbar(x, means, yerr=halves, clip_on=False, **look)


def curve(
    axes: Axes, own: Mapping[int, Trials], name: str, scale: float, colour: str, label: str
) -> None:
    """A column by gain, named for the key."""
    points(
        axes, list(map(float, own)), [scale * person_means(t, name) for t in own.values()], colour
    )
    axes.plot([], [], "o-", color=colour, ms=5, label=label)


def straight(axes: Axes, x: Floats, y: Floats, verdict: Verdict) -> None:
    """Points and the line through them, with how straight they are."""
    line = fit_line(x, y)
    ends = np.array([0.0, x.max()])
    axes.plot(ends, line.intercept + line.slope * ends, color=SOFT, lw=1.0, zorder=1)
    axes.plot(x, y, "o", color=BLUE, ms=5)
    low = verdict.line.low
    text = f"R² {verdict.found.value:.3f}, published at least {low:g}"
    axes.text(0.04, 0.95, text, transform=axes.transAxes, va="top", fontsize=8)
    axes.set_xlim(left=0)
    axes.set_ylim(bottom=0)


def bar(axes: Axes, x: float, line: Line, width: float) -> None:
    """A band as a grey bar."""
    low, high = line.low or 0.0, line.high or 0.0
    axes.bar([x], [high - low], width, bottom=low, color=FAINT, alpha=0.8, lw=0, zorder=0)


def ring(axes: Axes, x: float, line: Line) -> None:
    """The published number, if there is one."""
    if line.target is not None:
        axes.plot([x], [line.target], "o", mfc="none", mec=ORANGE, ms=9, mew=1.5)


def value(axes: Axes, x: float, verdict: Verdict) -> None:
    """A simulated value with its interval, and in words."""
    found = verdict.found
    axes.plot([x, x], [found.low, found.high], color=BLUE, lw=1.4)
    axes.plot([x], [found.value], "o", color=BLUE, ms=6, clip_on=False, zorder=3)
    axes.annotate(
        f"{found.value:.2f}",
        (x, found.value),
        (9, 0),
        textcoords="offset points",
        va="center",
        fontsize=8,
        color=INK,
    )
