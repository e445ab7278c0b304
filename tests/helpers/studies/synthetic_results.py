"""A results folder of SYNTHETIC numbers: shaped like a study's, but nothing was simulated.

It exists to test figures and reports. Request/reply is made slower as delay grows, by an
effect the caller knows, so that tests can say what a report must find.
"""

import itertools
import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from helpers.studies.small_study import SHIFT

from dva_sim.experiments.analysis.answer import Finding
from dva_sim.experiments.report.summary import Reading
from dva_sim.experiments.results.results import Results

PATTERNS = ["req-rep", "pub-sub", "latest-wins"]
DELAYS = [0.0, 0.05, 0.1, 0.25, 0.5, 1.0]
PROFILES = ["default", "dissertation"]
HORIZON_S = 300.0
PROCESSING_S = 0.05
WANTED_PERIOD_S = {"default": 0.1, "dissertation": 0.5}
FACTORS = {"pattern": PATTERNS, "link.delay_s": DELAYS, "profile": PROFILES}
SCENARIO = {
    "site": {"name": "caparica", "map": None},
    "robot": {"count": 1, "processing_s": PROCESSING_S, "watchdog_s": 3.0, "max_age_s": 6.0},
    "command": {"rate_hz": 10.0, "timeout_s": 9.0, "attempts": 3},
    "link": {"delay_s": 0.0, "jitter_s": 0.0, "loss": 0.0, "rate_bps": 2e7},
    "camera": {"rate_hz": 10.0, "frame_bytes": 12000},
    "horizon_s": HORIZON_S,
}
CLAIMS = {
    "predictions": [
        {"text": "Waiting costs.", "direction": "above", "expects_s": [20.0, 40.0]},
        {"text": "Nobody will notice."},
    ],
    "robustness": {"strategies": ["pursuit", "adaptive"], "sets": 1, "at": None},
}
TUNED = {
    "study": "synthetic",
    "made_with": "nothing",
    "basis": {"persons": "others", "phones": "these"},
    "tuning": {
        "key": "phone.mapping_options.gain",
        "levels": [0.5, 1.0],
        "by": ["phone.mapping"],
        "part": "drive",
        "measure": "drive_time_s",
        "seed": 2,
    },
    "chosen": [{"when": {"phone.mapping": "absolute"}, "value": 1.0}],
    "seen": [
        {"when": {"phone.mapping": "absolute"}, "value": value, "mean": mean}
        | {"low": mean - 10, "high": mean + 10}
        for value, mean in ((0.5, 50.0), (1.0, 48.0))
    ],
}
Rows = list[dict[str, Any]]
_CELLS = {cell: i for i, cell in enumerate(itertools.product(PATTERNS, DELAYS, PROFILES))}


def manifest(persons: int, trials: int, **changes: Any) -> dict[str, Any]:
    """Manifest that a runner would write beside the tables."""
    study = {
        "question": "REQ/REP or PUB/SUB for driving a robot by tilt, as delay grows?",
        "seed": 1,
        "persons": persons,
        "replications": trials,
        "factors": dict(FACTORS),
        "parts": {"drive": {"scenario": "drive-to-event"}, "story": {"scenario": "fire-drill"}},
        "answer": {
            "part": "drive",
            "measure": "drive_time_s",
            "factor": "pattern",
            "contrast": ["req-rep", "latest-wins"],
            "over": "link.delay_s",
            "within": {"profile": "default"},
            "smallest_effect_s": 2.0,
        },
    }
    whole = {
        "question": study["question"],
        "study": study,
        "scenarios": {"drive": SCENARIO, "story": SCENARIO},
        "set": [],
        "versions": {"dva-sim": "synthetic"},
    }
    return whole | changes


