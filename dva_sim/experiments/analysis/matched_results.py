"""Two results folders, matched cell by cell where both vary the same factors, and their rows."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import compress
from typing import Any

import numpy as np

from dva_sim.experiments.results.results import Array, Frame, Results
from dva_sim.experiments.study.addresses import REFERENCE, Address
from dva_sim.experiments.study.parts import DESIGN, REPEATS, Level
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.suggestions import hint
from dva_sim.statistics import LEVEL, Interval, paired_difference, person_means

Levels = tuple[tuple[str, Level], ...]


_NOT = object()


_Cell = Mapping[str, Any]  # as in the manifest: part, cell, config, levels
_Cells = dict[Address, _Cell]


@dataclass(frozen=True)
class Pair:
    """A cell of each folder that are compared with each other.

    Attributes:
        part: Name of the part.
        levels: Levels that both cells have in common.
        first: Number of the cell in the first folder.
        second: Number of the cell in the second.
        is_same: True if both ran exactly the same configuration.
    """

    part: str
    levels: Levels
    first: int
    second: int
    is_same: bool


@dataclass(frozen=True)
class Matched:
    """Correspondence between the cells of two folders.

    Attributes:
        pairs: Cells that were found in both.
        only_first: Cells of the first folder without a counterpart, as part and levels.
        only_second: Cells of the second without one.
        differing: Factors whose levels have nothing in common, or that one folder alone has,
            with the levels of each; they tell no cells apart.
    """

    pairs: tuple[Pair, ...]
    only_first: tuple[tuple[str, Levels], ...]
    only_second: tuple[tuple[str, Levels], ...]
    differing: dict[str, tuple[tuple[Level, ...], tuple[Level, ...]]]


def match(first: Results, second: Results) -> Matched:
    """Match cells by the levels of the factors that both folders vary.

    The rest is matched by configuration, so that a folder of one cell finds its like in
    a grid. Reference runs and repeats take no part.
    """
    a = _cells(first)
    b = _cells(second)
    factors = dict.fromkeys(name for cell in (*a.values(), *b.values()) for name in cell["levels"])
    levels = {name: (_levels(a, name), _levels(b, name)) for name in factors}
    alike = [name for name, (here, there) in levels.items() if {*here} & {*there}]
    pairs = _matched(a, b, lambda cell: (cell["part"], *map(cell["levels"].get, alike)))
    left_a = {x: cell for x, cell in a.items() if x not in pairs}
    left_b = {y: cell for y, cell in b.items() if y not in pairs.values()}
    pairs |= _matched(left_a, left_b, lambda cell: (cell["part"], cell["config"]))
    return Matched(
        tuple(_pair(cell, b[pairs[x]]) for x, cell in a.items() if x in pairs),
        tuple(_name(cell) for x, cell in a.items() if x not in pairs),
        tuple(_name(cell) for y, cell in b.items() if y not in pairs.values()),
        {name: both for name, both in levels.items() if name not in alike},
    )


def _cells(results: Results) -> _Cells:
    cells = results.manifest.get("cells", [])
    own_cells = (c for c in cells if c["part"] != REPEATS and c["cell"] != REFERENCE)
    return {Address.of(cell): cell for cell in own_cells}


def _levels(cells: _Cells, factor: str) -> tuple[Level, ...]:
    levels = (cell["levels"] for cell in cells.values())
    return tuple(dict.fromkeys(each[factor] for each in levels if factor in each))


def _matched(a: _Cells, b: _Cells, key: Callable[[_Cell], Hashable]) -> dict[Address, Address]:
    """Return pairs of cells whose key is the same, and nobody else's."""
    once_a = _once(a, key)
    once_b = _once(b, key)
    return {x: once_b[name] for name, x in once_a.items() if name in once_b}


def _once(cells: _Cells, key: Callable[[_Cell], Hashable]) -> dict[Hashable, Address]:
    counts = Counter(map(key, cells.values()))
    return {key(cell): x for x, cell in cells.items() if counts[key(cell)] == 1}


def _name(cell: _Cell) -> tuple[str, Levels]:
    return cell["part"], tuple(cell["levels"].items())


def _pair(a: _Cell, b: _Cell) -> Pair:
    """Return the levels that both have, in the order of the first."""
    common = tuple((k, v) for k, v in a["levels"].items() if b["levels"].get(k, _NOT) == v)
    return Pair(a["part"], common, a["cell"], b["cell"], a["config"] == b["config"])


Run = tuple[Address, int]
"""A run of either folder, by its address in the first, and its seed."""


