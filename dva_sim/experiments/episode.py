"""One run of a study: from its job to its rows."""

from __future__ import annotations

import re
from collections import defaultdict

from dva_sim.experiments import design
from dva_sim.experiments.design import Job
from dva_sim.experiments.models import Tables, model_for
from dva_sim.experiments.recording import refuse_what_cannot_be_recorded
from dva_sim.experiments.study import Study
from dva_sim.scenario import Scenario, contradictions


def run_job(job: Job) -> Tables:
    """Simulate a job; rows by table. Ways are kept for the first trial of the first person."""
    first = job.person == 0 and job.trial == 0
    return model_for(job.scenario).tables(job.scenario, job.seed, with_tracks=first)


def contradictions_in(study: Study) -> list[str]:
    """What does not go together in some configurations, each kind told once, as a sentence.

    Two are of one kind if they begin with the same words, up to the first number.
    """
    every = design.cells(study)
    found: dict[str, list[str]] = defaultdict(list)
    for cell in every:
        for told in contradictions(cell.scenario) if isinstance(cell.scenario, Scenario) else ():
            found[re.split(r"\d", told, maxsplit=1)[0]].append(told)
    return [
        f"{alike[0]} (in {len(alike)} of {len(every)} configurations)" for alike in found.values()
    ]


def rehearse_all(study: Study) -> None:
    """Build one run of every configuration, so that a mistake is found before the first run.

    Raises:
        ConfigError: what cannot be read, placed or recorded.
    """
    refuse_what_cannot_be_recorded(study)
    for cell in design.to_rehearse(study, design.cells(study)):
        design.rehearse(study, cell)
