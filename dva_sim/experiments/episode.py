"""One run of a study: from its job to its rows."""

from __future__ import annotations

from typing import Any

from dva_sim.experiments import design, metrics
from dva_sim.experiments.design import Job
from dva_sim.experiments.study import Study
from dva_sim.simulation import rehearse, simulate

Tables = dict[str, list[dict[str, Any]]]


def run_job(job: Job) -> Tables:
    """Simulate a job; rows by table. Ways are kept for the first trial of the first person."""
    recording = simulate(job.scenario, job.seed)
    tables: Tables = {
        "runs": [metrics.run_row(recording)],
        "events": metrics.event_rows(recording),
    }
    if job.person == 0 and job.trial == 0:
        tables["tracks"] = metrics.track_rows(recording)
    return tables


def rehearse_all(study: Study) -> None:
    """Build one run of every configuration, so that a mistake is found before the first run.

    Raises:
        ConfigError: what cannot be read or placed.
    """
    for cell in design.cells(study):
        rehearse(cell.scenario, study.seed)
