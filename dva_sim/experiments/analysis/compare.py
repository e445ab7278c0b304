"""Two results folders side by side: what changed, cell by cell, and how sure that is.

Where both ran the same person and trial on the same seed, runs are compared in pairs: what luck
does to both cancels. Otherwise persons of the one are compared with persons of the other. A
difference is always the second folder minus the first.

Whether the conditions hold that a comparison should fail by.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from dva_sim.experiments.analysis.compare_rows import Difference, Rows, Run, as_numbers, difference
from dva_sim.experiments.analysis.fail_conditions import SIGNS, TESTS, Gate, Test, parse, percent_of
from dva_sim.experiments.analysis.matched_cells import Levels, Matched, Pair, match
from dva_sim.experiments.results.results import Array, Frame, Results
from dva_sim.experiments.study.parts import DESIGN
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.suggestions import hint

_ROW = ("part", "cell", "person", "trial", "seed")


@dataclass(frozen=True)
class GateGroup:
    """Cells that are looked at together, never of two parts.

    Attributes:
        part: Name of the part.
        levels: What they have in common; nothing for all cells of the part.
        pairs: The cells of both folders.
    """

    part: str
    levels: Levels
    pairs: tuple[Pair, ...]


class Comparison:
    """Two results folders, matched.

    Args:
        first: What is compared with.
        second: What is compared.

    Raises:
        ConfigError: they have no cell in common.
    """

    def __init__(self, first: Results, second: Results) -> None:
        self.sides = (first, second)
        self._luck: dict[GateGroup, frozenset[Run]] = {}
        self._frames: dict[tuple[int, str, str], Frame] = {}
        if not self.matched.pairs:
            raise ConfigError(
                f"{first.folder} and {second.folder} have no configuration in common: neither "
                "levels of the same factors, nor a scenario"
            )

    @cached_property
    def matched(self) -> Matched:
        """Which cells are compared."""
        return match(*self.sides)

    @cached_property
    def _columns(self) -> dict[str, list[str]]:
        """What can be measured: the columns that both folders have, by table, the runs first."""
        first, second = self.sides
        tables = [name for name in first.tables if second.has(name)]
        known = {*DESIGN, *first.factors, *second.factors}
        found = {}
        for table in sorted(tables, key=lambda name: name != "runs"):
            both = set(second.names(table)) - known
            found[table] = [name for name in first.names(table) if name in both]
        return found

    def find(self, measure: str | None = None) -> tuple[str, str]:
        """Table and column of a measure: `drive_time_s`, or `events.response_s`.

        A name without a table is looked for in the runs first. Without a name it is the measure
        of the declared answer.

        Raises:
            ConfigError: there is none, or it is not clear which is meant.
        """
        name = measure or (self.sides[0].study.get("answer") or {}).get("measure")
        if not name:
            raise ConfigError("the study declares no answer; name what to compare (--measure)")
        table, _, column = str(name).rpartition(".")
        where = [t for t, names in self._columns.items() if column in names and table in ("", t)]
        if not where:
            there = self._columns.get(table or "runs", ())
            told = hint(column, there, table or "runs")
            raise ConfigError(f"measure {name!r} is not in both; {told}")
        if len(where) > 1 and where[0] != "runs":
            several = " or ".join(f"{table}.{column}" for table in where)
            raise ConfigError(f"measure {name!r} is in several tables; name {several}")
        return where[0], column

    def groups(self, by: Sequence[str] | None = ()) -> Iterator[GateGroup]:
        """The cells in groups.

        Args:
            by: Factors whose levels tell the groups apart; none for every cell by itself,
                None for all cells of a part together.

        Raises:
            ConfigError: a factor that the cells do not have in common.
        """
        known = dict.fromkeys(name for pair in self.matched.pairs for name, _ in pair.levels)
        if unknown := [name for name in by or () if name not in known]:
            told = hint(unknown[0], known, "common")
            raise ConfigError(f"factor {unknown[0]!r} is not common to both; {told}")
        groups: dict[tuple[str, Levels, int], list[Pair]] = {}
        for pair in self.matched.pairs:
            groups.setdefault(_group_of(pair, by), []).append(pair)
        for (part, levels, _), pairs in groups.items():
            yield GateGroup(part, levels, tuple(pairs))

    def rows(self, side: int, table: str, column: str, group: GateGroup) -> Rows:
        """The values of a column in some cells of the first (0) or second (1) folder.

        Where both have runs with the same luck, only those are looked at. The cells bear the
        numbers of the first folder, so that runs can be paired.
        """
        rows, shared = self._rows(side, table, column, group), self._shared(group)
        return rows.of(shared) if shared else rows

    def failed(self, side: int, group: GateGroup) -> frozenset[Run]:
        """The runs of some cells that failed in the first (0) or second (1) folder."""
        number = {(p.first, p.second)[side]: p.first for p in group.pairs}
        return frozenset(
            (number[run["cell"]], run["person"], run["trial"], run["seed"])
            for run in self.sides[side].failures
            if run["part"] == group.part and run["cell"] in number
        )

    def _shared(self, group: GateGroup) -> frozenset[Run]:
        """The runs of some cells that both folders have."""
        if group not in self._luck:
            first, second = (self._rows(side, "runs", "seed", group).runs for side in (0, 1))
            self._luck[group] = frozenset(first) & frozenset(second)
        return self._luck[group]

    def _rows(self, side: int, table: str, column: str, group: GateGroup) -> Rows:
        frame = self._frame(side, table, column)
        own = [(pair.first, pair.second)[side] for pair in group.pairs]
        number = dict(zip(own, (pair.first for pair in group.pairs), strict=True))
        chosen = frame.where((frame["part"] == group.part) & np.isin(frame["cell"], own))
        cells = np.array([number[cell] for cell in chosen["cell"].tolist()], dtype=np.int64)
        return Rows(chosen[column], cells, *(chosen[name] for name in _ROW[2:]))

    def _frame(self, side: int, table: str, column: str) -> Frame:
        if table == "runs":
            return self.sides[side].runs
        key = side, table, column
        if key not in self._frames:
            self._frames[key] = self.sides[side].table(table, columns=(*_ROW, column))
        return self._frames[key]

    def differences(
        self, measure: str | None = None, by: Sequence[str] | None = ()
    ) -> list[Difference]:
        """A measure's difference in every group of cells that has a value; see `groups`.

        Raises:
            ConfigError: no such measure or factor, or one in words.
        """
        self.refuse_distrusted()
        table, column = self.find(measure)
        found = []
        for group in self.groups(by):
            rows = [as_numbers(self.rows(side, table, column, group), column) for side in (0, 1)]
            if any(np.isfinite(side.values).any() for side in rows):
                found.append(difference(group.part, group.levels, *rows))
        return found

    def refuse_distrusted(self) -> None:
        """Nothing is said of what a user's class did that failed: the default did it.

        Raises:
            ConfigError: there is such a part.
        """
        for name, side in zip("AB", self.sides, strict=True):
            for part, told in side.distrusted.items():
                raise ConfigError(f"nothing is compared: in part {part} of {name} {told}")

    def judge(self, fail_if: str) -> list[GateVerdict]:
        """Look at a condition such as `p95(response_s) > 1.05x`, part by part.

        Raises:
            ConfigError: it is none, or nothing to decide it by.
        """
        return judge(parse(fail_if), self)

    def changed(self) -> tuple[list[str], int]:
        """Measures that are not the same in every pair of runs, and how many there are in all.

        None where no run of both has the same luck.
        """
        names = self._columns.get("runs", [])
        return [name for name in names if self._is_changed(name)], len(names)

    def _is_changed(self, column: str) -> bool:
        for group in self.groups(None):
            if self._shared(group):
                a, b = (self.rows(side, "runs", column, group).by_run() for side in (0, 1))
                if any(not _alike(a[run], b[run]) for run in a):
                    return True
        return False

    @cached_property
    def paired(self) -> tuple[int, int]:
        """Runs of the first folder that the second has with the same luck, and all of its runs."""
        groups = list(self.groups(None))
        runs = sum(len(self._rows(0, "runs", "seed", group).runs) for group in groups)
        return sum(len(self._shared(group)) for group in groups), runs

    def __repr__(self) -> str:
        folders = " with ".join(str(side.folder) for side in self.sides)
        cells = f"{len(self.matched.pairs)} cells in both"
        return f"Comparison of {folders}: {cells}; frame(measure, by), judge(fail_if), changed()"

    def _repr_html_(self) -> str:
        return self.frame()._repr_html_()

    def frame(self, measure: str | None = None, by: Sequence[str] | None = ()) -> Frame:
        """The same as `differences`, as columns."""
        table, column = self.find(measure)
        rows = self.differences(f"{table}.{column}", by)
        names = dict.fromkeys(name for row in rows for name, _ in row.levels)
        levels = {n: np.array([dict(r.levels).get(n) for r in rows], dtype=object) for n in names}
        numbers = {
            "runs_first": [row.runs[0] for row in rows],
            "runs_second": [row.runs[1] for row in rows],
            f"median_first_{column}": [row.medians[0] for row in rows],
            f"median_second_{column}": [row.medians[1] for row in rows],
            f"difference_{column}": [row.interval.mean for row in rows],
            f"difference_low_{column}": [row.interval.low for row in rows],
            f"difference_high_{column}": [row.interval.high for row in rows],
            "is_paired": [row.is_paired for row in rows],
        }
        part = np.array([row.part for row in rows], dtype=object)
        return Frame({"part": part} | levels | {k: np.array(v) for k, v in numbers.items()})


def _group_of(pair: Pair, by: Sequence[str] | None) -> tuple[str, Levels, int]:
    if by is None:
        return pair.part, (), 0
    if not by:
        return pair.part, pair.levels, pair.first
    return pair.part, tuple((name, level) for name, level in pair.levels if name in by), 0


def _alike(a: Any, b: Any) -> bool:
    return bool(a == b or (a != a and b != b))  # nan is like nan


@dataclass(frozen=True)
class GateVerdict:
    """A gate in one group of cells.

    Attributes:
        gate: The condition.
        part: Name of the part.
        levels: What the cells have in common.
        first: The statistic in the first folder.
        second: The same in the second.
        bound: What the second is held against.
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
        """Whether the condition holds, so that the comparison fails."""
        return bool(SIGNS[self.gate.sign](self.second, self.bound))


def judge(gate: Gate, comparison: Comparison) -> list[GateVerdict]:
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
    gate: Gate, comparison: Comparison, table: str, column: str, groups: Iterator[GateGroup]
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
    """What would have come of runs that failed is not known."""
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
    """Of pairs of runs those with a value on both sides: who has none is not among the best."""
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
    values, percent = _values(gate, rows), percent_of(gate.statistic)
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
