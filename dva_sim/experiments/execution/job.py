"""One run of a study: from its job to its rows."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Callable, Sequence

from dva_sim.experiments.execution.kept_recordings import refuse_what_cannot_be_recorded
from dva_sim.experiments.study import cell_grid
from dva_sim.experiments.study.cell_grid import Cell, Job
from dva_sim.experiments.study.study import Study
from dva_sim.simulation.models import Tables, model_for
from dva_sim.simulation.scenario import Scenario, contradictions

Progress = Callable[[int, int], object]


def run_job(job: Job) -> Tables:
    """Simulate a job; rows by table. Ways are kept for the first trial of the first person."""
    first = job.person == 0 and job.trial == 0
    return model_for(job.scenario).tables(job.scenario, job.seed, with_tracks=first)


def contradictions_in(cells: Sequence[Cell]) -> list[str]:
    """What does not go together in some configurations, each kind told once, as a sentence.

    Two are of one kind if they begin with the same words, up to the first number.
    """
    found: dict[str, list[str]] = defaultdict(list)
    for cell in cells:
        for told in contradictions(cell.scenario) if isinstance(cell.scenario, Scenario) else ():
            found[re.split(r"\d", told, maxsplit=1)[0]].append(told)
    return [
        f"{alike[0]} (in {len(alike)} of {len(cells)} configurations)" for alike in found.values()
    ]


def rehearse_all(study: Study, progress: Progress = lambda *_: None) -> list[Cell]:
    """Build one run of every configuration, so that a mistake is found before the first run.

    Args:
        study: From `load_study`.
        progress: Called with the number of configurations that were built, and of all.

    Returns:
        The configurations, of which there may be so many that making them again takes time.

    Raises:
        ConfigError: what cannot be read, placed or recorded.
    """
    refuse_what_cannot_be_recorded(study)
    cells = cell_grid.cells(study)
    every = cell_grid.to_rehearse(study, cells)
    for done, cell in enumerate(every, 1):
        cell_grid.rehearse(study, cell)
        progress(done, len(every))
    return cells
