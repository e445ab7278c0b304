"""The whole comparison: the runs of the model that it needs, and their results."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

from dva_sim.experiments.study.cell_grid import StudyJob
from dva_sim.kernel.streams import Streams, derive_seed
from dva_sim.network.pattern_runs import RESULTS, Condition
from dva_sim.simulation.models import Tables
from dva_sim.validation.frame import Progress, make_job, play_jobs
from dva_sim.validation.network.pooling import (
    Pooled,
    is_steady,
    pool,
    pool_variant,
    tells,
    to_be_pooled,
)
from dva_sim.validation.network.prediction import WITHOUT, Depth, depth_for, predict
from dva_sim.validation.network.reference import NUMBERS
from dva_sim.validation.network.verdicts import (
    CellVerdict,
    ComparedCell,
    ConditionGroup,
    ConditionKind,
    Row,
    compare_cells,
    judge,
)

CHUNK = 10  # number of runs in a job
KEPT = tuple(name for name in NUMBERS if name in RESULTS)


@dataclass(frozen=True)
class ModelRuns:
    """Runs of one condition.

    Attributes:
        runs: Number of runs.
        depth: Depth of the simulation.
        without: Mechanisms that are left out.
    """

    condition: Condition
    runs: int
    depth: Depth = "auto"
    without: tuple[str, ...] = ()


def play_all(
    orders: Sequence[ModelRuns], seed: int, workers: int, progress: Progress = lambda done: None
) -> dict[ModelRuns, list[Row]]:
    """Return the results of every run of some orders.

    Run n of a condition has the same random numbers at every depth and with every ablation.

    Args:
        seed: Random seed.
        workers: Processes.
        progress: Callback with the number of finished runs.

    Raises:
        RunsFailed: a run failed.
    """
    jobs = [job for order in orders for job in _jobs(order, seed)]
    # The longest first, so that the processes finish together.
    jobs.sort(key=lambda job: -_effort(job))
    rows = play_jobs(jobs, perform, workers, "{} could not be played", progress, len)
    return {order: [row for job in _jobs(order, seed) for row in rows[job.key]] for order in orders}


def perform(job: StudyJob) -> Tables:
    """Return the runs of one job."""
    row, depth, without, first, count = _asked(job)
    condition = Condition.from_row(row)
    seeds = [
        derive_seed("network", condition.hash, job.seed, run) for run in range(first, first + count)
    ]
    rows = (predict(condition, seed, depth, without) for seed in seeds)
    return {"rows": [{name: row[name] for name in KEPT} for row in rows]}


def _jobs(order: ModelRuns, seed: int) -> list[StudyJob]:
    left_out = f" without {', '.join(order.without)}" if order.without else ""
    text = f"{order.condition.label} ({order.condition.hash}) {order.depth}{left_out}"
    jobs = []
    for first in range(0, order.runs, CHUNK):
        count = min(CHUNK, order.runs - first)
        request = order.condition.to_row(), order.depth, order.without, first, count
        jobs.append(make_job(f"{text}, runs from {first}", seed, None, order=json.dumps(request)))
    return jobs


def _asked(job: StudyJob) -> tuple[dict[str, str], Depth, tuple[str, ...], int, int]:
    row, depth, without, first, count = json.loads(str(job.levels["order"]))
    return row, depth, tuple(without), first, count


def _effort(job: StudyJob) -> float:
    """Return commands to be played, about."""
    row, _, _, _, count = _asked(job)
    return count * float(row["hz"]) * float(row["dur_s"])


RUNS = 200  # number of runs of a condition under loss
QUICK_RUNS = 40  # the same in a quick validation
CONTROL_RUNS = 50
QUICK_CONTROL_RUNS = 20
JITTER_RUNS = 20  # number of runs of a condition with random delays and no loss
MODEL = "the model"
CONTROLS: dict[str, Depth] = {
    "message by message": "message",
    "datagrams": "datagram",
}
"""Models that are too simple, and must be rejected."""

Rows = dict[ModelRuns, list[Row]]

WANTED = 150  # conditions that should be judged
WANTED_POOLED = 40  # pooled conditions that should be judged


@dataclass(frozen=True)
class NetworkSetting:
    """Scope of a comparison: number of runs.

    Attributes:
        seed: Random seed.
        quick: Few runs.
        workers: Processes.
        ablate: True to leave out mechanisms one by one.
    """

    seed: int = 1
    quick: bool = False
    workers: int = 1
    ablate: bool = False

    def runs(self, group: ConditionGroup) -> int:
        """Return the number of model runs of a condition: one if nothing is random."""
        condition = group.condition
        if condition.loss > 0:
            return QUICK_RUNS if self.quick else RUNS
        return JITTER_RUNS if condition.jitter_frac > 0 else 1

    @property
    def control_runs(self) -> int:
        """Number of runs of each control variant, for pooled conditions only."""
        return QUICK_CONTROL_RUNS if self.quick else CONTROL_RUNS


@dataclass(frozen=True)
class NetworkComparison:
    """Result of a comparison.

    Attributes:
        groups: The conditions that were judged, with their measurements.
        left_out: Those that were not played, and why.
        verdicts: Bands and prediction intervals, cell by cell; of pooled conditions those
            measures in which runs hardly differ.
        pooled: Means over many runs under loss, by the model as it is.
        rarely: Measures of pooled conditions that tell too little.
        controls: Results of oversimplified models, by name.
        ablated: Results without one mechanism, by its name.
    """

    groups: Sequence[ConditionGroup]
    left_out: Sequence[ConditionGroup]
    verdicts: Sequence[CellVerdict]
    pooled: Pooled
    rarely: Sequence[ComparedCell]
    controls: dict[str, Pooled] = field(default_factory=dict)
    ablated: dict[str, Pooled] = field(default_factory=dict)

    def of_kind(self, kind: ConditionKind) -> list[CellVerdict]:
        """Return the verdicts on conditions of a kind."""
        return [v for v in self.verdicts if v.cell.group.kind == kind]

    @property
    def outside(self) -> set[int]:
        """The ids of those that lie outside, or are significantly off."""
        outside = [v.cell for v in self.verdicts if v.word == "outside"]
        return {id(c) for c in [*outside, *(scored.cell for scored in self.pooled.significant)]}

    @property
    def variants(self) -> dict[str, Pooled]:
        """The full model, the oversimplified ones, and those without a mechanism."""
        return {"nothing": self.pooled, **self.controls, **self.ablated}

    @property
    def missing(self) -> tuple[int, int]:
        """Number of conditions, and of pooled ones, still needed."""
        judged = self.judged
        pooled = sum(group.kind == "pooled" for group in judged)
        return max(0, WANTED - len(judged)), max(0, WANTED_POOLED - pooled)

    @property
    def judged(self) -> list[ConditionGroup]:
        """The conditions of which at least one measure is judged."""
        conditions = {v.cell.group.condition for v in self.verdicts if not v.why}
        conditions |= {scored.cell.group.condition for scored in self.pooled.scored}
        return [group for group in self.groups if group.condition in conditions]


def compare(
    groups: Sequence[ConditionGroup],
    setting: NetworkSetting,
    progress: Progress = lambda done: None,
) -> NetworkComparison:
    """Play every condition that may be judged, and judge it.

    Raises:
        DvaSimError: a run failed.
    """
    played = [group for group in groups if not group.left_out]
    orders = make_orders(played, setting)
    rows = play_all(
        [o for each in orders.values() for o in each], setting.seed, setting.workers, progress
    )
    cells = _cells(played, orders.pop(MODEL), rows)
    own = [c for c in cells if c.group.kind == "pooled"]
    pooled = pool(to_be_pooled(own), Streams(setting.seed).fresh("null"))
    comparisons = {
        name: pool_variant(pooled, _cells(find_pooled(played), variant, rows))
        for name, variant in orders.items()
    }
    return NetworkComparison(
        groups=played,
        left_out=[group for group in groups if group.left_out],
        verdicts=[judge(c) for c in cells if c.group.kind != "pooled" or is_steady(c)],
        pooled=pooled,
        rarely=[c for c in own if not tells(c)],
        controls={name: each for name, each in comparisons.items() if name in CONTROLS},
        ablated={name: each for name, each in comparisons.items() if name in WITHOUT},
    )


def make_orders(
    groups: Sequence[ConditionGroup], setting: NetworkSetting
) -> dict[str, list[ModelRuns]]:
    """Model runs to make: full model, oversimplified controls, and ablations."""
    pooled = find_pooled(groups)
    runs = setting.control_runs
    orders = {MODEL: [ModelRuns(g.condition, setting.runs(g)) for g in groups]}
    for name, depth in CONTROLS.items() if pooled else ():
        orders[name] = [ModelRuns(g.condition, runs, depth) for g in pooled]
    for name in WITHOUT if pooled and setting.ablate else ():
        orders[name] = [ModelRuns(g.condition, runs, without=(name,)) for g in pooled]
    return orders


def find_pooled(groups: Sequence[ConditionGroup]) -> list[ConditionGroup]:
    """Return the conditions that are pooled."""
    return [group for group in groups if group.kind == "pooled"]


def runs_in(groups: Sequence[ConditionGroup], setting: NetworkSetting) -> int:
    """Return the number of runs in a comparison."""
    played = [group for group in groups if not group.left_out]
    return sum(order.runs for own in make_orders(played, setting).values() for order in own)


def count_depths(comparison: NetworkComparison) -> dict[str, int]:
    """Return the number of conditions simulated at each depth."""
    return Counter(depth_for(group.condition) for group in comparison.groups)


def _cells(
    groups: Sequence[ConditionGroup], orders: Sequence[ModelRuns], rows: Rows
) -> list[ComparedCell]:
    return [
        c
        for group, own in zip(groups, orders, strict=True)
        for c in compare_cells(group, rows[own])
    ]