@dataclass(frozen=True)
class Rows:
    """A column of a table, with what tells whose rows they are.

    Attributes:
        values: Values of the measure `(n,)`.
        runs: Run of each row `(n,)`.
    """

    values: Array
    runs: list[Run]

    def by_run(self) -> dict[Run, Any]:
        """Return the values by run; of a run with several rows the last."""
        return dict(zip(self.runs, self.values.tolist(), strict=True))

    def where(self, chosen: Array) -> Rows:
        """Return some rows, by a mask `(n,)`."""
        return Rows(self.values[chosen], list(compress(self.runs, chosen)))

    def means(self) -> dict[Run, float]:
        """Return the mean of the rows of each run that has a value."""
        runs = sorted(set(self.runs))
        number = {run: n for n, run in enumerate(runs)}
        numbers, means = person_means(self.values, [number[run] for run in self.runs])
        return dict(zip((runs[n] for n in numbers.astype(int)), means.tolist(), strict=True))


@dataclass(frozen=True)
class Difference:
    """One measure in the same cells of both folders.

    Attributes:
        part: Name of the part.
        levels: Levels that the cells have in common.
        runs: Runs of each folder that have a value.
        medians: Over these runs, of each folder.
        interval: Mean over persons of second minus first, with its 95 % interval.
        is_paired: True if it rests on pairs of runs with the same random numbers.
        same: Number of pairs with exactly equal values.
    """

    part: str
    levels: Levels
    runs: tuple[int, int]
    medians: tuple[float, float]
    interval: Interval
    is_paired: bool
    same: int

    @property
    def is_identical(self) -> bool:
        """True if all runs are paired and unchanged."""
        return self.is_paired and self.same == self.runs[0] == self.runs[1]

    @property
    def differs_from_zero(self) -> bool:
        """True if the unadjusted interval excludes zero."""
        return self.interval.low > 0 or self.interval.high < 0


def as_numbers(rows: Rows, name: str) -> Rows:
    """Convert values to floats: nan for missing ones, 1 and 0 for yes and no.

    Raises:
        ConfigError: they are words.
    """
    values = rows.values
    if any(isinstance(value, str) for value in values.tolist()):
        raise ConfigError(f"{name} is in words; ask for a share, as in share({name} == 'word')")
    if values.dtype.kind == "O":
        values = np.array([np.nan if value is None else value for value in values], dtype=float)
    return replace(rows, values=values.astype(float))


def difference(part: str, levels: Levels, first: Rows, second: Rows) -> Difference:
    """Return the second's values minus the first's: by pairs of runs where there are any.

    Args:
        part: Name of the part.
        levels: Levels that the cells have in common.
        first: Rows of the first folder, as numbers.
        second: Those of the second.
    """
    a = first.means()
    b = second.means()
    both = sorted(a.keys() & b.keys())
    old, new = (np.array([means[run] for run in both]) for means in (a, b))
    return Difference(
        part,
        levels,
        runs=(len(a), len(b)),
        medians=(_median(a), _median(b)),
        interval=paired_difference(new, old, _persons(both)) if both else _unpaired(a, b),
        is_paired=bool(both),
        same=int((old == new).sum()),
    )


def _median(means: Mapping[Run, float]) -> float:
    return float(np.median(list(means.values()))) if means else np.nan


def _persons(runs: Iterable[Run]) -> Array:
    return np.array([address.person for address, _ in runs])


def _unpaired(a: Mapping[Run, float], b: Mapping[Run, float]) -> Interval:
    """Return Welch's interval on the means of persons, who are others in each folder."""
    from scipy import stats

    old, new = (person_means(list(means.values()), _persons(means))[1] for means in (a, b))
    mean = float(new.mean() - old.mean()) if len(old) and len(new) else np.nan
    n = min(len(old), len(new))
    if n < 2:
        return Interval(mean, np.nan, np.nan, n)
    interval = stats.ttest_ind(new, old, equal_var=False).confidence_interval(LEVEL)
    return Interval(mean, float(interval.low), float(interval.high), n)


@dataclass(frozen=True)
class GateGroup:
    """Cells that are looked at together, never of two parts.

    Attributes:
        part: Name of the part.
        levels: Levels that they have in common; empty for all cells of the part.
        pairs: The cells of both folders.
    """

    part: str
    levels: Levels
    pairs: tuple[Pair, ...]

    def cells(self, side: int) -> dict[int, int]:
        """Return the cells of the first (0) or second (1) folder, numbered as in the first."""
        return {(pair.first, pair.second)[side]: pair.first for pair in self.pairs}


