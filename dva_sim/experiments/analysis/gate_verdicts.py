"""Verdicts on the conditions under which a comparison fails."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from dva_sim.experiments.analysis.compare_rows import Rows, as_numbers
from dva_sim.experiments.analysis.fail_conditions import SIGNS, TESTS, Gate, Test, percent_of
from dva_sim.experiments.analysis.matched_cells import Levels
from dva_sim.experiments.analysis.matched_results import GateGroup, MatchedResults
from dva_sim.experiments.results.results import Array
from dva_sim.kernel.errors import ConfigError


@dataclass(frozen=True)
class GateVerdict:
    """A gate in one group of cells.

    Attributes:
        gate: The condition.
        part: Name of the part.
        levels: Levels that the cells have in common.
        first: The statistic in the first folder.
        second: The statistic in the second folder.
        bound: Limit for the second folder's statistic.
        missing: Share of the rows without a value, in both.
    """

    gate: Gate
    part: str
    levels: Levels
    first: float
    second: float
    bound: float
    missing: tuple[float, float]

    def __repr__(self) -> str:
        word = "failed" if self.holds else "passed"
        where = ", ".join([self.part, *(f"{name} {level}" for name, level in self.levels)])
        numbers = f"A {self.first:.5g}, B {self.second:.5g}, bound {self.bound:.5g}"
        return f"Verdict({word}: {self.gate.text}; {where}: {numbers})"

    @property
    def holds(self) -> bool:
        """True if the condition holds, so that the comparison fails."""
        return bool(SIGNS[self.gate.sign](self.second, self.bound))


def judge(gate: Gate, comparison: MatchedResults) -> list[GateVerdict]:
    """Look at a condition wherever both folders have cells in common.

    Raises:
        ConfigError: no such measure or factor, or nothing to decide it by.
    """
    try:
        comparison.refuse_distrusted()
        table, column = comparison.find(gate.measure)
        by = None if gate.per is None else () if gate.per == "cell" else (gate.per,)
        verdicts = list(_verdicts(gate, comparison, table, column, comparison.groups(by)))
        if not verdicts:
            raise ConfigError(f"no run of either has a value of {column}")
    except ConfigError as error:
        raise ConfigError(f"--fail-if {gate.text!r}: {error}") from None
    return verdicts


def _verdicts(
    gate: Gate, comparison: MatchedResults, table: str, column: str, groups: Iterator[GateGroup]
) -> Iterator[GateVerdict]:
    for group in groups:
        crashed = [comparison.failed(n, group) for n in (0, 1)]
        if gate.statistic != "missing":
            _refuse_crashed(group, len(crashed[1] - crashed[0]))
        sides = [_tested(gate, comparison.rows(n, table, column, group), column) for n in (0, 1)]
        if not any(len(_values(gate, side)) for side in sides):
            continue
        shares = [_missing(side, len(runs)) for side, runs in zip(sides, crashed, strict=True)]
        found = shares
        if gate.statistic != "missing":
            found = [_statistic(gate, side) for side in _both(gate, *sides)]
        first, second = found
        _refuse_undecided(gate, group, first, second)
        bound = gate.bound.for_(first)
        yield GateVerdict(
            gate=gate,
            part=group.part,
            levels=group.levels,
            first=first,
            second=second,
            bound=bound,
            missing=(shares[0], shares[1]),
        )


def _refuse_crashed(group: GateGroup, runs: int) -> None:
    """Raise if runs failed in the second folder only: their values are unknown."""
    if runs:
        raise ConfigError(
            f"in part {group.part} {runs} runs of the second folder failed that did not in the "
            "first; a condition on missing(...) counts them"
        )


def _missing(rows: Rows, crashed: int) -> float:
    """Share of the rows without a value; a run that failed is one of them."""
    every = len(rows.values) + crashed
    return float((np.isnan(rows.values).sum() + crashed) / every) if every else 1.0


def _both(gate: Gate, first: Rows, second: Rows) -> tuple[Rows, Rows]:
    """Keep the pairs with a value on both sides, so that missing ones do not rank as best."""
    alone = gate.statistic == "share" or gate.bound.kind == "absolute"
    if alone or first.runs != second.runs:
        return first, second
    there = np.isfinite(first.values) & np.isfinite(second.values)
    if not there.any():
        return first, second
    return first.where(there), second.where(there)


def _tested(gate: Gate, rows: Rows, column: str) -> Rows:
    """The rows with numbers for values: of a share, whether they pass its test."""
    if gate.test is None and gate.statistic != "missing":
        return as_numbers(rows, column)
    if gate.test is not None and not isinstance(gate.test.than, str):
        rows = as_numbers(rows, column)
    passed = [_passes(gate.test, value) for value in rows.values.tolist()]
    return replace(rows, values=np.array(passed, dtype=float))


def _passes(test: Test | None, value: Any) -> float:
    """1 or 0, or nan for a value that is missing."""
    if value is None or value != value:
        return math.nan
    if test is None:
        return 1.0
    return float(TESTS[test.sign](str(value) if isinstance(test.than, str) else value, test.than))


def _values(gate: Gate, rows: Rows) -> Array:
    if gate.statistic == "missing":
        return np.isnan(rows.values).astype(float)
    return rows.values[~np.isnan(rows.values)]


def _statistic(gate: Gate, rows: Rows) -> float:
    values = _values(gate, rows)
    percent = percent_of(gate.statistic)
    if not len(values):
        return math.nan
    if percent is not None:
        return float(np.percentile(values, percent))
    taken: Any = {"median": np.median, "min": np.min, "max": np.max}.get(gate.statistic, np.mean)
    return float(taken(values))


def _refuse_undecided(gate: Gate, group: GateGroup, first: float, second: float) -> None:
    """A gate that cannot be decided must not pass for one that was."""
    where = f"in part {group.part}"
    needs_first = gate.bound.kind != "absolute"
    for side, value in (("first", first), ("second", second)):
        if math.isnan(value) and (side == "second" or needs_first):
            raise ConfigError(f"{where} no run of the {side} folder has a value")
    if gate.bound.kind == "times" and first < 0:
        raise ConfigError(f"{where} the first folder has {first:g}; below zero, name a difference")
