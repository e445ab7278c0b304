"""Many runs of the model, spread over processes."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, cast

from dva_sim.errors import RunsFailed
from dva_sim.experiments import places
from dva_sim.experiments.design import Job
from dva_sim.experiments.journal import Tables
from dva_sim.experiments.models import AnyScenario
from dva_sim.experiments.pool import run_all
from dva_sim.experiments.validation.network.predict import Depth, predict
from dva_sim.experiments.validation.network.samples import Row
from dva_sim.network.condition import Condition
from dva_sim.network.measures import Measures
from dva_sim.streams import derive_seed

CHUNK = 10  # runs of one job
KEPT = (
    *("n_sent", "n_applied", "n_distinct", "send_hz", "applied_hz", "skip_frac", "first_seq"),
    *("age_mean", "age_p50", "age_p95", "rtt_p50", "rtt_p95", "stale_p50", "stale_p95"),
    *("timeouts", "alerts", "t_hs_ms"),
)

Progress = Callable[[int], None]


@dataclass(frozen=True)
class Order:
    """Runs of one condition.

    Attributes:
        condition: What is set.
        runs: How many.
        depth: How deep they are played.
        without: Mechanisms that are left out.
    """

    condition: Condition
    runs: int
    depth: Depth = "auto"
    without: tuple[str, ...] = ()


def play_all(
    orders: Sequence[Order], seed: int, workers: int, progress: Progress = lambda done: None
) -> dict[Order, list[Row]]:
    """The results of every run of some orders.

    Run n of a condition has the same luck at every depth and whatever is left out.

    Args:
        orders: What to play.
        seed: Of all luck.
        workers: Processes.
        progress: Told how many runs are finished.

    Raises:
        RunsFailed: a run failed.
    """
    jobs = [job for order in orders for job in _jobs(order, seed)]
    # The longest first, so that the processes finish together.
    jobs.sort(key=lambda job: -_effort(job))
    rows: dict[tuple[str, int], list[Row]] = {}
    done = 0
    for batch in run_all(jobs, perform, places.local(workers)):
        for outcome in batch:
            if outcome.error is not None:
                raise RunsFailed(f"{outcome.key[0]} could not be played: {outcome.error}")
            rows[outcome.key] = json.loads(outcome.tables or "")["rows"]
            done += len(rows[outcome.key])
        progress(done)
    return {order: _joined(order, seed, rows) for order in orders}


def perform(job: Job) -> Tables:
    """The runs of one job."""
    row, depth, without, first, count = _asked(job)
    condition = Condition.from_row(row)
    seeds = [
        derive_seed("network", condition.hash, job.seed, run) for run in range(first, first + count)
    ]
    return {"rows": [_kept(predict(condition, seed, depth, without)) for seed in seeds]}


def _kept(row: Measures) -> dict[str, Any]:
    return {name: row[name] for name in KEPT}


def _jobs(order: Order, seed: int) -> list[Job]:
    jobs = []
    for first in range(0, order.runs, CHUNK):
        count = min(CHUNK, order.runs - first)
        asked = order.condition.to_row(), order.depth, order.without, first, count
        cell = (("order", json.dumps(asked)),)
        name, nobody = _name(order, first), cast(AnyScenario, None)
        jobs.append(Job("network", cell, 0, 0, 0, seed, name, nobody))
    return jobs


def _asked(job: Job) -> tuple[dict[str, str], Depth, tuple[str, ...], int, int]:
    row, depth, without, first, count = json.loads(str(dict(job.cell)["order"]))
    return row, depth, tuple(without), first, count


def _name(order: Order, first: int) -> str:
    left_out = f" without {', '.join(order.without)}" if order.without else ""
    condition = f"{order.condition.label} ({order.condition.hash})"
    return f"{condition} {order.depth}{left_out}, runs from {first}"


def _effort(job: Job) -> float:
    """Commands to be played, about."""
    row, _, _, _, count = _asked(job)
    return count * float(row["hz"]) * float(row["dur_s"])


def _joined(order: Order, seed: int, rows: Mapping[tuple[str, int], list[Row]]) -> list[Row]:
    return [row for first in range(0, order.runs, CHUNK) for row in rows[_name(order, first), seed]]