class MatchedResults:
    """Two results folders, matched.

    Args:
        first: Results to compare with.
        second: Results to compare.

    Raises:
        ConfigError: they have no cell in common.
    """

    def __init__(self, first: Results, second: Results) -> None:
        self.sides = (first, second)
        self._same_seeds: dict[GateGroup, frozenset[Run]] = {}
        self._frames: dict[tuple[int, str, str], Frame] = {}
        if not self.matched.pairs:
            raise ConfigError(
                f"{first.folder} and {second.folder} have no configuration in common: neither "
                "levels of the same factors, nor a scenario"
            )

    @cached_property
    def matched(self) -> Matched:
        """Cells present in both folders."""
        return match(*self.sides)

    @cached_property
    def columns(self) -> dict[str, list[str]]:
        """Measurable columns that both folders have, by table, the runs first."""
        first, second = self.sides
        tables = [name for name in first.tables if second.has(name)]
        keys = {*DESIGN, *first.factors, *second.factors}
        columns = {}
        for table in sorted(tables, key=lambda name: name != "runs"):
            both = set(second.names(table)) - keys
            columns[table] = [name for name in first.names(table) if name in both]
        return columns

    def find(self, measure: str | None = None) -> tuple[str, str]:
        """Return the table and column of a measure: `drive_time_s`, or `events.response_s`.

        A name without a table is looked for in the runs first. Without a name it is the measure
        of the declared answer.

        Raises:
            ConfigError: there is none, or it is not clear which is meant.
        """
        name = measure or (self.sides[0].study.get("answer") or {}).get("measure")
        if not name:
            raise ConfigError("the study declares no answer; name what to compare (--measure)")
        table, _, column = str(name).rpartition(".")
        where = [t for t, names in self.columns.items() if column in names and table in ("", t)]
        if not where:
            there = self.columns.get(table or "runs", ())
            suggestion = hint(column, there, table or "runs")
            raise ConfigError(f"measure {name!r} is not in both; {suggestion}")
        if len(where) > 1 and where[0] != "runs":
            several = " or ".join(f"{table}.{column}" for table in where)
            raise ConfigError(f"measure {name!r} is in several tables; name {several}")
        return where[0], column

    def groups(self, by: Sequence[str] | None = ()) -> Iterator[GateGroup]:
        """Yield the cells in groups.

        Args:
            by: Factors whose levels tell the groups apart; none for every cell by itself,
                None for all cells of a part together.

        Raises:
            ConfigError: a factor that the cells do not have in common.
        """
        common = dict.fromkeys(name for pair in self.matched.pairs for name, _ in pair.levels)
        if unknown := [name for name in by or () if name not in common]:
            suggestion = hint(unknown[0], common, "common")
            raise ConfigError(f"factor {unknown[0]!r} is not common to both; {suggestion}")
        groups: dict[tuple[str, Levels, int], list[Pair]] = {}
        for pair in self.matched.pairs:
            groups.setdefault(_group_of(pair, by), []).append(pair)
        for (part, levels, _), pairs in groups.items():
            yield GateGroup(part, levels, tuple(pairs))

    def rows(self, side: int, table: str, column: str, group: GateGroup) -> Rows:
        """Return the values of a column in some cells of the first (0) or second (1) folder.

        Where both have runs with the same random numbers, only these are used. The cells bear the
        numbers of the first folder, so that runs can be paired.
        """
        rows = self.own_rows(side, table, column, group)
        shared = self.shared(group)
        return rows.where(np.array([run in shared for run in rows.runs])) if shared else rows

    def failed(self, side: int, group: GateGroup) -> frozenset[Run]:
        """Return the runs of some cells that failed in the first (0) or second (1) folder."""
        cells = group.cells(side)
        return frozenset(
            (Address.of(run)._replace(cell=cells[run["cell"]]), run["seed"])
            for run in self.sides[side].failures
            if run["part"] == group.part and run["cell"] in cells
        )

    def shared(self, group: GateGroup) -> frozenset[Run]:
        """Return the runs of some cells that both folders have."""
        if group not in self._same_seeds:
            first, second = (self.own_rows(side, "runs", "seed", group).runs for side in (0, 1))
            self._same_seeds[group] = frozenset(first) & frozenset(second)
        return self._same_seeds[group]

    def own_rows(self, side: int, table: str, column: str, group: GateGroup) -> Rows:
        """Return all rows of some cells in one folder, with or without a counterpart."""
        frame = self._frame(side, table, column)
        cells = group.cells(side)
        chosen = frame.where((frame["part"] == group.part) & np.isin(frame["cell"], list(cells)))
        runs = [run._replace(cell=cells[run.cell]) for run in Address.all_of(chosen)]
        return Rows(chosen[column], list(zip(runs, chosen["seed"].tolist(), strict=True)))

    def _frame(self, side: int, table: str, column: str) -> Frame:
        if table == "runs":
            return self.sides[side].runs
        key = side, table, column
        if key not in self._frames:
            self._frames[key] = self.sides[side].table(
                table, columns=(*Address._fields, "seed", column)
            )
        return self._frames[key]

    def refuse_distrusted(self) -> None:
        """Refuse to judge runs in which a user's class failed and the default took its place.

        Raises:
            ConfigError: there is such a part.
        """
        for name, side in zip("AB", self.sides, strict=True):
            for part, reason in side.distrusted.items():
                raise ConfigError(f"nothing is compared: in part {part} of {name} {reason}")


def _group_of(pair: Pair, by: Sequence[str] | None) -> tuple[str, Levels, int]:
    if by is None:
        return pair.part, (), 0
    if not by:
        return pair.part, pair.levels, pair.first
    return pair.part, tuple((name, level) for name, level in pair.levels if name in by), 0
