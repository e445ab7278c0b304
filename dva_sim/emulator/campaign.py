"""Many conditions measured, several times each: it can be stopped, killed and taken up again."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from dva_sim.emulator.cell import PACKETS, Job
from dva_sim.emulator.machine import describe_machine
from dva_sim.emulator.measure import COLUMNS, Row, measure
from dva_sim.emulator.running import EmulatorError, run_job
from dva_sim.emulator.table import Table
from dva_sim.network.condition import Condition

_IDENTITY = ("cell", "group", "seed", "cond_id")
_OVERHEAD_S = 1.5  # processes, handshake and waiting, about
_MOST_FAILURES = 3  # in a row


@dataclass(frozen=True)
class Progress:
    """How far a campaign is.

    Attributes:
        done: Rows that are there.
        total: Rows that are wanted.
        left_s: About the time it still takes [s].
        cell: What was measured last; empty at the beginning.
        problem: Why it could not be measured; empty if it could.
    """

    done: int
    total: int
    left_s: float
    cell: str = ""
    problem: str = ""


def measure_all(
    conditions: Sequence[Condition],
    seeds: Sequence[int],
    path: Path,
    tell: Callable[[Progress], object] = lambda progress: None,
    group: str = "own",
    link: str = PACKETS,
) -> list[str]:
    """Measure every condition with every seed that the table does not hold yet.

    All conditions come once before any comes twice, so that a table cut short is a fair one.

    Args:
        conditions: What to measure.
        seeds: A run for each; the luck of a run is that of its condition and seed together.
        path: CSV file of the results.
        tell: Told after every run, and at the beginning.
        group: Name for the column `group`.
        link: `packets` or `proxy`.

    Returns:
        What could not be measured, a line each.

    Raises:
        ConfigError: the file cannot be written, or holds something else.
        EmulatorError: the link cannot be set up, or fails again and again.
    """
    machine = _look_at_machine(link)
    wanted = [(condition, seed) for seed in seeds for condition in conditions]
    with Table(path, (*_IDENTITY, *COLUMNS)) as table:
        table.sign(machine)
        known = {(row["cond_id"], row["seed"]) for row in table.rows}
        left = [(c, s) for c, s in wanted if (c.hash, str(s)) not in known]
        return _measure_left(left, len(wanted), table, tell, group, link)


def _measure_left(
    left: Sequence[tuple[Condition, int]],
    total: int,
    table: Table,
    tell: Callable[[Progress], object],
    group: str,
    link: str,
) -> list[str]:
    """Measure what is not there yet; what failed, a line each."""
    done, failures, in_a_row = total - len(left), [], 0
    tell(Progress(done, total, _time_of(left)))
    for turn, (condition, seed) in enumerate(left, start=1):
        cell, problem = f"{group}_{condition.label}_s{seed}", ""
        try:
            row = measure(condition, seed, link)
            table.append(_identity(cell, group, seed, condition) | row)
            done, in_a_row = done + 1, 0
        except EmulatorError as error:
            problem, in_a_row = str(error), in_a_row + 1
            failures.append(f"{cell}: {problem}")
            if in_a_row == _MOST_FAILURES:
                raise
        tell(Progress(done, total, _time_of(left[turn:]), cell, problem))
    return failures


def _look_at_machine(link: str) -> dict[str, str | int | bool | None]:
    """The machine, after a run of nothing that shows what it allows.

    Raises:
        EmulatorError: the link cannot be set up.
    """
    outcome = run_job(Job("nothing", link=link))
    return describe_machine(link, outcome.way, outcome.realtime)


def _identity(cell: str, group: str, seed: int, condition: Condition) -> Row:
    return {"cell": cell, "group": group, "seed": str(seed), "cond_id": condition.hash}


def _time_of(left: Sequence[tuple[Condition, int]]) -> float:
    return sum(c.warm_s + c.dur_s + 8e-3 * c.delay_ms + _OVERHEAD_S for c, _ in left)
