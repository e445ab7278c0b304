"""Content of a report from a results folder, without pictures or pages."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from dva_sim import statistics
from dva_sim.experiments.analysis.answer import Answer
from dva_sim.experiments.analysis.hypothesis_tests import Judgement, Tested, judged
from dva_sim.experiments.analysis.run_grid import (
    RunGrid,
    Table,
    as_floats,
)
from dva_sim.experiments.analysis.sample_size import SizePlan, plans
from dva_sim.experiments.analysis.study_view import (
    StudyView,
    covariates_of,
    layout_of,
    possible_values,
)
from dva_sim.experiments.analysis.support import support_of_part
from dva_sim.experiments.report.answer_conditions import depends
from dva_sim.experiments.report.answer_context import in_context, only_model
from dva_sim.experiments.report.cell_table import CellTable, cell_table
from dva_sim.experiments.report.choice_table import lead_of
from dva_sim.experiments.report.heavy_runs import few_that_weigh
from dva_sim.experiments.report.hypothesis_tables import verdict_lead
from dva_sim.experiments.report.results_reading import ResultsReading
from dva_sim.experiments.report.tuning_table import tuning_warning
from dva_sim.experiments.results.manifest import status_of
from dva_sim.kernel.wording import listing

_MOST_ERRORS = 3


class Reading(ResultsReading):
    """Content of a report: answer, verdicts, size plans, cells and warnings."""

    @cached_property
    def answer(self) -> Answer:
        """The answer and the conditions it depends on."""
        if self.view is None:
            return Answer("No run was completed, so there is nothing to answer with.")
        if why := self.distrusted.get(self.view.part.name):
            return Answer(f"The answer is withheld: {why}. Fix this, and run the study again.")
        found = self.page.answer(in_context(self))
        tested = self.judgement.tested if self._confirms else []
        if tested:
            rest = f"Not registered, over all levels at once: {found.lead}"
            found = replace(found, lead=self._verdicts(tested), notes=[rest, *found.notes])
        if self.map is not None:
            found = replace(found, lead=lead_of(self.map), notes=[found.lead, *found.notes])
        weighed = [few_that_weigh(self.finding, self.view)] if self.finding is not None else []
        notes = [*found.notes, *self._undeclared, *filter(None, weighed)]
        return replace(found, depends=found.depends | depends(self), notes=notes)

    @property
    def _undeclared(self) -> Sequence[str]:
        """A note on a contrast that was taken because no other is possible."""
        is_taken = self.finding is not None and not self.study.get("answer")
        return ["No answer was declared for these levels: this is their only contrast."] * is_taken

    def _verdicts(self, tested: Sequence[Tested]) -> str:
        """The registered hypotheses in at most two sentences, and what they depend on."""
        beyond = any(self._is_extrapolated(claim) for claim in tested)
        model = only_model(self, tested[0].contrast.part)
        return verdict_lead(tested, self.cluster, is_extrapolated=beyond, only_model=model)

    def _is_extrapolated(self, claim: Tested) -> bool:
        """True if a side of a hypothesis lies beyond the delays people were watched at."""
        name, factor = claim.contrast.part, claim.contrast.factor
        table, factors = layout_of(self.study, self.runs)
        part = RunGrid(table, name, factors)
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
        """The runs of all parts but those that are distrusted; empty without any."""
        parts = np.asarray(self.runs["part"]) if self.runs else np.empty(0)
        kept = ~np.isin(parts, list(self.distrusted))
        return {name: np.asarray(self.runs[name])[kept] for name in self.runs} if kept.any() else {}

    @cached_property
    def plans(self) -> list[SizePlan]:
        """Sizes a study needs: for all tests if exploratory, else for those left open."""
        if not self._trusted:
            return []
        explores = status_of(self.manifest).kind == "exploratory"
        return plans(self.study, self._trusted, None if explores else self._decided)

    @property
    def _decided(self) -> set[str]:
        """Hypotheses and comparisons that need no more persons."""
        tested, shown = self.judgement.tested, 1 - statistics.LEVEL
        at_last = {c.name: c.adjusted <= shown for c in self.judgement.compared}  # as planned
        decided = {name for name, is_shown in at_last.items() if is_shown}
        return decided | {claim.name for claim in tested if claim.verdict != "open"}

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
    def broken(self) -> str:
        """The number of runs that broke a safety rule, by part; empty if none did."""
        return _broken(self.runs)

    @property
    def warnings(self) -> list[str]:
        """Warnings to be shown first."""
        found = []
        if failures := self.results.failures:
            errors = dict.fromkeys(str(failure.get("error")) for failure in failures)
            shown = "; ".join(list(errors)[:_MOST_ERRORS])
            found.append(f"Runs that failed and are missing below: {len(failures)} ({shown}).")
        for part, reason in self.distrusted.items():
            found.append(f"In part {part} {reason}: no contrast of this part is shown.")
        if self.events is not None and self.events.warns:
            found.append(str(self.events))
        if self.broken:
            found.append(f"Safety rules were broken in {self.broken}.")
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
