"""What an answer depends on, beside its numbers: the persons, the settings, the delays.

A number can be reproducible to the last digit and still hang on what was assumed. So each of
these is told beside the answer, with what was measured of it in the same study.

What a results folder says, in words and tables, without a picture or a page being made.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from dva_sim import statistics
from dva_sim.experiments.analysis.answer import Answer, Finding
from dva_sim.experiments.analysis.answer_sentences import telling_stop
from dva_sim.experiments.analysis.competing_risks import Endings, horizon_of, with_endings
from dva_sim.experiments.analysis.conditions import get
from dva_sim.experiments.analysis.hypothesis_tests import Judgement, judged
from dva_sim.experiments.analysis.kept_episodes import KeptEpisode, Tables, typical_and_worst
from dva_sim.experiments.analysis.places import at, places
from dva_sim.experiments.analysis.robustness import RepeatedAnswer, robustness_of
from dva_sim.experiments.analysis.run_grid import (
    Floats,
    RunGrid,
    Setting,
    Table,
    as_floats,
    present,
)
from dva_sim.experiments.analysis.sample_size import SizePlan, plans
from dva_sim.experiments.analysis.study_view import (
    StudyView,
    covariates_of,
    finding_of,
    keys_of,
    layout_of,
    points_of,
    possible_values,
    row_names,
    view_of,
    with_rows,
)
from dva_sim.experiments.analysis.support import support_of_part
from dva_sim.experiments.report.cell_table import CellTable, cell_table
from dva_sim.experiments.report.event_outcomes import EventOutcomes, outcomes_of
from dva_sim.experiments.report.heavy_runs import few_that_weigh
from dva_sim.experiments.report.hypothesis_tables import verdict_sentences
from dva_sim.experiments.report.model_page import ModelPage
from dva_sim.experiments.report.model_pages import page_of
from dva_sim.experiments.report.people_page import PeoplePage, people_drove
from dva_sim.experiments.report.tuning_table import tuning_warning
from dva_sim.experiments.results.manifest import status_of
from dva_sim.experiments.results.results import Results
from dva_sim.experiments.study.parts import POINT, REPEATS, STRATEGY, TUNING
from dva_sim.kernel.wording import capital, listing, number, percent, quantity
from dva_sim.simulation.labels import brief, level_name, setting, take_up
from dva_sim.statistics import band

_WAITING = "move_and_wait_share"
_MOST_SETTINGS = 3  # told one by one


def depends(reading: Reading) -> dict[str, str]:
    """By what each sentence is about; only what can be told of this study."""
    view, finding = reading.view, reading.finding
    if view is None or finding is None:
        return {}
    told = {
        _whom(reading): _persons(reading, view, finding),
        "Settings": " ".join(_settings(reading, view, finding)),
        "Delays": _beyond(view, finding),
    }
    return {about: words for about, words in told.items() if words}


def _whom(reading: Reading) -> str:
    return f"{capital(reading.cluster)}s"


# --- persons -------------------------------------------------------------------------------
def _persons(reading: Reading, view: StudyView, finding: Finding) -> str:
    """How many, how they steer, and what other models of them say."""
    if reading.cluster == "shift":
        return f"{finding.persons} simulated, independent of each other."
    trials = reading.trials_of(finding.part)
    each = f", {trials} trial{'s' if trials > 1 else ''} each" if trials else ""
    who = f"{finding.persons} simulated{each}; no human took part."
    strategy = get(reading.scenario_of(finding.part), STRATEGY)
    if not strategy:
        return who
    if STRATEGY in {key.name for key in keys_of(reading.study)}:
        return f"{who} How they steer is varied."
    steer = f"They steer by the strategy {level_name(STRATEGY, strategy)}{_how(view, finding)}"
    if reading.robustness is not None:
        return f"{who} {steer}. {_under_others(reading.robustness)}"
    return f"{who} {steer}; with another, not tried here, the difference may be smaller or larger."


def _how(view: StudyView, finding: Finding) -> str:
    """Of the strategy that chooses: how much of the time they moved and waited."""
    stop = telling_stop(finding)
    if stop is None or not view.part.has(_WAITING):
        return ""
    grid, sides = view.part.grid(_WAITING), (finding.first, finding.second)
    shares = [_mean(view.curve(grid, view.panels[0], side)[stop]) for side in sides]
    if not all(0 <= share < 1 for share in shares) or not any(shares):
        return ""
    told = [
        f"{percent(share)} of the time under {level_name(finding.factor, side)}"
        for share, side in zip(shares, sides, strict=True)
    ]
    return f", here by moving and waiting for {listing(told)}"


def _mean(values: Floats) -> float:
    seen = present(values)
    return float(seen.mean()) if len(seen) else math.nan


def _under_others(found: RepeatedAnswer) -> str:
    """At the last level at which it was repeated."""
    told = [stop for stop in found.stops if stop.others]
    if not told:
        return "No repeat under another model of them is complete."
    stop, unit = told[-1], found.unit
    means = [repeat.mean for repeat in stop.others]
    sign = f"{stop.same_sign} of {len(means)}"
    return (
        f"Under other models of them the sign is the same in {sign}, and the difference at "
        f"{level_name(found.over, stop.level)} runs from {number(min(means))} to "
        f"{quantity(max(means), unit)}."
    )


# --- settings ------------------------------------------------------------------------------
def _settings(reading: Reading, view: StudyView, finding: Finding) -> Iterator[str]:
    """The answer under the other settings that were run, and what was not varied at all."""
    stop = telling_stop(finding)
    if finding.within and stop is not None and (others := view.panels[1:]):
        yield f"The answer is for {setting(finding.within)}. {_elsewhere(view, finding, others)}"
    fixed = _fixed(reading, finding.part)
    if fixed:
        yield f"Not varied: {setting(fixed)}."


def _elsewhere(view: StudyView, finding: Finding, others: list[Setting]) -> str:
    """The same difference, at the place of which the answer speaks first."""
    stop = telling_stop(finding) or 0
    where = f" {there}" if (there := at(finding, [stop])) else ""
    found = [(panel, *_difference(view, finding, panel, stop)) for panel in others]
    found = [entry for entry in found if np.isfinite(entry[1])]
    if not found:
        return ""
    if len(found) > _MOST_SETTINGS:
        means = [mean for _, mean, _, _ in found]
        reach = f"{number(min(means))} to {quantity(max(means), finding.unit)}"
        return f"Under the {len(found)} other settings the difference{where} is {reach}."
    told = [
        f"{quantity(mean, finding.unit)} ({number(low)} to {quantity(high, finding.unit)}) "
        f"with {_apart(panel, finding.within)}"
        for panel, mean, low, high in found
    ]
    return f"The difference{where} is {listing(told)}."


def _difference(
    view: StudyView, finding: Finding, panel: Setting, stop: int
) -> tuple[float, float, float]:
    """Mean and band under other settings, within what is possible."""
    found = band(view.difference(panel, finding.first, finding.second))
    low, high = (
        float(np.clip(x[stop], -view.widest, view.widest)) for x in (found.low, found.high)
    )
    return float(found.mean[stop]), low, high


def _apart(panel: Setting, usual: Setting) -> str:
    """The levels of a panel that are not those of the answer."""
    other = {name: level for name, level in panel.items() if level != usual.get(name)}
    return brief(other) if TUNING in other else setting(other)


def _fixed(reading: Reading, part: str) -> dict[str, Any]:
    """Keys that matter and were not varied, with their values."""
    varied = {key.name for key in keys_of(reading.study)}
    values = {
        key: get(reading.scenario_of(part), key)
        for key in reading.page.assumed
        if key not in varied
    }
    return {key: value for key, value in values.items() if isinstance(value, str)}


# --- delays --------------------------------------------------------------------------------
def _beyond(view: StudyView, finding: Finding) -> str:
    """Where nobody was ever watched who could tell whether the simulated persons are right."""
    outside = view.stops_outside(view.panels[0], view.contrast)
    if not outside or view.over is None:
        return ""
    is_everywhere = len(outside) == len(view.stops)
    where = "Throughout" if is_everywhere else capital(places(finding, np.array(outside)))
    return (
        f"{where}, on one side or both, no published experiment covers the delay from picture "
        "to effect: extrapolated."
    )


_MOST_ERRORS = 3
_FEWEST_PAIRS = 4  # of which a correlation says anything


class Reading:
    """A results folder, read once: each part of it when it is first asked for.

    Args:
        results: The folder.
    """

    def __init__(self, results: Results) -> None:
        self.results = results
        self.manifest, self.study = results.manifest, results.study
        take_up(self.manifest.get("columns") or {})
        self._tables: dict[str, Table] = {}

    def __repr__(self) -> str:
        return f"Reading of {self.results.folder}"

    def table(self, name: str) -> Table:
        """Columns of a table; nothing where the study has no such table."""
        if name not in self._tables:
            table: Table = self.results.table(name) if self.results.has(name) else {}
            if name == "runs" and self._is_of_events and self.results.has("events"):
                table = with_endings(table, self.results.table("events"))
            names = {} if name in ("runs", REPEATS) else row_names(self.study, self.runs)
            self._tables[name] = with_rows(table, names) if table and names else table
        return self._tables[name]

    @property
    def _is_of_events(self) -> bool:
        """Whether the answer is about events, whoever saw to them, and not about drives."""
        measure = (self.study.get("answer") or {}).get("measure")
        ends_by_event = page_of(self.scenarios.values()).ends_by_event
        return measure in ("confirmation_mean_s", "response_mean_s") and ends_by_event

    @property
    def runs(self) -> Table:
        """The table of runs."""
        return self.table("runs")

    @property
    def persons(self) -> int:
        """How many were simulated, which a stopping rule or a budget may have decided."""
        return len(np.unique(self.runs["person"])) if self.runs else 0

    @property
    def scenarios(self) -> Mapping[str, Mapping[str, Any]]:
        """Each part's scenario before any factor changed it."""
        found: Mapping[str, Mapping[str, Any]] = self.manifest.get("scenarios", {})
        return found

    def scenario_of(self, part: str) -> Mapping[str, Any]:
        """One part's scenario."""
        return self.scenarios.get(part, {})

    @cached_property
    def view(self) -> StudyView | None:
        """How the study is looked at, with its extrapolations known; None without any run."""
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
        """See `Results`: parts of which no contrast is shown."""
        return self.results.distrusted

    @cached_property
    def finding(self) -> Finding | None:
        """The declared contrast as measured; None, too, where it is withheld."""
        found = finding_of(self.view) if self.view is not None else None
        return replace(found, failed=len(self.results.failures)) if found is not None else None

    @property
    def told(self) -> Finding | None:
        """The finding in the words of the report: where loads are known, along them."""
        return None if self.finding is None else self.page.told(self.finding)

    @cached_property
    def page(self) -> ModelPage:
        """What the report says otherwise of the study's model; asked where there are runs."""
        assert self.view is not None
        if self.by_people:
            return PeoplePage(self.view, self.table("drives"))
        page = page_of(self.scenarios.values())
        fitting = page if page.fits(self.view) else ModelPage
        return fitting(self.view, self.table("events") or None)

    @cached_property
    def by_people(self) -> bool:
        """Return True if people drove the robots, not simulated persons."""
        return people_drove(self.table("drives"))

    @property
    def cluster(self) -> str:
        """What is drawn anew for intervals: persons, or shifts."""
        return "person" if self.view is None else self.page.cluster

    @cached_property
    def endings(self) -> Endings | None:
        """How the events of the answer's part ended; None where a study has none."""
        events = self.table("events")
        if self.view is None or self.by_people or "closing_s" not in events:
            return None
        horizon = horizon_of(self.view, self.scenario_of(self.view.part.name))
        found = Endings(self.view, events, self.runs, horizon)
        return found if len(found) and np.isfinite(horizon) else None

    @cached_property
    def events(self) -> EventOutcomes | None:
        """Outcomes of the events of all runs; None for a study without events."""
        return outcomes_of(self.table("events"))

    @cached_property
    def robustness(self) -> RepeatedAnswer | None:
        """The answer under other models of the persons, where it was repeated."""
        if self.view is None or self.finding is None or not self.table(REPEATS):
            return None
        scenario = self.scenario_of(self.view.part.name)
        return robustness_of(self.study, self.table(REPEATS), self.view, self.finding, scenario)

    @property
    def points(self) -> list[str]:
        """Continuous factors: columns that tell where in its ranges each run lies."""
        return points_of(self.study, self.runs)

    @cached_property
    def episodes(self) -> tuple[KeptEpisode, KeptEpisode] | None:
        """A typical run and the worst, of those that were kept."""
        if self.view is None:
            return None
        names = [n for n in self.study.get("factors", {}) if n != POINT and n in self.runs]
        columns = [*names, *self.points]
        tables = Tables(self.runs, self.table("tracks"), columns, self.table("events"))
        part = self.view.part.name
        return typical_and_worst(self.results.folder, part, self.view.measure, tables)

    @cached_property
    def pair_correlation(self) -> float | None:
        """How alike the two sides of the contrast are, run by run, at the last stop."""
        view = self.view
        if view is None or view.contrast is None:
            return None
        grid = view.part.grid(view.measure)
        first, second = (view.curve(grid, view.panels[0], level)[-1] for level in view.contrast)
        both = np.isfinite(first) & np.isfinite(second)
        if both.sum() < _FEWEST_PAIRS:
            return None
        found = statistics.pair_correlation(first[both], second[both])
        return found if np.isfinite(found) else None

    # --- words and tables ------------------------------------------------------------------

    @cached_property
    def answer(self) -> Answer:
        """What a reader should take home, and what it depends on."""
        if self.view is None:
            return Answer("No run was completed, so there is nothing to answer with.")
        if why := self.distrusted.get(self.view.part.name):
            return Answer(f"The answer is withheld: {why}. Mend it, and run the study again.")
        found = self.page.answer(self.finding)
        tested = self.judgement.tested if self._confirms else []
        verdicts = verdict_sentences(tested, self.cluster)
        if verdicts:
            lead = f"Not registered, over all levels at once: {found.lead}"
            found = replace(found, lead=" ".join([*verdicts, lead]))
        weighed = [few_that_weigh(self.finding, self.view)] if self.finding is not None else []
        notes = [*found.notes, *filter(None, weighed)]
        return replace(found, depends=found.depends | depends(self), notes=notes)

    @property
    def _confirms(self) -> bool:
        """Return True for the registered run, whose verdicts lead the report."""
        return status_of(self.manifest).kind == "confirmatory"

    def trials_of(self, part: str) -> int:
        """How many each person made in a part; 0 where that is not known."""
        own = (self.study.get("parts", {}).get(part) or {}).get("replications")
        return int(own or self.study.get("replications") or 0)

    @cached_property
    def judgement(self) -> Judgement:
        """The comparisons and hypotheses as they came out."""
        return judged(self.study, self._trusted) if self._trusted else Judgement([], [])

    @property
    def _trusted(self) -> Table:
        """The runs of all parts but those that are distrusted; empty without any."""
        parts = np.asarray(self.runs["part"]) if self.runs else np.empty(0)
        kept = ~np.isin(parts, list(self.distrusted))
        return {name: np.asarray(self.runs[name])[kept] for name in self.runs} if kept.any() else {}

    @cached_property
    def plans(self) -> list[SizePlan]:
        """What a study would need: of an exploratory one for all, else for what stayed open."""
        if not self._trusted:
            return []
        explores = status_of(self.manifest).kind == "exploratory"
        return plans(self.study, self._trusted, None if explores else self._decided)

    @property
    def _decided(self) -> set[str]:
        """Hypotheses and comparisons that need no more persons."""
        told, shown = self.judgement.tested, 1 - statistics.LEVEL
        at_last = {c.name: c.adjusted <= shown for c in self.judgement.compared}  # as planned
        decided = {name for name, is_shown in at_last.items() if is_shown}
        return decided | {claim.name for claim in told if claim.verdict != "open"}

    @cached_property
    def cells(self) -> list[CellTable]:
        """A table of cells for each part that has runs."""
        if self.view is None:
            return []
        names = dict.fromkeys(str(name) for name in self.runs["part"])
        table, factors = layout_of(self.study, self.runs, are_points_trials=False)
        parts = [RunGrid(table, name, factors) for name in names]
        return [self._cells_of(part, self.view) for part in parts if len(part)]

    def _cells_of(self, part: RunGrid, view: StudyView) -> CellTable:
        page, scenario = self.page, self.scenario_of(part.name)
        return page.cells(part) or cell_table(
            part,
            view.measure,
            page.summaries,
            support=support_of_part(part, scenario) if page.has_support else None,
            possible=possible_values(view.measure, scenario),
            is_listed=bool(self.study.get("design")),
            points=[*self.points, *self._taken_together(part)],
        )

    def _taken_together(self, part: RunGrid) -> list[str]:
        """Factors of a zip that another one stands for."""
        axes = [factor.name for factor in part.factors]
        zipped = (self.study.get("design") or {}).get("zip") or ()
        return [name for name in zipped if name not in axes]

    @property
    def warnings(self) -> list[str]:
        """What a reader must see before anything else."""
        found = []
        if failures := self.results.failures:
            errors = dict.fromkeys(str(failure.get("error")) for failure in failures)
            shown = "; ".join(list(errors)[:_MOST_ERRORS])
            found.append(f"Runs that failed and are missing below: {len(failures)} ({shown}).")
        for part, told in self.distrusted.items():
            found.append(f"In part {part} {told}: no contrast of this part is shown.")
        if self.events is not None and self.events.warns:
            found.append(str(self.events))
        if broken := _broken(self.runs):
            found.append(f"Safety rules were broken in {broken}.")
        for name in covariates_of(self.study, self.view.part)[1] if self.view else ():
            found.append(
                f"The answer is not adjusted for {name}: over these persons its mean is more than "
                "five standard errors off zero."
            )
        if tuning := tuning_warning(self.manifest):
            found.append(tuning)
        if self.manifest.get("versions", {}).get("dirty"):
            found.append("The program that made the runs had changes that were not committed.")
        return found


def _broken(runs: Table) -> str:
    """`2 runs of part drive and 1 run of part story`; empty where all rules were kept."""
    if "violations" not in runs:
        return ""
    parts = np.asarray(runs["part"])[as_floats(runs["violations"]) > 0].tolist()
    counts = {part: parts.count(part) for part in dict.fromkeys(parts)}
    return listing([f"{n} run{'s' * (n > 1)} of part {part}" for part, n in counts.items()])
