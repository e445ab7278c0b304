"""Exact checks and experiments, spread over processes."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, cast

from dva_sim.experiments.execution import executors
from dva_sim.experiments.execution.scheduling import run_all
from dva_sim.experiments.study.cell_grid import StudyJob
from dva_sim.kernel import resources
from dva_sim.kernel.config import load_yaml
from dva_sim.kernel.errors import RunsFailed
from dva_sim.kernel.streams import Streams, derive_seed
from dva_sim.simulation.models import AnyScenario, Tables
from dva_sim.simulation.task import TaskScenario, build, play
from dva_sim.validation.operators.exact import EXACT
from dva_sim.validation.operators.experiments import FOLDER, Experiment
from dva_sim.validation.operators.verdicts import (
    Cells,
    Found,
    Trials,
    certain,
    collect,
    with_intervals,
)

PERSONS, QUICK_PERSONS = 24, 6
_EXACT = "exact"

Traits = Mapping[str, float]
Progress = Callable[[int], None]


@dataclass(frozen=True)
class OperatorsSetting:
    """How experiments are played.

    Attributes:
        strategy: How the persons steer.
        seed: Of all luck, who the persons are included.
        persons: How many.
        quick: Few trials.
        workers: Processes.
        traits: Medians that take the place of the population's, for a fit.
    """

    strategy: str
    seed: int = 1
    persons: int = PERSONS
    quick: bool = False
    workers: int = 1
    traits: Traits | None = None


def play_exact(
    checks: Sequence[str], setting: OperatorsSetting, progress: Progress = lambda done: None
) -> dict[str, Found]:
    """The value of each line of some exact checks, by its id.

    Raises:
        RunsFailed: one of them could not be simulated.
    """
    jobs = [_job(_EXACT, check, 0, setting.seed, None) for check in checks]
    rows = _played(jobs, setting.workers, progress)
    values = ((job.config, row) for job in jobs for row in rows[job.key])
    return {f"{check}/{row['line']}": certain(float(row["value"])) for check, row in values}


def play_experiments(
    experiments: Sequence[Experiment],
    setting: OperatorsSetting,
    progress: Progress = lambda done: None,
) -> dict[str, Cells]:
    """The trials of each experiment, by its name.

    Raises:
        ConfigError: a task cannot be read, or there is no such strategy.
        RunsFailed: a trial failed.
    """
    jobs = [job for e in experiments for job in _jobs(e, setting)]
    rows = _played(jobs, setting.workers, progress)
    played: dict[str, dict[str, list[tuple[int, Any]]]] = {}
    for job in jobs:
        cells = played.setdefault(job.part, {})
        cells.setdefault(str(dict(job.cell)["name"]), []).append((job.person, rows[job.key]))
    return {part: _collected(cells) for part, cells in played.items()}


def measured(
    experiments: Sequence[Experiment], played: Mapping[str, Cells], seed: int
) -> dict[str, Found]:
    """The value of each line with its interval, by its id."""
    found: dict[str, Found] = {}
    for experiment in experiments:
        rng = Streams(seed).fresh(f"resampling/{experiment.name}")
        found |= with_intervals(experiment.measure, played[experiment.name], rng)
    return found


def jobs_of(experiments: Sequence[Experiment], setting: OperatorsSetting) -> int:
    """How many jobs the experiments take."""
    return sum(len(e.cells) for e in experiments) * setting.persons


def perform(job: StudyJob) -> Tables:
    """One exact check, or all trials of one person in one cell."""
    if job.part == _EXACT:
        values = EXACT[job.config](job.seed)
        return {"rows": [{"line": line, "value": value} for line, value in values.items()]}
    return {"rows": play(cast(TaskScenario, job.scenario), job.seed)}


def _jobs(experiment: Experiment, setting: OperatorsSetting) -> list[StudyJob]:
    """A person meets the same luck in every cell."""
    document = load_yaml(resources.find(experiment.scenario, FOLDER))
    jobs = []
    for cell, changes in experiment.cells.items():
        every = {**changes, **(experiment.quick if setting.quick else {})}
        every |= {"operator.strategy": setting.strategy, "operator.population_seed": setting.seed}
        every |= {f"operator.traits.{t}": v for t, v in (setting.traits or {}).items()}
        for person in range(setting.persons):
            scenario = build(document, {**every, "operator.person": person})
            seed = derive_seed("operators", experiment.name, setting.seed, person)
            jobs.append(_job(experiment.name, cell, person, seed, scenario))
    return jobs


def _job(part: str, name: str, person: int, seed: int, scenario: TaskScenario | None) -> StudyJob:
    return StudyJob(
        part=part,
        cell=(("name", name),),
        index=0,
        person=person,
        trial=0,
        seed=seed,
        scenario=cast(AnyScenario, scenario),
        config=name if part == _EXACT else f"{part}/{name}",
    )


def _played(
    jobs: Sequence[StudyJob], workers: int, progress: Progress
) -> dict[tuple[str, int], list[dict[str, Any]]]:
    """The rows of each job by its key."""
    rows: dict[tuple[str, int], list[dict[str, Any]]] = {}
    for batch in run_all(jobs, perform, executors.local(workers)):
        for outcome in batch:
            if outcome.error is not None:
                raise RunsFailed(f"{outcome.key[0]!r} could not be simulated: {outcome.error}")
            rows[outcome.key] = json.loads(outcome.tables or "")["rows"]
        progress(len(rows))
    return rows


def _collected(cells: Mapping[str, list[tuple[int, Any]]]) -> dict[str, Trials]:
    return {name: collect(rows) for name, rows in cells.items()}
