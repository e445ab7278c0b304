"""Content of a report from a results folder, without pictures or pages."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dva_sim import statistics
from dva_sim.experiments.analysis.answer import Answer, Finding, OtherRuns
from dva_sim.experiments.analysis.conditions import get
from dva_sim.experiments.analysis.hypothesis_tests import Judgement, Tested, judged
from dva_sim.experiments.analysis.robustness import support_of_part
from dva_sim.experiments.analysis.run_grid import (
    Floats,
    RunGrid,
    Table,
    as_floats,
    person_means,
)
from dva_sim.experiments.analysis.sample_size import SizePlan, plans
from dva_sim.experiments.analysis.study_view import (
    StudyView,
    covariates_of,
    keys_of,
    part_of,
    parts_of,
    possible_values,
)
from dva_sim.experiments.report.answer_conditions import depends
from dva_sim.experiments.report.answer_sentences import telling_stop
from dva_sim.experiments.report.cell_table import CellTable, cell_table, tuning_warning
from dva_sim.experiments.report.choice_table import lead_of
from dva_sim.experiments.report.hypothesis_tables import verdict_lead
from dva_sim.experiments.report.prose import sentence
from dva_sim.experiments.report.results_reading import ResultsReading
from dva_sim.experiments.results.manifest import status_of
from dva_sim.experiments.study.parts import STRATEGY, Level
from dva_sim.kernel.wording import listing, quantity
from dva_sim.simulation.labels import factor_name, level_name, measure_called
from dva_sim.statistics import band, quantile_interval

_MAX_ERRORS = 3
ROBOT_SHARE = "robot_share"


class Reading(ResultsReading):
    """Content of a report: answer, verdicts, size plans, cells and warnings."""

    @cached_property
    def answer(self) -> Answer:
        """The answer and the conditions it depends on."""
        if self.view is None:
            return Answer("No run was completed, so there is nothing to answer with.")
        if why := self.distrusted.get(self.view.part.name):
            return Answer(f"The answer is withheld: {why}. Fix this, and run the study again.")
        answer = self.page.answer(in_context(self))
        tested = self.judgement.tested if self._confirms else []
        if tested:
            rest = f"Not registered, over all levels at once: {answer.lead}"
            answer = replace(answer, lead=self._verdicts(tested), notes=[rest, *answer.notes])
        if self.map is not None:
            answer = replace(answer, lead=lead_of(self.map), notes=[answer.lead, *answer.notes])
        weighed = [few_that_weigh(self.finding, self.view)] if self.finding is not None else []
        notes = [*self._why_nothing, *answer.notes, *self._undeclared, *filter(None, weighed)]
        return replace(answer, depends=answer.depends | depends(self), notes=notes)

    @property
    def _why_nothing(self) -> Sequence[str]:
        """Note on a contrast with the same value in every pair of runs."""
        finding = self.finding
        view = self.view
        if finding is None or view is None or np.nanmax(finding.bounds, initial=-1.0) != 0.0:
            return []
        has_robots = view.part.has(ROBOT_SHARE)
        share = float(np.nanmean(view.part.grid(ROBOT_SHARE))) if has_robots else None
        return [sentence("same_everywhere", factor=factor_name(finding.factor), share=share)]

    @property
    def _undeclared(self) -> Sequence[str]:
        """A note on a contrast that was taken because no other is possible."""
        is_taken = self.finding is not None and not self.study.get("answer")
        return ["No answer was declared for these levels: this is their only contrast."] * is_taken

    def _verdicts(self, tested: Sequence[Tested]) -> str:
        """Return the registered hypotheses and what they depend on."""
        beyond = any(self._is_extrapolated(claim) for claim in tested)
        model = only_model(self, tested[0].contrast.part)
        return verdict_lead(tested, self.cluster, is_extrapolated=beyond, only_model=model)

    def _is_extrapolated(self, claim: Tested) -> bool:
        """Return True if a side of a hypothesis lies beyond the delays people were watched at."""
        name = claim.contrast.part
        factor = claim.contrast.factor
        part = part_of(self.study, self.runs, name)
        support = support_of_part(part, self.scenario_of(name)) if self.page.has_support else None
        if support is None:
            return False
        sides = [claim.at | {factor: level} for level in claim.contrast.contrast]
        return any(part.where(support.outside.astype(float), side).any() for side in sides)

    @property
    def _confirms(self) -> bool:
        """Return True for the registered run, whose verdicts lead the report."""
        return status_of(self.manifest).kind == "confirmatory"

    @cached_property
    def judgement(self) -> Judgement:
        """The comparisons and hypotheses as they came out."""
        return judged(self.study, self._trusted) if self._trusted else Judgement([], [])

    @property
    def _trusted(self) -> Table:
        """Runs of all parts except distrusted ones; empty if there are none."""
        parts = np.asarray(self.runs["part"]) if self.runs else np.empty(0)
        is_trusted = ~np.isin(parts, list(self.distrusted))
        return (
            {name: np.asarray(self.runs[name])[is_trusted] for name in self.runs}
            if is_trusted.any()
            else {}
        )

    @cached_property
    def plans(self) -> list[SizePlan]:
        """Sizes a study needs: for all tests if exploratory, else for those left open."""
        if not self._trusted:
            return []
        explores = status_of(self.manifest).kind == "exploratory"
        return plans(self.study, self._trusted, None if explores else self._decided)

    @property
    def _decided(self) -> set[str]:
        """Names of hypotheses and comparisons that are decided, so need no more persons."""
        tested = self.judgement.tested
        shown = 1 - statistics.LEVEL
        at_last = {c.name: c.adjusted <= shown for c in self.judgement.compared}  # as planned
        decided = {name for name, is_shown in at_last.items() if is_shown}
        return decided | {claim.name for claim in tested if claim.verdict != "open"}

    @cached_property
    def cells(self) -> list[CellTable]:
        """A table of cells for each part that has runs."""
        if self.view is None:
            return []
        parts = parts_of(self.study, self.runs)
        tables = [self._cells_of(part, self.view) for part in parts if len(part)]
        return [table for table in (*tables, *self.page.beside()) if table.rows]

    def _cells_of(self, part: RunGrid, view: StudyView) -> CellTable:
        page = self.page
        scenario = self.scenario_of(part.name)
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
        """Return factors of a zip that another one stands for."""
        axes = [factor.name for factor in part.factors]
        zipped = (self.study.get("design") or {}).get("zip") or ()
        return [name for name in zipped if name not in axes]

    @property
    def broken(self) -> str:
        """The number of runs that broke a safety rule, by part; empty if none did."""
        if "violations" not in self.runs:
            return ""
        parts = np.asarray(self.runs["part"])[as_floats(self.runs["violations"]) > 0].tolist()
        counts = {part: parts.count(part) for part in dict.fromkeys(parts)}
        return listing([f"{n} run{'s' * (n > 1)} of part {part}" for part, n in counts.items()])

    @property
    def warnings(self) -> list[str]:
        """Warnings to be shown first."""
        lines = []
        if failures := self.results.failures:
            errors = dict.fromkeys(str(failure.get("error")) for failure in failures)
            first_errors = "; ".join(list(errors)[:_MAX_ERRORS])
            lines.append(
                f"Runs that failed and are missing below: {len(failures)} ({first_errors})."
            )
        for part, reason in self.distrusted.items():
            lines.append(f"In part {part} {reason}: no contrast of this part is shown.")
        if self.events is not None and self.events.warns:
            lines.append(str(self.events))
        if self.broken:
            lines.append(f"Safety rules were broken in {self.broken}.")
        for name in covariates_of(self.study, self.view.part)[1] if self.view else ():
            lines.append(
                f"The answer is not adjusted for {name}: over these persons its mean is more than "
                "five standard errors off zero."
            )
        if tuning := tuning_warning(self.manifest):
            lines.append(tuning)
        if self.manifest.get("versions", {}).get("dirty"):
            lines.append("The program that made the runs had changes that were not committed.")
        return lines


def few_that_weigh(finding: Finding, view: StudyView) -> str:
    """Warn where runs that count with the whole horizon dominate the mean; give the median."""
    if finding.horizon is None or not view.part.has("confirmed"):
        return ""
    grid = view.part.grid("confirmed")
    stops = []
    for stop in range(len(view.stops)):
        sides = [
            view.curve(grid, view.panels[0], side)[stop] for side in (finding.first, finding.second)
        ]
        runs = sum(int(np.isfinite(side).sum()) for side in sides)
        missed = sum(int((side < 1).sum()) for side in sides)
        if 0 < missed < runs / 4:
            level = level_name(finding.over, view.stops[stop]) if view.over else ""
            median = quantile_interval(*_differences(finding, view, stop))
            stops.append((level, missed, runs, median))
    horizon = quantity(finding.horizon, "s")
    return sentence("weighed", horizon=horizon, stops=stops, unit=finding.unit) if stops else ""


def _differences(finding: Finding, view: StudyView, stop: int) -> tuple[Floats, NDArray[Any]]:
    """Return the first minus second, run by run, and whose they are."""
    values = view.values
    panel = view.panels[0]
    first, second = (
        view.curve(values, panel, side)[stop] for side in (finding.first, finding.second)
    )
    return (first - second).ravel(), view.part.person


def in_context(reading: ResultsReading) -> Finding | None:
    """Return the finding with the range over other settings and over models of the persons."""
    view = reading.view
    finding = reading.finding
    if view is None or finding is None or (stop := telling_stop(finding)) is None:
        return finding
    stops = reading.robustness.stops if reading.robustness is not None else ()
    repeats = [r for s in stops if s.level == finding.levels[stop] for r in s.others]
    bands = [view.band_of(p, finding.first, finding.second) for p in view.panels[1:]]
    differences = [(float(b.mean[stop]), float(b.low[stop]), float(b.high[stop])) for b in bands]
    return replace(
        finding,
        models=_together(finding.mean[stop], [(r.mean, r.low, r.high) for r in repeats]),
        elsewhere=_together(
            finding.mean[stop], [each for each in differences if np.isfinite(each[0])]
        ),
        only_model=only_model(reading, finding.part),
        useful=useful_counts(view),
    )


def only_model(reading: ResultsReading, part: str) -> str:
    """`strategy adaptive`, if the persons of a part steer by one strategy and no other was run."""
    strategy = get(reading.scenario_of(part), STRATEGY)
    if not strategy or reading.cluster != "person" or reading.robustness is not None:
        return ""
    if STRATEGY in {key.name for key in keys_of(reading.study)}:
        return ""
    return f"strategy {level_name(STRATEGY, strategy)}"


def _together(mean: float, differences: list[tuple[float, float, float]]) -> OtherRuns | None:
    """Return the outer limits of intervals, and the range of their means; None without any."""
    if not differences:
        return None
    means, lows, highs = zip(*differences, strict=True)
    return OtherRuns(
        low=min(lows),
        high=max(highs),
        means=(min(means), max(means)),
        count=len(differences),
        turns=any(high < 0 if mean > 0 else low > 0 for _, low, high in differences),
    )


def useful_counts(view: StudyView) -> tuple[tuple[Level, Level], ...]:
    """Return each side of the contrast with the last count shown to help more than the one before.

    The band covers all steps of both sides at once. Where no step helps, the count is the first.

    Returns:
        Pairs of side and count; nothing where the answer does not run over a count.
    """
    over = view.over
    better = measure_called(view.measure).better
    if over is None or view.contrast is None or not over.name.endswith(".count") or not better:
        return ()
    sign = 1.0 if better == "large" else -1.0
    grid = view.part.grid(view.measure)
    curves = [view.curve(grid, view.panels[0], side) for side in view.contrast]
    steps = np.concatenate([sign * np.diff(curve, axis=0) for curve in curves])
    helps = (band(person_means(steps)).low > 0).reshape(len(curves), -1)
    last = [int(np.flatnonzero([True, *row])[-1]) for row in helps]
    return tuple(zip(view.contrast, (over.levels[stop] for stop in last), strict=True))
