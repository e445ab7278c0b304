"""The delay from which request/reply falls behind the wanted rate, as a line across a figure."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from dva_sim.experiments.analysis.cadence import Cadence, cadence
from dva_sim.experiments.analysis.run_grid import Factor
from dva_sim.experiments.analysis.study_view import StudyView
from dva_sim.experiments.report.figures import style
from dva_sim.experiments.report.figures.palette import SOFT
from dva_sim.network.patterns import PATTERNS
from dva_sim.simulation.labels import level_name

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def cadences(view: StudyView, scenario: Mapping[str, Any]) -> list[Cadence | None]:
    """Cadence of each panel shown; None unless delay and a waiting pattern are varied."""
    waits = any(level in PATTERNS and PATTERNS[str(level)].in_step for level in view.lines)
    if view.over is None or view.over.name != "link.delay_s" or not waits:
        return [None for _ in view.shown]
    return [cadence(scenario, panel) for panel in view.shown]


def boundary(over: Factor | None, cadence: Cadence | None) -> float | None:
    """Position on x where the wanted rate becomes too high; None if outside the levels.

    Where places are not to scale, between two levels is the middle between them.
    """
    place = style.place_of(over, cadence.boundary_s) if over and cadence else None
    if place is None or over is None or style.is_to_scale(over) or place.is_integer():
        return place
    return math.floor(place) + 0.5


def mark_boundary(ax: Axes, over: Factor | None, cadence: Cadence | None, text: bool) -> None:
    """The delay from which request/reply must fall behind the wanted rate."""
    place = boundary(over, cadence)
    if place is None or over is None or cadence is None:
        return
    ax.axvline(place, color=SOFT, lw=1, ls=(0, (4, 2)), zorder=1)
    if text:
        ax.annotate(
            f"2d + P = T\n(d = {level_name(over.name, round(cadence.boundary_s, 4))})",
            (place, 0.98),
            xycoords=("data", "axes fraction"),
            xytext=(4, 0),
            textcoords="offset points",
            va="top",
            fontsize=8,
            color=SOFT,
        )
