"""Made-up results of studies of every shape: nothing of it was simulated.

Figures are tried on them: lines along numbers and words, one configuration alone, one person, runs
that are missing, values that are all the same, and tables without a row.
"""

from __future__ import annotations

import itertools
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np

from dva_sim.experiments.results.results import MANIFEST, TABLES
from dva_sim.experiments.study.parts import Level
from dva_sim.simulation.models import MODELS

Rows = list[dict[str, Any]]

PART: Final = "drive"
HORIZON_S: Final = 240.0
_KINDS: Final = ("robot", "guard", "none")
_OUTCOMES: Final = ("confirmed", "confirmed", "refuted", "escalated", "expired", "open")


@dataclass(frozen=True)
class Shape:
    """Shape of a made-up study.

    Attributes:
        factors: Levels of what is varied.
        answer: The declared contrast, as a study's file has it; none where it is empty.
        model: Model of the runs.
        persons: Simulated persons.
        trials: Trials per person.
        missing: Share of the values that are not there.
        is_constant: True if all values of a column are equal.
        models: Factor of models of persons over which the study declares a map; none if empty.
    """

    factors: Mapping[str, tuple[Level, ...]] = field(default_factory=dict)
    answer: Mapping[str, Any] = field(default_factory=dict)
    model: str = "full"
    persons: int = 3
    trials: int = 2
    missing: float = 0.0
    is_constant: bool = False
    models: str = ""


def _contrast(
    factor: str, levels: tuple[str, str], *, measure: str, over: str = ""
) -> dict[str, Any]:
    found = {"part": PART, "measure": measure, "factor": factor, "contrast": [*levels]}
    return found | ({"over": over} if over else {})


_PATTERNS: Final = ("req-rep", "pub-sub", "latest-wins")
_DELAYS: Final = (0.0, 0.25, 1.0)
_GRID: Final[Mapping[str, tuple[Level, ...]]] = {
    "pattern": _PATTERNS,
    "link.delay_s": _DELAYS,
    "profile": ("default", "slow", "fast"),
}
_ALONG: Final = _contrast(
    "pattern", ("req-rep", "latest-wins"), measure="drive_time_s", over="link.delay_s"
)
_POLICIES: Final = ("random", "nearest_idle", "min_eta")
_LOADS: Final[Mapping[str, tuple[Level, ...]]] = {
    "dispatch.policy": _POLICIES,
    "intensity": (1.0, 2.0),
}
_CARRIERS: Final[Mapping[str, tuple[Level, ...]]] = {"transport": ("udp", "tcp"), "flows": (0, 8)}

SHAPES: Final[Mapping[str, Shape]] = {
    "lines along a delay, in three panels": Shape(_GRID, _ALONG),
    "a map over models of persons": Shape(_GRID, _ALONG, models="profile"),
    "two words": Shape(
        {"control": ("direct", "supervised")},
        _contrast("control", ("direct", "supervised"), measure="drive_time_s"),
    ),
    "one configuration": Shape(),
    "one person": Shape(_GRID, _ALONG, persons=1, trials=1),
    "half of the values missing": Shape(_GRID, _ALONG, missing=0.5),
    "all values the same": Shape(_GRID, _ALONG, is_constant=True),
    "no value at all": Shape(_GRID, _ALONG, missing=1.0),
    "shifts": Shape(
        _LOADS,
        _contrast(
            "dispatch.policy", ("random", "min_eta"), measure="response_mean_s", over="intensity"
        ),
        model="timed",
        trials=1,
    ),
    "transports": Shape(
        _CARRIERS,
        _contrast("transport", ("tcp", "udp"), measure="movement_time_s", over="flows"),
        model="transports",
    ),
}
"""Shapes by what is special about them."""


