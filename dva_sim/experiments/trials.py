"""Runs by which numbers are chosen or judged, in studies that are derived from one."""

from __future__ import annotations

from pathlib import Path

from dva_sim.experiments.analysis.screening import Screening, judged
from dva_sim.experiments.analysis.tuning import chosen_of
from dva_sim.experiments.execution.scheduling import Simulate
from dva_sim.experiments.results.results import Results
from dva_sim.experiments.runner import run_study
from dva_sim.experiments.study.cell_grid import refuse_unknown_measures
from dva_sim.experiments.study.inputs import StudyInputs
from dva_sim.experiments.study.plan import Progress
from dva_sim.experiments.study.screening import screening_study
from dva_sim.experiments.study.study import Study
from dva_sim.experiments.study.tuning import TunedValues, tuning_study
from dva_sim.kernel.errors import RunsFailed
from dva_sim.options.studies import RunOptions


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
