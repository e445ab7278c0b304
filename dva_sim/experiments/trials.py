"""Runs by which numbers are chosen or judged, in studies that are derived from one."""

from __future__ import annotations

from pathlib import Path

from dva_sim import __version__
from dva_sim.experiments.analysis.run_grid import Factor, RunGrid, Setting
from dva_sim.experiments.analysis.screening import Screening, judged
from dva_sim.experiments.execution.scheduling import Simulate
from dva_sim.experiments.results.results import Results
from dva_sim.experiments.runner import run_study
from dva_sim.experiments.study.cell_grid import basis_of_tuning, refuse_unknown_measures
from dva_sim.experiments.study.hashing import fingerprint
from dva_sim.experiments.study.inputs import StudyInputs
from dva_sim.experiments.study.parts import Tuning
from dva_sim.experiments.study.plan import Progress
from dva_sim.experiments.study.screening import screening_study
from dva_sim.experiments.study.study import Study
from dva_sim.experiments.study.tuning import (
    ChosenValue,
    TriedValue,
    TunedValues,
    choose,
    rule_of,
    tuning_study,
)
from dva_sim.kernel.errors import ConfigError, RunsFailed
from dva_sim.options.studies import RunOptions
from dva_sim.statistics import mean_interval


def tune(
    study: Study,
    out: str | Path,
    *,
    jobs: int | None = None,
    episode: Simulate | None = None,
    progress: Progress | None = None,
) -> TunedValues:
    """Try every value alike, on persons who take no part in the study, and choose by the rule.

    Args:
        out: Results folder of the trials; what it holds already is not tried again.
        jobs: Processes; by default one for each core.
        episode: Function that makes the tables of one run; by default a simulation.
        progress: Called with the number of runs done and of all runs, as they finish.

    Raises:
        ConfigError: the study tunes nothing, or asks for a measure that there is none of.
        RunsFailed: some did, so that values would be judged by different persons.
    """
    trials = tuning_study(study)
    refuse_unknown_measures(StudyInputs(study))
    options = RunOptions(trials.file, out, jobs=jobs, progress=progress, report=False)
    results = run_study(options, study=trials, episode=episode).results
    _refuse_failures(results, "chosen")
    for reason in results.distrusted.values():
        raise RunsFailed(f"{reason}, so nothing is chosen")
    return chosen_of(study, results)


def screen(
    study: Study,
    out: str | Path,
    *,
    jobs: int | None = None,
    episode: Simulate | None = None,
    progress: Progress | None = None,
) -> Screening:
    """Run every point of a screening, and judge which assumed numbers move the answer.

    Args:
        out: Results folder; what it holds already is not run again.
        jobs: Processes; by default one for each core.
        episode: Function that makes the tables of one run; by default a simulation.
        progress: Called with the number of runs done and of all runs, as they finish.

    Raises:
        ConfigError: the study is not screened.
        RunsFailed: some did, so that points would be judged by different persons.
    """
    trials = screening_study(study)
    options = RunOptions(trials.file, out, jobs=jobs, progress=progress, report=False)
    results = run_study(options, study=trials, episode=episode).results
    _refuse_failures(results, "judged")
    return judged(study, results)


def _refuse_failures(results: Results, done: str) -> None:
    if results.failures:
        error = str(results.failures[0]["error"])
        raise RunsFailed(f"{len(results.failures)} runs failed, so nothing is {done}: {error}")


_DIGITS = 6  # of what was seen, in the file


def chosen_of(study: Study, results: Results) -> TunedValues:
    """Choose the values of a study's tuned key by its rule, from the runs of all trials.

    Raises:
        ConfigError: none of the runs has a value of the measure.
    """
    rule = rule_of(study)
    factors = [Factor(name, tuple(levels)) for name, levels in results.factors.items()]
    part = RunGrid(results.table("runs"), rule.part, factors)
    if not part.has(rule.measure):
        raise ConfigError(f"tuning.measure {rule.measure!r} has no value in any of these runs")
    whens = list(part.settings(but=[f.name for f in part.factors if f.name not in rule.by]))
    trials = [_tried(part, rule, when, value) for when in whens for value in rule.levels]
    return TunedValues(
        study=study.file.stem,
        made_with=f"{__version__} {fingerprint()}",
        basis=basis_of_tuning(StudyInputs(study)),
        tuning=rule,
        chosen=tuple(
            ChosenValue(
                when=when, value=choose({s.value: s.mean for s in trials if s.when == when})
            )
            for when in whens
        ),
        seen=tuple(trials),
    )


def _tried(part: RunGrid, rule: Tuning, when: Setting, value: float) -> TriedValue:
    """Return one value, judged by `(persons, trials)` of the measure."""
    cell = part.where(part.grid(rule.measure), {**rule.at, **when, rule.key: value})
    interval = mean_interval(cell.ravel(), part.person)
    low, high = (
        (interval.low, interval.high) if interval.n_persons > 1 else (interval.mean, interval.mean)
    )
    mean, low, high = (round(x, _DIGITS) for x in (interval.mean, low, high))
    return TriedValue(when=when, value=value, mean=mean, low=low, high=high)
