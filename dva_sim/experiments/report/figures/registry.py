"""Figures in the order of a report, and how they are drawn."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

from dva_sim.experiments.analysis.study_view import StudyView
from dva_sim.experiments.report.figures import (
    answer_figure,
    choice_map,
    claims,
    commands,
    delay_budget,
    distribution,
    effect,
    endings,
    heat_map,
    scatter,
    shift,
    tradeoff,
)
from dva_sim.experiments.report.figures.style import Drawn, ReportFigure, styled
from dva_sim.kernel.wording import listing
from dva_sim.simulation.labels import factor_name

if TYPE_CHECKING:
    from dva_sim.experiments.report.summary import Reading


SHIPPED: Final[tuple[type[ReportFigure], ...]] = (
    choice_map.ChoiceMapFigure,
    claims.ClaimsFigure,
    answer_figure.AnswerFigure,
    distribution.Distributions,
    effect.Differences,
    heat_map.HeatMap,
    scatter.Scatter,
    delay_budget.DelayBudget,
    commands.CommandAge,
    tradeoff.TradeOff,
    endings.EndingsInTime,
    shift.Trade,
    shift.WayToBest,
    commands.Brought,
)
"""In the order of the report; the first that applies answers the question."""


def draw_all(reading: Reading) -> list[Drawn]:
    """Draw every figure that the results hold the tables and columns for."""
    view = reading.view
    if view is None:
        return []
    return [drawn for kind in SHIPPED for drawn in _drawn(kind(), view, reading)]


def _drawn(figure: ReportFigure, view: StudyView, reading: Reading) -> list[Drawn]:
    """Return the one figure, if there is anything to be seen."""
    if not figure.applies(view, reading):
        return []
    with styled():
        drawn = figure.draw(view, reading)
    if drawn is None:
        return []
    note = (_what_panels_are(view),) if figure.has_panels else ()
    return [replace(drawn, reads=tuple(filter(None, (*drawn.reads, *note))))]


def _what_panels_are(view: StudyView) -> str:
    """Say which factors the panels show, and whether every setting has a panel."""
    if len(view.panels) < 2:
        return ""
    names = listing([factor_name(name) for name in view.panels[0]])
    words = f"Panels: {names}"
    if len(view.shown) == len(view.panels):
        return f"{words}."
    return f"{words} ({len(view.shown)} of {len(view.panels)} settings; the tables hold them all)."
