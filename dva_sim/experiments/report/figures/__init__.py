"""The figures of a report, drawn from the tables of a study."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING, Any

from dva_sim.experiments.analysis.paired_effects import Setting, Table, View
from dva_sim.experiments.analysis.predictions import Cadence, cadence
from dva_sim.experiments.report.figures import (
    budget,
    contrast,
    distribution,
    effect,
    factorial,
    outcomes,
    scatter,
    site_map,
    tradeoff,
)
from dva_sim.experiments.report.figures.style import Drawn, styled
from dva_sim.experiments.study.labels import factor_name, listing
from dva_sim.experiments.study.schema import Level

if TYPE_CHECKING:
    from dva_sim.experiments.report.summary import Reading

__all__ = ["Drawn", "draw_all"]


_OF_PANELS = (
    *("distributions", "differences", "levels", "delay_budget", "command_age", "command_rate"),
    *("tradeoff", "story_times", "story_outcomes"),
)


def draw_all(reading: Reading) -> list[Drawn]:
    """Every figure that the tables have the columns for, in the order of the report."""
    view = reading.view
    if view is None:
        return []
    scenario, tracks = reading.scenario_of(view.part.name), reading.table("tracks")
    cadence_of, robustness = _cadences(view, scenario), reading.robustness
    with styled():
        drawn = [
            distribution.distributions(view),
            effect.differences(view, cadence_of),
            effect.measure_levels(view) if view.line or view.over else None,
            factorial.heat_map(view),
            None if reading.study.get("design") else factorial.effects(view),
            *scatter.scatters(reading),
            contrast.repeats(view, robustness) if robustness else None,
            budget.delay_budget(view),
            effect.command_age(view),
            effect.command_rate(view, cadence_of),
            tradeoff.tradeoff(view),
            outcomes.endings_in_time(reading.endings, view) if reading.endings else None,
            site_map.trajectories(view, tracks, scenario) if tracks else None,
            *_lapses(reading, view),
            *_story(view, reading.table("events")),
        ]
    note = _what_panels_are(view)
    there = [f for f in drawn if f is not None]
    return [replace(f, reads=(*f.reads, note)) if f.name in _OF_PANELS else f for f in there]


def _what_panels_are(view: View) -> str:
    """Which factors a panel stands for, and whether there is one for each of their settings."""
    if len(view.panels) < 2:
        return ""
    names = listing([factor_name(name) for name in view.panels[0]])
    words = f"Panels: {names}"
    if len(view.shown) == len(view.panels):
        return f"{words}."
    return f"{words} ({len(view.shown)} of {len(view.panels)} settings; the tables hold them all)."


def _cadences(view: View, scenario: Mapping[str, Any]) -> effect.CadenceOf:
    """The cadence of each panel, where lock-step and delay are among the factors."""

    @cache
    def lookup(panel: tuple[tuple[str, Level], ...]) -> Cadence | None:
        return cadence(scenario, dict(panel))

    def cadence_of(panel: Setting) -> Cadence | None:
        along_delay = view.over is not None and view.over.name == "link.delay_s"
        return lookup(tuple(panel.items())) if along_delay and "req-rep" in view.lines else None

    return cadence_of


def _lapses(reading: Reading, view: View) -> list[Drawn | None]:
    """The typical and the worst run, where some were kept."""
    episodes = reading.episodes
    if episodes is None:
        return []
    scenario = reading.scenario_of(view.part.name)
    return [
        site_map.time_lapse(view, episode, scenario, which)
        for episode, which in zip(episodes, ("typical", "worst"), strict=True)
    ]


def _story(view: View, table: Table) -> list[Drawn | None]:
    part = outcomes.story_part(table, view) if table else None
    if part is None:
        return []
    events = outcomes.Events(table, part, view)
    return (
        [outcomes.responses(view, events), outcomes.outcomes(view, events)] if len(events) else []
    )