def make_up(folder: Path, shape: Shape, columns: Iterable[str] = ()) -> Path:
    """Write a results folder.

    Args:
        folder: Folder that does not exist yet.
        shape: Shape of the study.
        columns: Columns of the runs, besides all measures of the model.
    """
    rng = np.random.default_rng(7)
    names = dict.fromkeys([*MODELS[shape.model].measures(), *columns])
    runs = [row | _measured(names, shape, rng) for row in _designed(shape)]
    tables = {"runs": runs}
    if shape.model != "transports":
        tables["events"] = [row | event for row in _designed(shape) for event in _events(rng)]
    if shape.model == "full":
        tables["tracks"] = [row | step for row in _designed(shape) for step in _way(rng)]
    if shape.missing >= 1:
        tables |= {name: [] for name in tables if name != "runs"}
    (folder / TABLES).mkdir(parents=True)
    for name, rows in tables.items():
        if rows:
            _write(folder / TABLES / f"{name}.parquet", rows)
    facts = json.dumps(_manifest(shape, len(runs)), sort_keys=True)
    (folder / MANIFEST).write_text(facts, encoding="utf-8")
    return folder


def _manifest(shape: Shape, runs: int) -> dict[str, Any]:
    study = {
        "question": "What is drawn?",
        "seed": 1,
        "persons": shape.persons,
        "replications": shape.trials,
        "factors": {name: list(levels) for name, levels in shape.factors.items()},
        "parts": {PART: {"scenario": "made-up"}},
        "answer": dict(shape.answer) or None,
        "map": {"models": shape.models} if shape.models else None,
    }
    scenarios = {PART: {"model": shape.model, "horizon_s": HORIZON_S}}
    versions = {"dva-sim": "made up"}
    return {"study": study, "scenarios": scenarios, "versions": versions, "set": [], "runs": runs}


def _designed(shape: Shape) -> Rows:
    """The leading columns of every run."""
    cells = enumerate(itertools.product(*shape.factors.values()))
    who = list(itertools.product(range(shape.persons), range(shape.trials)))
    return [
        {"part": PART, "cell": cell, "config": str(cell), "is_reference": False}
        | dict(zip(shape.factors, levels, strict=True))
        | {"person": person, "trial": trial, "seed": 10 * person + trial}
        for cell, levels in cells
        for person, trial in who
    ]


_OF_CLASSES: Final = "plugin_failures", "policy_failed"  # nothing rests on runs with such


def _measured(names: Iterable[str], shape: Shape, rng: np.random.Generator) -> dict[str, float]:
    """A value for each measure, or nan."""
    values = {name: 0.5 if shape.is_constant else _value(name, rng) for name in names}
    values |= {name: 0.0 for name in values if name in _OF_CLASSES}
    return {
        name: value if rng.random() >= shape.missing else float("nan")
        for name, value in values.items()
    }


def _value(name: str, rng: np.random.Generator) -> float:
    """Shares lie between 0 and 1, all else is above zero."""
    if name in ("confirmed", "completed"):
        return float(rng.random() < 0.8)
    if name.endswith("_share") or name.startswith(("use_", "evenness_", "jain_")):
        return float(rng.uniform(0.1, 0.9))
    return float(HORIZON_S if name == "follow_s" else 1.0 + rng.gamma(2.0, 5.0))


def _events(rng: np.random.Generator) -> Rows:
    return [_event(number, rng) for number in (1, 2)]


def _event(number: int, rng: np.random.Generator) -> dict[str, Any]:
    outcome, kind = str(rng.choice(_OUTCOMES)), str(rng.choice(_KINDS))
    response = float(rng.uniform(10, 80)) if kind != "none" else float("nan")
    is_closed = outcome in ("confirmed", "refuted")
    closing = response + float(rng.uniform(1, 20)) if is_closed else float("nan")
    return {
        "event_id": number,
        "kind": "fire",
        "is_true": True,
        "outcome": outcome,
        "responder_kind": kind,
        "response_s": response,
        "confirmation_s": closing,
        "containment_s": float("nan"),
        "closing_s": closing,
        "watched_s": HORIZON_S,
    }


def _way(rng: np.random.Generator) -> Rows:
    steps = np.cumsum(rng.uniform(-1, 2, (8, 2)), axis=0)
    where = {"agent": "robot-1", "heading_rad": 0.0, "mode": "teleoperation"}
    return [
        {"t_s": 5.0 * second, "x_m": float(x), "y_m": float(y)} | where
        for second, (x, y) in enumerate(steps)
    ]


def _write(path: Path, rows: Rows) -> None:
    import duckdb

    columns = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    with duckdb.connect() as connection:
        connection.register("rows", columns)
        connection.sql("select * from rows").write_parquet(str(path))
