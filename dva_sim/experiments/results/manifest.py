"""What a results folder says of itself: what was asked and run, and apart, on which machine."""

from __future__ import annotations

import json
import os
import platform
from collections import defaultdict
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

from dva_sim import __version__
from dva_sim.experiments.execution.checkpoint import Journal
from dva_sim.experiments.execution.tables import design_row
from dva_sim.experiments.study import cell_grid
from dva_sim.experiments.study.cell_grid import Cell, Job, Run
from dva_sim.experiments.study.hashing import fingerprint, inputs, program_state, stable_hash
from dva_sim.experiments.study.robustness_grid import parameter_sets
from dva_sim.experiments.study.study import Study
from dva_sim.experiments.study.tuned_values import load_tuned
from dva_sim.kernel.errors import DvaSimError

_PACKAGES = ("duckdb", "lxml", "numpy", "pymunk", "scipy", "shapely", "simpy")


def manifest_of(study: Study, cells: Sequence[Cell], todo: Sequence[Job]) -> dict[str, Any]:
    """What was asked and run: nothing in it depends on when, where or how fast.

    Its `hash` is the identity of the results: a folder holds one study, of one program.
    """
    tuned = cell_grid.is_tuned(study)
    content: dict[str, Any] = {
        "question": study.question,
        "study": study.asked(),
        "status": study.status.model_dump(mode="json"),
        "scenarios": {
            part: cell_grid.base_scenario(study, part).model_dump(mode="json")
            for part in study.parts
        },
        "set": list(study.settings),
        "changes": dict(study.changes),
        "inputs": inputs(cell.scenario for cell in cells),
        "cells": [_cell_row(cell) for cell in cells],
        "parameter_sets": parameter_sets(study),
        "tuned": load_tuned(study).model_dump(mode="json") if tuned else None,
        "basis": cell_grid.basis_of_tuning(study).model_dump(mode="json") if tuned else None,
        "runs": len({job.key for job in todo}),
        "seeds": {
            "study": study.seed,
            "population": study.seed,
            "rule": "a run's seed depends on the study's seed, the part, the person and the "
            "trial, never on the cell: all cells share their luck, and repeats share it too",
        },
        "versions": _simulating(),
    }
    identity = stable_hash(content)
    content["versions"] = versions()
    return content | {"hash": identity, "usual": study.usual}


def versions() -> dict[str, str | bool | None]:
    """The program and what its numbers depend on.

    The commit is no part of the identity: the fingerprint tells whether anything that simulates
    has changed, so a study goes on when only a report or a text has. The commit is then that of
    the program which completed it.
    """
    return {**_simulating(), **program_state(), "python": platform.python_version()}


def _simulating() -> dict[str, str]:
    """What the numbers of a run depend on; a folder holds runs of one such state only."""
    packages = {name: version(name) for name in _PACKAGES}
    return {"dva-sim": __version__, "fingerprint": fingerprint()} | packages


def failures(todo: Sequence[Run], journal: Journal) -> list[dict[str, Any]]:
    """Failed runs in the order of the design."""
    failed = journal.failures()
    return [design_row(j) | {"error": failed[j.key]} for j in todo if j.key in failed]


def machine(todo: Sequence[Run], journal: Journal) -> dict[str, Any]:
    """What is different on every machine and at every time."""
    costs = journal.costs()
    spent: dict[str, list[float]] = defaultdict(list)
    for job in {job.key: job for job in todo}.values():
        if job.key in costs:
            spent[f"{job.part}/{job.index}"].append(costs[job.key])
    return {
        "platform": platform.platform(),
        "cpu_s": sum(costs.values()),
        "cpu_s_per_run": {cell: sum(c) / len(c) for cell, c in spent.items()},
    }


def write_json(path: Path, data: dict[str, Any]) -> None:
    """Whole or not at all, whatever happens meanwhile.

    Raises:
        DvaSimError: the disk is full or refuses to be written.
    """
    part = path.with_name(f".{path.name}.{os.getpid()}")
    text = json.dumps(data, indent=2, ensure_ascii=False) + "\n"
    try:
        part.write_text(text, encoding="utf-8", newline="\n")
        part.replace(path)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise DvaSimError(f"{path} cannot be written: {error.strerror}") from None


def _cell_row(cell: Cell) -> dict[str, Any]:
    levels = dict(cell.levels)
    return {"part": cell.part, "cell": cell.index, "config": cell.config, "levels": levels}
