"""Two results folders, matched cell by cell where both vary the same factors, and their rows."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, replace
from functools import cached_property
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
    differing = _differing(a, b)
    alike = [name for name in _factors(a, b) if name not in differing]
    by_levels = _matched(a, b, lambda cell: (cell["part"], *map(cell["levels"].get, alike)))
    rest_a = _without(a, (x for x, _ in by_levels))
    rest_b = _without(b, (y for _, y in by_levels))
    by_config = _matched(rest_a, rest_b, lambda cell: (cell["part"], cell["config"]))
    pairs = sorted((*by_levels, *by_config), key=lambda pair: a.index(pair[0]))
    return Matched(
        tuple(_pair(x, y) for x, y in pairs),
        tuple(_name(cell) for cell in _without(rest_a, (x for x, _ in by_config))),
        tuple(_name(cell) for cell in _without(rest_b, (y for _, y in by_config))),
        differing,
    )


def _cells(results: Results) -> list[_Cell]:
    cells = results.manifest.get("cells", [])
    return [c for c in cells if c["part"] != REPEATS and c["cell"] != REFERENCE]


def _differing(
    a: Sequence[_Cell], b: Sequence[_Cell]
) -> dict[str, tuple[tuple[Level, ...], tuple[Level, ...]]]:
    """Factors that cannot tell cells apart in both, with their levels here and there."""
    found = {}
    for factor in _factors(a, b):
        here = _levels(a, factor)
        there = _levels(b, factor)
        if not set(here) & set(there):
            found[factor] = here, there
    return found


def _factors(a: Sequence[_Cell], b: Sequence[_Cell]) -> list[str]:
    return list(dict.fromkeys(name for cell in (*a, *b) for name in cell["levels"]))


def _levels(cells: Iterable[_Cell], factor: str) -> tuple[Level, ...]:
    return tuple(dict.fromkeys(c["levels"][factor] for c in cells if factor in c["levels"]))


def _matched(
    a: Iterable[_Cell], b: Iterable[_Cell], key: Callable[[_Cell], Hashable]
) -> list[tuple[_Cell, _Cell]]:
    """Pairs of cells whose key is the same, and nobody else's."""
    once_a = _once(a, key)
    once_b = _once(b, key)
    return [(cell, once_b[name]) for name, cell in once_a.items() if name in once_b]


def _once(cells: Iterable[_Cell], key: Callable[[_Cell], Hashable]) -> dict[Hashable, _Cell]:
    cells = list(cells)
    counts = Counter(map(key, cells))
    return {key(cell): cell for cell in cells if counts[key(cell)] == 1}


def _without(cells: Iterable[_Cell], taken: Iterable[_Cell]) -> list[_Cell]:
    addresses = set(map(Address.of, taken))
    return [cell for cell in cells if Address.of(cell) not in addresses]


def _name(cell: _Cell) -> tuple[str, Levels]:
    return cell["part"], tuple(cell["levels"].items())


def _pair(a: _Cell, b: _Cell) -> Pair:
    """The levels are those that both have, in the order of the first."""
    common = tuple((k, v) for k, v in a["levels"].items() if b["levels"].get(k, _NOT) == v)
    return Pair(a["part"], common, a["cell"], b["cell"], a["config"] == b["config"])


Run = tuple[int, int, int, int]