def drive_rows(persons: int, trials: int, effect_s: float = 12.0, missed: float = 0.1) -> Rows:
    """Runs of the part `drive`; request/reply costs `effect_s` more at a delay of 1 s.

    Args:
        persons: Simulated persons.
        trials: Trials per person.
        effect_s: Extra time of request/reply at 1 s, growing with the delay squared.
        missed: Share of request/reply runs not confirmed at 1 s.
    """
    rng = np.random.default_rng(1)
    rows: Rows = []
    for person, trial in itertools.product(range(persons), range(trials)):
        skill, way = rng.lognormal(0, 0.25), rng.uniform(35, 55)
        base = {"part": "drive", "person": person, "trial": trial, "seed": 1000 * person + trial}
        rows.append(
            base
            | _treatment("latest-wins", 0.0, "ideal")
            | _run(way, True)
            | {"is_reference": True}
        )
        for pattern, delay, profile in itertools.product(PATTERNS, DELAYS, PROFILES):
            slower = effect_s * delay**2 * (pattern == "req-rep") + 1.5 * delay * (
                pattern == "pub-sub"
            )
            own = skill * (4 + 25 * delay + 6 * (profile == "dissertation"))
            time = way + own + slower + rng.gamma(2.0, 0.8)
            confirmed = not (pattern == "req-rep" and delay == 1.0 and rng.random() < missed)
            run = _run(time if confirmed else HORIZON_S, confirmed)
            run |= _commands(pattern, delay, profile, rng)
            rows.append(base | _treatment(pattern, delay, profile) | run | {"is_reference": False})
    return rows


def story_rows(persons: int) -> Rows:
    """Events of the part `story`: two for each person and cell."""
    rng = np.random.default_rng(2)
    rows: Rows = []
    for person, event in itertools.product(range(persons), range(2)):
        for pattern, delay, profile in itertools.product(PATTERNS, DELAYS, PROFILES):
            kind = "robot" if rng.random() < 0.6 else "guard"
            late = rng.random() < 0.05 + 0.2 * delay * (kind == "robot")
            response = 20 + 30 * rng.random() + (25 * delay if kind == "robot" else 5)
            rows.append(
                {"part": "story", "person": person, "trial": 0, "seed": person}
                | _treatment(pattern, delay, profile)
                | {
                    "is_reference": False,
                    "event_id": event + 1,
                    "kind": ("fire", "gas_leak")[event],
                    "responder_kind": "none" if late else kind,
                    "outcome": ("escalated", "undetected")[event] if late else "confirmed",
                    "response_s": np.nan if late else response,
                    "confirmation_s": np.nan if late else response + 4 * rng.random(),
                }
            )
    return rows


def track_rows() -> Rows:
    """One way per cell of person 0, and that of the reference: round two corners."""
    rng = np.random.default_rng(3)
    corners = np.array([[12.0, 7.4], [12.0, 12.0], [27.5, 12.0], [27.5, 17.0]])
    rows: Rows = []
    cells = [("latest-wins", 0.0, "ideal", True)]
    cells += [(*cell, False) for cell in itertools.product(PATTERNS, DELAYS, PROFILES)]
    for pattern, delay, profile, is_reference in cells:
        spread = 0.0 if is_reference else 0.1 + 0.8 * delay
        sway = np.cumsum(rng.normal(0, 0.15, (61, 2)), axis=0) * spread
        way = np.column_stack(
            [np.interp(np.linspace(0, 3, 61), range(4), axis) for axis in corners.T]
        )
        for second, (x, y) in enumerate(way + sway):
            rows.append(
                {"part": "drive", "person": 0, "trial": 0, "seed": 0}
                | _treatment(pattern, delay, profile)
                | {"is_reference": is_reference, "agent": "robot-1", "t_s": float(second)}
                | {"x_m": float(x), "y_m": float(y), "heading_rad": 0.0, "mode": "teleoperation"}
            )
    return rows


def repeat_rows(effects: dict[tuple[str, int], float]) -> Rows:
    """Repeats at 1 s whose effect is known: of 4 persons with 2 trials each.

    Args:
        effects: Extra time of request/reply, by strategy and set of parameters.
    """
    rng = np.random.default_rng(4)
    who = list(itertools.product(range(4), range(2)))
    ways = {key: rng.uniform(40, 60) for key in who}
    return [
        {"part": "robustness", "operator.strategy": strategy, "parameters": number}
        | {"pattern": pattern, "link.delay_s": 1.0, "is_reference": False}
        | {"person": person, "trial": trial, "seed": 10 * person + trial}
        | {"drive_time_s": ways[person, trial] + (pattern == "req-rep") * (effect + 0.1 * person)}
        for (strategy, number), effect in effects.items()
        for pattern in ("req-rep", "latest-wins")
        for person, trial in who
    ]


def columns(rows: Rows) -> dict[str, Any]:
    """Rows as columns; what a row does not say is nan."""
    keys = dict.fromkeys(key for row in rows for key in row)
    return {key: np.array([row.get(key, np.nan) for row in rows]) for key in keys}


