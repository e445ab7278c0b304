"""Manifest of a results folder: request, runs and status.

Details that differ from machine to machine are in a separate file.
"""

from __future__ import annotations

import json
import platform
from collections import defaultdict
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

from dva_sim import __version__
from dva_sim.experiments.results.tables import design_row
from dva_sim.experiments.study.cell_grid import RunKey, StudyRun
from dva_sim.experiments.study.hashing import (
    fingerprint,
    fingerprint_of_judges,
    hashes_of,
    program_state,
    stable_hash,
)
from dva_sim.experiments.study.inputs import own_columns
from dva_sim.experiments.study.plan import StudyPlan
from dva_sim.experiments.study.study import Status
from dva_sim.kernel.errors import DvaSimError, RunTooLong
from dva_sim.kernel.whole_files import write_whole

_PACKAGES = ("duckdb", "lxml", "numpy", "pymunk", "scipy", "shapely", "simpy")


def manifest_of(plan: StudyPlan) -> dict[str, Any]:
    """Return the manifest of a plan, independent of time, place and speed.

    Its `hash` is the identity of the results: a folder holds one study, of one program.
    """
    study = plan.study
    cells = plan.cells
    content: dict[str, Any] = {
        "question": study.question,
        "study": study.asked(),
        "status": study.status.model_dump(mode="json"),
        "scenarios": {
            part: scenario.model_dump(mode="json") for part, scenario in plan.scenarios.items()
        },
        "set": list(study.settings),
        "changes": dict(study.changes),
        "inputs": hashes_of(plan.input_names),
        "cells": [
            {"part": c.part, "cell": c.cell, "config": c.config, "levels": c.levels} for c in cells
        ],
        "parameter_sets": list(plan.parameter_sets),
        "tuned": None if plan.tuned is None else plan.tuned.model_dump(mode="json"),
        "basis": None if plan.basis is None else plan.basis.model_dump(mode="json"),
        "runs": plan.runs,
        "seeds": {
            "study": study.seed,
            "population": study.seed,
            "rule": "a run's seed depends on the study's seed, the part, the person and the "
            "trial, never on the cell: all cells share their random numbers, and so do repeats",
        },
        "versions": _simulating(),
    }
    if columns := own_columns(plan.measures.values()):
        content["columns"] = columns
    identity = stable_hash(content)
    content["versions"] = versions()
    return content | {"hash": identity, "usual": study.usual}


def versions() -> dict[str, str | bool | None]:
    """Return the program and what its numbers depend on.

    The commit is no part of the identity: the fingerprint tells whether anything that simulates
    has changed, so a study goes on when only a report or a text has. The commit is then that of
    the program which completed it.
    """
    return {**_simulating(), **program_state(), "python": platform.python_version()}


def _simulating() -> dict[str, str]:
    """Return versions that the numbers of a run depend on.

    Each folder holds runs of one set only.
    """
    packages = {name: version(name) for name in _PACKAGES}
    return {"dva-sim": __version__, "fingerprint": fingerprint()} | packages


def failures(todo: Sequence[StudyRun], failed: Mapping[RunKey, str]) -> list[dict[str, Any]]:
    """Return the failed runs, with the reason, in the order of the design."""
    return [design_row(j) | {"error": failed[j.key]} for j in todo if j.key in failed]


def machine(todo: Sequence[StudyRun], costs: Mapping[RunKey, float]) -> dict[str, Any]:
    """Return details that differ between machines and times.

    Args:
        todo: The runs of the study.
        costs: Cost of each completed run [CPU s].
    """
    spent: dict[str, list[float]] = defaultdict(list)
    for job in {job.key: job for job in todo}.values():
        if job.key in costs:
            spent[f"{job.part}/{job.cell}"].append(costs[job.key])
    return {
        "platform": platform.platform(),
        "cpu_s": sum(costs.values()),
        "cpu_s_per_run": {cell: sum(c) / len(c) for cell, c in spent.items()},
    }


def write_json(path: Path, data: dict[str, Any]) -> None:
    """Write whole or not at all, whatever happens meanwhile.

    Raises:
        DvaSimError: the disk is full or refuses to be written.
    """
    try:
        write_whole(path, json.dumps(data, indent=2, ensure_ascii=False) + "\n")
    except OSError as error:
        raise DvaSimError(
            f"{path} cannot be written: {error.strerror}; mend that, then run the command again"
        ) from None


def status_of(manifest: Mapping[str, Any]) -> Status:
    """Return status of the results; judged from the settings if the manifest states none.

    A confirmation has all the runs that were registered. Runs that took too long are others on
    another machine. The current program computes the verdicts again whenever they are shown.
    """
    if "status" in manifest:
        status = Status.model_validate(manifest["status"])
        if "partial" in manifest:
            why = ("the study is not finished", *status.why)
            exploratory = {"kind": "exploratory", "why": why, "reproducible": False}
            status = status.model_copy(update=exploratory)
        return _judged_again(_without(manifest.get("failures", []), status))
    pairs = manifest.get("set", [])  # each a pair, or a list of its words
    changes = [text if isinstance(text, str) else "=".join(map(str, text)) for text in pairs]
    if not changes:
        return Status(kind="declared")
    return Status(kind="exploratory", why=(f"changed on the command line: {', '.join(changes)}",))


def _judged_again(status: Status) -> Status:
    """Return the status, with a word if another program judges than was registered."""
    meant = (status.registration or {}).get("judged_with")
    if not meant or meant == (now := fingerprint_of_judges()):
        return status
    remark = f"what judges its hypotheses has changed since it was registered ({meant}; now {now})"
    return status.model_copy(update={"why": (*status.why, remark)})


def _without(failed: Sequence[Mapping[str, Any]], status: Status) -> Status:
    """Return the status of results in which some runs are missing."""
    if not failed:
        return status
    confirmed = status.kind == "confirmatory"
    slow = sum(str(row["error"]).startswith(RunTooLong.__name__) for row in failed)
    why = []
    if confirmed:
        why.append(f"{len(failed)} of the registered runs failed")
    if slow:
        why.append(f"{slow} of the runs met their limit of time; on another machine others may")
    return status.model_copy(
        update={
            "kind": "exploratory" if confirmed else status.kind,
            "why": (*why, *status.why),
            "reproducible": status.reproducible and not slow,
        }
    )
