"""Two results folders whose cells are matched: measures, groups of cells, and their rows."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dva_sim.experiments.analysis.compare_rows import Rows, Run
from dva_sim.experiments.analysis.matched_cells import Levels, Matched, Pair, match
from dva_sim.experiments.results.results import Frame, Results
from dva_sim.experiments.study.parts import DESIGN
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.suggestions import hint

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