def finding(mean: Sequence[float], half_width: Any = 1.0, **changes: Any) -> Finding:
    """A finding whose band is `half_width` [s] wide on either side."""
    middle = np.array(mean, dtype=float)
    whole = Finding(
        measure="drive_time_s",
        in_excess=True,
        factor="pattern",
        first="req-rep",
        second="latest-wins",
        over="link.delay_s",
        levels=DELAYS,
        within={"profile": "default"},
        mean=middle,
        low=middle - half_width,
        high=middle + half_width,
        persons=24,
        smallest_effect=2.0,
    )
    return replace(whole, **changes)


def write(folder: Path, tables: dict[str, Rows], facts: dict[str, Any]) -> Path:
    """Write tables and manifest as a results folder."""
    import duckdb

    (folder / "tables").mkdir(parents=True)
    for name, rows in tables.items():
        with duckdb.connect() as connection:
            connection.register("rows", columns(rows))
            path = folder / "tables" / f"{name}.parquet"
            connection.sql("select * from rows").write_parquet(str(path))
    (folder / "manifest.json").write_text(json.dumps(facts), encoding="utf-8")
    return folder


def reading(folder: Path, rows: Rows, facts: dict[str, Any], **tables: Rows) -> Reading:
    """Reading of these runs."""
    return Reading(Results.load(write(folder, {"runs": rows, **tables}, facts)))


def write_shifts(folder: Path, shifts: int) -> Path:
    """Results of hour-long shifts, which ARE simulated: three policies at two loads."""
    from dva_sim.simulation.measures.shifts import tables as shift_tables
    from dva_sim.simulation.timed import build, simulate_timed

    tables: dict[str, Rows] = {"runs": [], "events": []}
    policies, rates = ["random", "nearest_idle", "min_eta"], [1, 3]
    for policy, rate, shift in itertools.product(policies, rates, range(shifts)):
        changes = {"dispatch.policy": policy, "intensity": rate}
        made = shift_tables(simulate_timed(build(SHIFT, changes), shift))
        design = {"part": "shift", "person": shift, "trial": 0, "seed": shift, "cell": 0}
        for name, rows in tables.items():
            rows += [design | changes | {"is_reference": False} | row for row in made[name]]
    answer = {"part": "shift", "measure": "response_mean_s", "factor": "dispatch.policy"}
    answer |= {"contrast": ["random", "min_eta"], "over": "intensity", "smallest_effect_s": 5.0}
    factors = {"dispatch.policy": policies, "intensity": rates}
    study = {"question": "Who should go?", "persons": shifts, "replications": 1}
    study |= {"factors": factors, "answer": answer, "parts": {"shift": {"scenario": "busy-shift"}}}
    scenarios = {"shift": build(SHIFT).model_dump(mode="json")}
    return write(folder, tables, {"study": study, "scenarios": scenarios, "set": []})


def _treatment(pattern: str, delay: float, profile: str) -> dict[str, Any]:
    cell = _CELLS.get((pattern, delay, profile), -1)
    return {"cell": cell, "pattern": pattern, "link.delay_s": delay, "profile": profile}


def _run(time: float, confirmed: bool) -> dict[str, Any]:
    return {
        "confirmed": confirmed,
        "outcome": "confirmed" if confirmed else "timeout",
        "drive_time_s": time,
        "violations": 0,
    }


def _commands(pattern: str, delay: float, profile: str, rng: np.random.Generator) -> dict[str, Any]:
    period, lock_step = WANTED_PERIOD_S[profile], 2 * delay + PROCESSING_S
    if pattern == "req-rep":
        period = max(period, lock_step)
    age = delay + PROCESSING_S + 0.02 * (pattern == "pub-sub")
    ages = {
        f"command_age_{q}_s": age * factor * rng.uniform(0.97, 1.03)
        for q, factor in {"p05": 0.9, "p25": 0.95, "p50": 1, "p75": 1.2, "p95": 1.6}.items()
    }
    stages = {
        "delay_human_s": 0.2,
        "delay_hand_s": 0.15,
        "delay_filter_s": 0.07 if profile == "default" else 0.45,
        "delay_sampling_s": period / 2,
        "delay_uplink_s": delay,
        "delay_processing_s": PROCESSING_S,
        "delay_downlink_s": delay + 0.005,
        "delay_frame_s": 0.05,
    }
    return (
        {"command_rate_hz": 0.97 / period, "stop_share": 0.05 * delay, "contacts": 0}
        | ages
        | stages
        | {"loop_delay_mean_s": sum(stages.values()), "command_age_mean_s": age}
        | {"loop_delay_measured_s": sum(stages.values()) + 0.01}
    )
