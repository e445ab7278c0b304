"""A results folder, read once: each part of it when it is first asked for."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from dva_sim import statistics
from dva_sim.experiments.analysis.answer import Finding
from dva_sim.experiments.analysis.choice_map import ChoiceMap, choice_map
from dva_sim.experiments.analysis.competing_risks import Endings, horizon_of, with_endings
from dva_sim.experiments.analysis.robustness import RepeatedAnswer, robustness_of, support_of_part
from dva_sim.experiments.analysis.run_grid import (
    Floats,
    Table,
)
from dva_sim.experiments.analysis.study_view import (
    StudyView,
    finding_of,
    points_of,
    possible_values,
    row_names,
    view_of,
    with_rows,
)
from dva_sim.experiments.report.model_page import (
    MiddlewarePage,
    ModelPage,
    TransportPage,
)
from dva_sim.experiments.report.outcome_table import EventOutcomes, outcomes_of
from dva_sim.experiments.report.people_page import PeoplePage, people_drove
from dva_sim.experiments.report.shift_page import ShiftPage
from dva_sim.experiments.results.results import Results
from dva_sim.experiments.study.parts import REPEATS
from dva_sim.simulation.labels import take_up

_MIN_PAIRS = 4  # of which a correlation says anything


class ResultsReading:
    """A results folder, read once: each part of it when it is first asked for.

    Args:
        results: The folder.
    """

    def __init__(self, results: Results) -> None:
        self.results = results
        self.manifest = results.manifest
        self.study = results.study
        take_up(self.manifest.get("columns") or {})
        self._tables: dict[str, Table] = {}

    def __repr__(self) -> str:
        return f"Reading of {self.results.folder}"

    def table(self, name: str) -> Table:
        """Return columns of a table; nothing where the study has no such table."""
        if name not in self._tables:
            table: Table = self.results.table(name) if self.results.has(name) else {}
            if name == "runs" and self.results.has("events") and self._is_of_events(table):
                table = with_endings(table, self.results.table("events"))
            names = {} if name in ("runs", REPEATS) else row_names(self.study, self.runs)
            self._tables[name] = with_rows(table, names) if table and names else table
        return self._tables[name]

    def _is_of_events(self, runs: Table) -> bool:
        """Return True if the answer is about events rather than drives."""
        view = view_of(self.study, runs) if runs else None
        measure = None if view is None or view.contrast is None else view.measure
        ends_by_event = page_of(self.scenarios.values()).ends_by_event
        return measure in ("confirmation_mean_s", "response_mean_s") and ends_by_event

    @property
    def runs(self) -> Table:
        """The table of runs."""
        return self.table("runs")

    @property
    def persons(self) -> int:
        """Number of persons simulated, possibly fewer than planned after an early stop."""
        return len(np.unique(self.runs["person"])) if self.runs else 0

    @property
    def scenarios(self) -> Mapping[str, Mapping[str, Any]]:
        """Each part's scenario before any factor changed it."""
        scenarios: Mapping[str, Mapping[str, Any]] = self.manifest.get("scenarios", {})
        return scenarios

    def scenario_of(self, part: str) -> Mapping[str, Any]:
        """Return one part's scenario."""
        return self.scenarios.get(part, {})

    @cached_property
    def view(self) -> StudyView | None:
        """View of the study with its extrapolations marked; None without runs."""
        view = view_of(self.study, self.runs) if self.runs else None
        if view is None:
            return None
        scenario = self.scenario_of(view.part.name)
        support = support_of_part(view.part, scenario)
        possible = possible_values(view.measure, scenario)
        if view.part.name in self.distrusted:
            view = replace(view, contrast=None)
        return replace(view, outside=support.outside if support else None, possible=possible)

    @cached_property
    def distrusted(self) -> dict[str, str]:
        """Parts without a contrast; see `Results`."""
        return self.results.distrusted

    @cached_property
    def finding(self) -> Finding | None:
        """The declared contrast as measured; None, too, where it is withheld."""
        view = self.view
        if view is None or (finding := finding_of(view)) is None:
            return None
        several = {factor.name for factor in view.part.factors if len(factor.levels) > 1}
        return replace(
            finding,
            failed=len(self.results.failures),
            within={name: level for name, level in finding.within.items() if name in several},
            outside=tuple(view.stops_outside(view.panels[0], view.contrast)),
        )

    @property
    def worded_finding(self) -> Finding | None:
        """The finding in the words of the report: where loads are known, along them."""
        return None if self.finding is None else self.page.worded(self.finding)

    @cached_property
    def page(self) -> ModelPage:
        """Report page for the study's model. Requires at least one run."""
        assert self.view is not None
        if self.by_people:
            return PeoplePage(self.view, self.table("drives"), self.table("reported"))
        page = page_of(self.scenarios.values())
        fitting = page if page.fits(self.view) else ModelPage
        return fitting(self.view, self.table("events") or None)

    @cached_property
    def by_people(self) -> bool:
        """Return True if people drove the robots or decided, not simulated persons."""
        return bool(self.manifest.get("by_people")) or people_drove(self.table("drives"))

    @property
    def cluster(self) -> str:
        """Unit that is resampled for intervals: person or shift."""
        return "person" if self.view is None else self.page.cluster

    @cached_property
    def endings(self) -> Endings | None:
        """Outcomes of events in the answer's part; None if the study has no events."""
        events = self.table("events")
        if self.view is None or self.by_people or "closing_s" not in events:
            return None
        horizon = horizon_of(self.view, self.scenario_of(self.view.part.name))
        endings = Endings(self.view, events, self.runs, horizon)
        return endings if len(endings) and np.isfinite(horizon) else None

    @cached_property
    def events(self) -> EventOutcomes | None:
        """Outcomes of the events of all runs; None for a study without events."""
        return None if self.table("reported") else outcomes_of(self.table("events"))

    @cached_property
    def robustness(self) -> RepeatedAnswer | None:
        """The answer under other models of the persons, where it was repeated."""
        if self.view is None or self.finding is None or not self.table(REPEATS):
            return None
        scenario = self.scenario_of(self.view.part.name)
        return robustness_of(self.study, self.table(REPEATS), self.view, self.finding, scenario)

    @cached_property
    def map(self) -> ChoiceMap | None:
        """Choice map, if the study declares one."""
        return None if self.view is None else choice_map(self.study, self.view)

    @property
    def points(self) -> list[str]:
        """Continuous factors: columns that tell where in its ranges each run lies."""
        return points_of(self.study, self.runs)

    @cached_property
    def last_sides(self) -> list[Floats] | None:
        """Both sides of the contrast at the last stop, `(persons, trials)` each."""
        view = self.view
        if view is None or view.contrast is None:
            return None
        grid = view.part.grid(view.measure)
        return [view.curve(grid, view.panels[0], level)[-1] for level in view.contrast]

    @cached_property
    def pair_correlation(self) -> float | None:
        """Correlation between the contrast's two sides over runs, at the last stop."""
        if self.last_sides is None:
            return None
        first, second = self.last_sides
        both = np.isfinite(first) & np.isfinite(second)
        if both.sum() < _MIN_PAIRS:
            return None
        correlation = statistics.pair_correlation(first[both], second[both])
        return correlation if np.isfinite(correlation) else None

    def trials_of(self, part: str) -> int:
        """Return trials per person in a part; 0 if unknown."""
        trials = (self.study.get("parts", {}).get(part) or {}).get("replications")
        return int(trials or self.study.get("replications") or 0)


PAGES: dict[str, type[ModelPage]] = {
    "timed": ShiftPage,
    "transports": TransportPage,
    "middleware": MiddlewarePage,
}


def page_of(scenarios: Iterable[Mapping[str, Any]]) -> type[ModelPage]:
    """Return the page of a study: that of the first of its models that has one of its own."""
    models = (str(scenario.get("model")) for scenario in scenarios)
    return next((PAGES[model] for model in models if model in PAGES), ModelPage)
