"""Preview of a study: number of runs, runs already done, and time the rest takes."""

from __future__ import annotations

import math
import re
import time
from collections import defaultdict
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from dva_sim.experiments.execution import executors
from dva_sim.experiments.execution.checkpoint import Checkpoint, NotBegun
from dva_sim.experiments.execution.scheduling import Simulate, clock_of, limited
from dva_sim.experiments.results.manifest import manifest_of
from dva_sim.experiments.results.results import JOURNAL
from dva_sim.experiments.study.cell_grid import DesignCell, RunKey, StudyJob
from dva_sim.experiments.study.plan import StudyPlan
from dva_sim.experiments.study.study import Study
from dva_sim.kernel.errors import RunTooLong
from dva_sim.simulation.models import model_for

PROBE_S = 5.0  # after so long no further run is tried,
_MIN_TRIALS = 3  # unless there are fewer than that, since one may be far from the others
MAX_TRIAL_S = 60.0  # for all of them: a run that is ended then costs that much at least
_SHORT_S = 1.0  # the first run reads files too; if it is as short as this it is tried again


@dataclass(frozen=True)
class DryRun:
    """Preview of a study's runs and costs.

    Attributes:
        runs: Different runs in all.
        done: Number of runs that the results folder already holds.
        cells: Configurations, with the reference runs' own.
        rounds: After how many batches it may stop; 1 if nothing can stop it early.
        workers: Processes that the estimate is for.
        estimate_s: Time for the rest by the clock [s], if any run tells its cost. Trial runs are
            timed by both clocks, so it holds for a machine that is as busy as it was then.
        tried: Runs that were tried for the estimate and thrown away; 0 if it rests on runs kept.
        remark: Doubt about tuned values; empty if there is none.
        is_least: True if it will take longer, since a trial run did not end in time.
        failed: Error of a trial run; empty if it did not fail.
        cpu_s: CPU time for the rest, of all processes together [s].
    """

    runs: int
    done: int
    cells: int
    rounds: int
    workers: int
    estimate_s: float | None
    tried: int
    remark: str
    is_least: bool = False
    failed: str = ""
    cpu_s: float = 0.0


class _Tried(NamedTuple):
    """Costs of trial runs [CPU s], the time they took [s], and their warnings; see `DryRun`."""

    costs: dict[str, float]
    wall_s: float = 0.0
    is_least: bool = False
    failed: str = ""


def dry_run(
    study: Study | StudyPlan,
    out: str | Path,
    *,
    jobs: int | None = None,
    probe: Simulate | None = None,
) -> DryRun:
    """Return what running a study would do, without doing it.

    Args:
        study: From `load_study`, or its plan if that has been made.
        out: Results folder.
        jobs: Processes; by default one for each core.
        probe: Function that makes the tables of one run. With it, a few runs are tried for the
            estimate if none is done yet.

    Raises:
        ConfigError: the study is not valid, or the folder holds another one.
    """
    plan = StudyPlan.of(study)
    todo = list({job.key: job for job in plan.jobs}.values())
    costs = dict[RunKey, float]()
    wall = 0.0
    if (Path(out) / JOURNAL).exists():
        identity = manifest_of(plan)["hash"]
        with suppress(NotBegun), Checkpoint(Path(out), identity, must_exist=True) as checkpoint:
            costs = checkpoint.costs()
            wall = checkpoint.wall_s
    left = [job for job in todo if job.key not in costs]
    cost_by_config = _by_config(costs)
    tried = _tried(left, probe) if probe is not None and not cost_by_config else _Tried({})
    cpu = _estimate(left, cost_by_config or tried.costs)
    workers = 1 if plan.is_real_time else executors.local(jobs).width
    # By the clock, for each CPU second: as it was so far, else as it was for one run at a time.
    if cost_by_config and wall:
        pace = wall / sum(costs.values())
    else:
        busy = tried.wall_s / sum(tried.costs.values()) if tried.costs else 1.0
        pace = busy / min(workers, executors.cores(), len(left) or 1)
    return DryRun(
        runs=len(todo),
        done=len(todo) - len(left),
        cells=len(plan.cells),
        rounds=len(plan.rounds),
        workers=workers,
        estimate_s=None if cpu is None else cpu * pace,
        tried=len(tried.costs),
        remark="" if plan.tuned is None or plan.basis is None else plan.tuned.remark(plan.basis),
        is_least=tried.is_least,
        failed=tried.failed,
        cpu_s=cpu or 0.0,
    )


def _by_config(costs: Mapping[RunKey, float]) -> dict[str, float]:
    """Mean cost of a run of each configuration [s]."""
    spent: dict[str, list[float]] = defaultdict(list)
    for (config, _), cost in costs.items():
        spent[config].append(cost)
    return {config: sum(values) / len(values) for config, values in spent.items()}


def _estimate(left: Sequence[StudyJob], cost_by_config: Mapping[str, float]) -> float | None:
    """Estimate the cost of the rest [CPU s], new configurations at the mean of the others."""
    if not cost_by_config and left:
        return None
    average = sum(cost_by_config.values()) / max(1, len(cost_by_config))
    return sum(cost_by_config.get(job.config, average) for job in left)


def _tried(left: Sequence[StudyJob], probe: Simulate) -> _Tried:
    """Try one run each of some configurations, spread over the design.

    Each is of another person: runs of one person cost alike, and plan their ways but once.
    """
    by_config: dict[str, list[StudyJob]] = defaultdict(list)
    for job in left:
        by_config[job.config].append(job)
    groups = list(by_config.values())
    costs = dict[str, float]()
    walls = dict[str, float]()
    failed = ""
    begun = time.monotonic()
    for index in [0, *_spread(len(groups))] if groups else ():
        group = groups[index]
        job = group[len(costs) % len(group)]
        gone = time.monotonic() - begun
        if costs.get(job.config, 0.0) > _SHORT_S:
            continue
        if gone > PROBE_S and len(costs) >= _MIN_TRIALS:
            break
        clock = clock_of(job)
        start = clock()
        start_wall = time.monotonic()
        is_least = False
        try:
            with limited(max(MAX_TRIAL_S - gone, _SHORT_S), may_exit=False):
                probe(job)
        except RunTooLong:
            is_least = True
        except Exception as error:
            failed = failed or f"{type(error).__name__}: {' '.join(str(error).split())}"
            continue
        costs[job.config] = clock() - start
        walls[job.config] = time.monotonic() - start_wall
        if is_least:
            return _Tried(costs, sum(walls.values()), True, failed)
    return _Tried(costs, sum(walls.values()), False, failed)


def _spread(count: int) -> list[int]:
    """Return all indices, so ordered that any beginning is spread over the whole range."""
    step = next(
        s for s in range(max(1, round(count * 0.618)), count + 2) if math.gcd(s, count) == 1
    )
    return [i * step % count for i in range(count)]


def contradictions_in(cells: Sequence[DesignCell]) -> list[str]:
    """List contradictory settings, one sentence for each kind.

    Two are of one kind if they begin with the same words, up to the first number.
    """
    kinds: dict[str, list[str]] = defaultdict(list)
    for cell in cells:
        for entry in model_for(cell.scenario).contradictions(cell.scenario):
            kinds[re.split(r"\d", entry, maxsplit=1)[0]].append(entry)
    return [
        f"{alike[0]} (in {len(alike)} of {len(cells)} configurations)" for alike in kinds.values()
    ]