@dataclass(frozen=True)
class Rows:
    """A column of a table, with what tells whose rows they are.

    Attributes:
        values: Values of the measure `(n,)`.
        cell: Number of the cell in the first folder `(n,)`.
        person: Person of each row `(n,)`.
        trial: Trial of each row `(n,)`.
        seed: Seed of each run `(n,)`.
    """

    values: Array
    cell: Array
    person: Array
    trial: Array
    seed: Array

    @property
    def runs(self) -> list[Run]:
        """Cell, person, trial and seed of each row."""
        columns = (self.cell, self.person, self.trial, self.seed)
        return list(zip(*(column.tolist() for column in columns), strict=True))

    def by_run(self) -> dict[Run, Any]:
        """The values by run; of a run with several rows the last."""
        return dict(zip(self.runs, self.values.tolist(), strict=True))

    def of(self, runs: Set[Run]) -> Rows:
        """The rows of some runs."""
        return self.where(np.array([run in runs for run in self.runs], dtype=bool))

    def where(self, chosen: Array) -> Rows:
        """Some rows, by a mask `(n,)`."""
        columns = (self.values, self.cell, self.person, self.trial, self.seed)
        return Rows(*(column[chosen] for column in columns))

    def means(self) -> Rows:
        """One row for each run that has a value: the mean of its rows."""
        there = np.isfinite(self.values)
        keys = np.stack([self.cell, self.person, self.trial, self.seed], axis=1)[there]
        runs, place = np.unique(keys.astype(np.int64), axis=0, return_inverse=True)
        place = place.reshape(-1)
        totals = np.bincount(place, weights=self.values[there], minlength=len(runs))
        return Rows(totals / np.bincount(place, minlength=len(runs)), *runs.T)


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
    """The second's values minus the first's: by pairs of runs where there are any.

    Args:
        part: Name of the part.
        levels: Levels that the cells have in common.
        first: Rows of the first folder, as numbers.
        second: Those of the second.
    """
    a = first.means()
    b = second.means()
    runs_a = a.by_run()
    runs_b = b.by_run()
    both = sorted(runs_a.keys() & runs_b.keys())
    old, new = (np.array([runs[run] for run in both]) for runs in (runs_a, runs_b))
    person = np.array([person for _, person, _, _ in both])
    return Difference(
        part,
        levels,
        runs=(len(a.values), len(b.values)),
        medians=(_median(a.values), _median(b.values)),
        interval=paired_difference(new, old, person) if both else _unpaired(a, b),
        is_paired=bool(both),
        same=int((old == new).sum()),
    )


def _median(values: Array) -> float:
    return float(np.median(values)) if len(values) else np.nan


def _unpaired(a: Rows, b: Rows) -> Interval:
    """Welch's interval on the means of persons, who are others in each folder."""
    from scipy import stats

    old, new = (person_means(rows.values, rows.person)[1] for rows in (a, b))
    mean = float(new.mean() - old.mean()) if len(old) and len(new) else np.nan
    n = min(len(old), len(new))
    if n < 2:
        return Interval(mean, np.nan, np.nan, n)
    found = stats.ttest_ind(new, old, equal_var=False).confidence_interval(LEVEL)
    return Interval(mean, float(found.low), float(found.high), n)


_ROW = ("part", "cell", "person", "trial", "seed")


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
        """The cells in groups.

        Args:
            by: Factors whose levels tell the groups apart; none for every cell by itself,
                None for all cells of a part together.

        Raises:
            ConfigError: a factor that the cells do not have in common.
        """
        known = dict.fromkeys(name for pair in self.matched.pairs for name, _ in pair.levels)
        if unknown := [name for name in by or () if name not in known]:
            suggestion = hint(unknown[0], known, "common")
            raise ConfigError(f"factor {unknown[0]!r} is not common to both; {suggestion}")
        groups: dict[tuple[str, Levels, int], list[Pair]] = {}
        for pair in self.matched.pairs:
            groups.setdefault(_group_of(pair, by), []).append(pair)
        for (part, levels, _), pairs in groups.items():
            yield GateGroup(part, levels, tuple(pairs))

    def rows(self, side: int, table: str, column: str, group: GateGroup) -> Rows:
        """The values of a column in some cells of the first (0) or second (1) folder.

        Where both have runs with the same random numbers, only these are used. The cells bear the
        numbers of the first folder, so that runs can be paired.
        """
        rows = self.own_rows(side, table, column, group)
        shared = self.shared(group)
        return rows.of(shared) if shared else rows

    def failed(self, side: int, group: GateGroup) -> frozenset[Run]:
        """The runs of some cells that failed in the first (0) or second (1) folder."""
        number = {(p.first, p.second)[side]: p.first for p in group.pairs}
        return frozenset(
            (number[run["cell"]], run["person"], run["trial"], run["seed"])
            for run in self.sides[side].failures
            if run["part"] == group.part and run["cell"] in number
        )

    def shared(self, group: GateGroup) -> frozenset[Run]:
        """The runs of some cells that both folders have."""
        if group not in self._same_seeds:
            first, second = (self.own_rows(side, "runs", "seed", group).runs for side in (0, 1))
            self._same_seeds[group] = frozenset(first) & frozenset(second)
        return self._same_seeds[group]

    def own_rows(self, side: int, table: str, column: str, group: GateGroup) -> Rows:
        """All rows of some cells in one folder, with or without a counterpart."""
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

    def refuse_distrusted(self) -> None:
        """Nothing is said of what a user's class did that failed: the default did it.

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
