"""A study resolved: all that its files say, its cells and its runs, made once and passed on."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

from dva_sim.experiments.study import cell_grid
from dva_sim.experiments.study.cell_grid import DesignCell, StudyJob
from dva_sim.experiments.study.factor_levels import Traits
from dva_sim.experiments.study.hashing import input_names
from dva_sim.experiments.study.inputs import StudyInputs
from dva_sim.experiments.study.study import Study
from dva_sim.experiments.study.tuning import TunedValues, TuningBasis
from dva_sim.kernel.errors import ConfigError
from dva_sim.simulation.models import AnyScenario, model_for
from dva_sim.simulation.run_measures import RunMeasure

_BATCH_IN_BUDGET = 2  # persons, where a budget alone ends a study

Progress = Callable[[int, int], object]
"""Called with a number of things that are done, and of all."""


@dataclass(frozen=True, eq=False)
class StudyPlan:
    """Plan of a study's runs, made before anything is run.

    Attributes:
        study: Study as loaded; if run as registered, with the seed of its registration.
        scenarios: The scenario of each part before any factor has changed it.
        cells: Its configurations, in order.
        rehearsed: The configurations in which a mistake would show: of ranges, their ends.
        parameter_sets: The traits of each set of parameters of the persons.
        tuned: The tuned values; None if no cell has any.
        basis: The persons and phones as they are now, if there are tuned values.
        measures: The measures that the study brings itself, by names that hold in any process.
    """

    study: Study
    scenarios: Mapping[str, AnyScenario]
    cells: Sequence[DesignCell]
    rehearsed: Sequence[DesignCell]
    parameter_sets: Sequence[Traits]
    tuned: TunedValues | None
    basis: TuningBasis | None
    measures: Mapping[str, RunMeasure]

    @classmethod
    def of(cls, study: Study | StudyPlan) -> StudyPlan:
        """Return the plan of a study; a plan is its own.

        Raises:
            ConfigError: a file that cannot be read, or a cell that is not valid.
        """
        if isinstance(study, StudyPlan):
            return study
        inputs = StudyInputs(study)
        cells = cell_grid.cells(study, inputs)
        return cls(
            study=study,
            scenarios={part: cell_grid.base_scenario(inputs, part) for part in study.parts},
            cells=cells,
            rehearsed=cell_grid.to_rehearse(study, cells, inputs),
            parameter_sets=inputs.parameter_sets,
            tuned=inputs.tuned,
            basis=None if inputs.tuned is None else cell_grid.basis_of_tuning(inputs),
            measures=inputs.measures,
        )

    @property
    def is_real_time(self) -> bool:
        """True if runs take real time, so that nothing else may run beside them."""
        return any(model_for(scenario).is_real_time for scenario in self.scenarios.values())

    @cached_property
    def input_names(self) -> Sequence[str]:
        """Texts of scenarios and measures that may name files."""
        return input_names((cell.scenario for cell in self.cells), self.measures)

    @cached_property
    def jobs(self) -> list[StudyJob]:
        """All runs in a fixed order: part, cell, person, trial; the repeats last."""
        return cell_grid.jobs(self.study, self.cells)

    @cached_property
    def rounds(self) -> list[list[StudyJob]]:
        """The jobs in batches of persons; a study that nothing can stop early is one batch."""
        study = self.study
        ends = [study.persons]
        if study.stop is not None:
            ends = study.stop.looks(study.persons)
        elif study.budget_s is not None:
            ends = [*range(_BATCH_IN_BUDGET, study.persons, _BATCH_IN_BUDGET), study.persons]
        batches: list[list[StudyJob]] = [[] for _ in ends]
        for job in self.jobs:
            batches[bisect_right(ends, job.person)].append(job)
        return [batch for batch in batches if batch]

    @cached_property
    def runs(self) -> int:
        """Number of different runs; jobs with equal keys are one."""
        return len({job.key for job in self.jobs})


def checked_plan(study: Study, progress: Progress = lambda *_: None) -> StudyPlan:
    """Plan a study, and build one run of every cell, so that a mistake is found before the first.

    Args:
        study: From `load_study`.
        progress: Called with the number of cells that were built, and of all.

    Raises:
        ConfigError: what cannot be read, placed or recorded, or what this machine lacks.
    """
    plan = StudyPlan.of(study)
    if study.record is not None:
        scenarios = plan.scenarios.values()
        if not any(model_for(scenario).is_recorded for scenario in scenarios):
            models = ", ".join(sorted({scenario.model for scenario in scenarios}))
            problem = "needs runs of the full model; this study's are"
            raise study.error(f"record: {study.record} {problem} {models}", ("record",))
        if study.record == "worst" and study.answer is None:
            problem = "record: worst needs an answer: it says by which measure"
            raise study.error(problem, ("record",))
    missing = {model_for(cell.scenario).lacks(cell.scenario): None for cell in plan.rehearsed}
    if problems := list(filter(None, missing)):
        raise ConfigError("; ".join(problems))
    for done, cell in enumerate(plan.rehearsed, 1):
        cell_grid.rehearse(study, cell)
        progress(done, len(plan.rehearsed))
    return plan
