"""Tuning: every value of a key is tried alike for all, on persons who take no part in the study."""

from __future__ import annotations

from pathlib import Path

from dva_sim import __version__
from dva_sim.experiments.analysis.run_grid import Factor, RunGrid, Setting
from dva_sim.experiments.execution.runner import Progress, run_study
from dva_sim.experiments.execution.scheduling import LIMIT_S, Simulate
from dva_sim.experiments.results.results import Results
from dva_sim.experiments.study.cell_grid import basis_of_tuning, refuse_unknown_measures
from dva_sim.experiments.study.hashing import fingerprint
from dva_sim.experiments.study.inputs import StudyInputs
from dva_sim.experiments.study.parts import Tuning
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
from dva_sim.statistics import mean_interval

_DIGITS = 6  # of what was seen, in the file


def tune(
    study: Study,
    out: str | Path,
    *,
    jobs: int | None = None,
    episode: Simulate | None = None,
    progress: Progress | None = None,
    limit_s: float = LIMIT_S,
) -> TunedValues:
    """Try every value, or go on with trying, and choose by the rule.

    Args:
        out: Results folder of the trials.
        jobs: Processes; by default one for each core.
        episode: Function that makes the tables of one run; by default a simulation.
        progress: Called with the number of runs done and of all runs, as they finish.
        limit_s: A run that takes longer, by the wall clock, has failed.

    Raises:
        ConfigError: the study tunes nothing, or asks for a measure that there is none of.
        RunsFailed: some did, so that values would be judged by different persons.
    """
    rule = rule_of(study)
    trials = tuning_study(study)
    inputs = StudyInputs(study)
    refuse_unknown_measures(inputs)
    run_study(trials, out, jobs=jobs, episode=episode, progress=progress, limit_s=limit_s)
    results = Results.load(out)
    if results.failures:
        error = str(results.failures[0]["error"])
        raise RunsFailed(f"{len(results.failures)} runs failed, so nothing is chosen: {error}")
    for reason in results.distrusted.values():
        raise RunsFailed(f"{reason}, so nothing is chosen")
    factors = [Factor(name, levels) for name, levels in trials.factors.items()]
    part = RunGrid(results.table("runs"), rule.part, factors)
    if not part.has(rule.measure):
        raise ConfigError(f"tuning.measure {rule.measure!r} has no value in any of these runs")
    whens = list(part.settings(but=[f.name for f in part.factors if f.name not in rule.by]))
    seen = [_tried(part, rule, when, value) for when in whens for value in rule.levels]
    return TunedValues(
        study=study.file.stem,
        made_with=f"{__version__} {fingerprint()}",
        basis=basis_of_tuning(inputs),
        tuning=rule,
        chosen=tuple(_choice(seen, when) for when in whens),
        seen=tuple(seen),
    )


def _tried(part: RunGrid, rule: Tuning, when: Setting, value: float) -> TriedValue:
    """One value, judged by `(persons, trials)` of the measure."""
    cell = part.where(part.grid(rule.measure), {**rule.at, **when, rule.key: value})
    found = mean_interval(cell.ravel(), part.persons.repeat(len(part.trials)))
    low, high = (found.low, found.high) if found.n_persons > 1 else (found.mean, found.mean)
    mean, low, high = (round(x, _DIGITS) for x in (found.mean, low, high))
    return TriedValue(when=when, value=value, mean=mean, low=low, high=high)


def _choice(seen: list[TriedValue], when: Setting) -> ChosenValue:
    return ChosenValue(when=when, value=choose({s.value: s.mean for s in seen if s.when == when}))
