"""All figures in the order of a report, those of users after them, and how a report draws them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
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
    factorial,
    heat_map,
    repeats,
    scatter,
    shift,
    story,
    time_lapse,
    tradeoff,
    trajectories,
    transport,
)
from dva_sim.experiments.report.figures.style import Drawn, ReportFigure, styled
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.plugins import FAILURES, Plugins, error_text
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
    factorial.FactorialEffects,
    scatter.Scatter,
    scatter.Sobol,
    repeats.RepeatsFigure,
    delay_budget.DelayBudget,
    commands.CommandAge,
    commands.CommandRate,
    tradeoff.TradeOff,
    endings.EndingsInTime,
    trajectories.Trajectories,
    time_lapse.TypicalRun,
    time_lapse.WorstRun,
    story.StoryTimes,
    story.StoryOutcomes,
    shift.Trade,
    shift.Stages,
    shift.FatesOfEvents,
    shift.WayToBest,
    shift.Percentiles,
    shift.Burden,
    transport.Brought,
    transport.Taken,
)
"""In the order of the report; the first that applies answers the question."""


PLUGINS: Final = Plugins(
    kind="figure",
    base=ReportFigure,  # type: ignore[type-abstract]
    shipped={kind.name: kind for kind in SHIPPED},
    folder="experiments/figures",
    group="dva_sim.figures",
    key="figures",
    needs="draw(view, reading)",
    public="dva_sim.experiments.report.figures.ReportFigure",
)


def load_figures(names: Iterable[str], base: Path | None = None) -> list[ReportFigure]:
    """Figures of users, by `mine.py:Mine` or as an installed package calls them.

    They run code, so they are loaded only where a study's file or a command names them, never
    because a results folder does.

    Args:
        names: The figures.
        base: Folder that files are looked for in first.

    Raises:
        ConfigError: one cannot be had, has no usable name, or is there already.
    """
    found: list[ReportFigure] = []
    taken = set(PLUGINS.shipped)
    for name in names:
        figure = PLUGINS.make(name, PLUGINS.find(name, base), {})
        problem = _problem_of_name(figure, taken)
        if problem:
            raise ConfigError(f"figure {name!r}: {problem}")
        taken.add(figure.name)
        found.append(figure)
    return found


def _problem_of_name(figure: ReportFigure, taken: set[str]) -> str:
    """Say what is wrong with a figure's name or title; empty if nothing."""
    name = getattr(figure, "name", None)
    if not isinstance(name, str) or not name.isidentifier() or name != name.lower():
        return f"its name is {name!r}; should be small letters, digits and underscores"
    if name in taken:
        return f"a figure {name!r} is drawn already; should have a name of its own"
    if not getattr(figure, "title", ""):
        return "has no title; should say what is seen"
    return ""


_LATER: Final = tuple(
    kind.name
    for kind in (
        distribution.Distributions,
        effect.Differences,
        factorial.FactorialEffects,
        commands.CommandAge,
        time_lapse.TypicalRun,
        time_lapse.WorstRun,
        story.StoryTimes,
        shift.Percentiles,
    )
)
"""Figures that repeat the answer in other ways, or show single runs; the first matters most."""


def leading(drawn: Sequence[Drawn], most: int) -> list[Drawn]:
    """The figures that a reader sees first, in the order of the report.

    Args:
        drawn: Figures.
        most: The number of figures that there is room for.
    """
    ranks = {name: rank for rank, name in enumerate(_LATER, start=1)}
    ranked = sorted(drawn, key=lambda figure: ranks.get(figure.name, 0))[:most]
    return [figure for figure in drawn if figure in ranked]


def draw_all(reading: Reading, own: Sequence[ReportFigure] = ()) -> tuple[list[Drawn], list[str]]:
    """Every figure that the results hold the tables and columns for.

    Args:
        reading: The results.
        own: Figures of users, which come last.

    Returns:
        The figures, and what was wrong with those of users that could not be drawn.
    """
    view, drawn, problems = reading.view, [], []
    if view is None:
        return [], []
    for kind in SHIPPED:
        drawn += _drawn(kind(), view, reading)
    for figure in own:
        try:
            drawn += _drawn(figure, view, reading)
        except FAILURES as error:
            problems.append(f"figure {figure.name!r} cannot be drawn: {error_text(error)}")
    return drawn, problems


def _drawn(figure: ReportFigure, view: StudyView, reading: Reading) -> list[Drawn]:
    """The one figure, if there is anything to be seen."""
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
