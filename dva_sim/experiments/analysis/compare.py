"""Two results folders side by side: what changed, cell by cell, and how sure that is.

Where both ran the same person and trial on the same seed, runs are compared in pairs: random
effects common to both cancel. Otherwise persons of the one are compared with persons of the other.
A difference is always the second folder minus the first.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from dva_sim.experiments.analysis.fail_conditions import GateVerdict, judge, parse
from dva_sim.experiments.analysis.matched_results import (
    Difference,
    MatchedResults,
    as_numbers,
    difference,
)
from dva_sim.experiments.results.results import Frame


class Comparison(MatchedResults):
    """Comparison of two results folders, run by run."""

    def differences(
        self, measure: str | None = None, by: Sequence[str] | None = ()
    ) -> list[Difference]:
        """Return a measure's difference in every group of cells that has a value; see `groups`.

        Raises:
            ConfigError: no such measure or factor, or one in words.
        """
        self.refuse_distrusted()
        table, column = self.find(measure)
        rows_by_group = []
        for group in self.groups(by):
            rows = [as_numbers(self.rows(side, table, column, group), column) for side in (0, 1)]
            if any(np.isfinite(side.values).any() for side in rows):
                rows_by_group.append(difference(group.part, group.levels, *rows))
        return rows_by_group

    def judge(self, fail_if: str) -> list[GateVerdict]:
        """Look at a condition such as `p95(response_s) > 1.05x`, part by part.

        Raises:
            ConfigError: it is none, or nothing to decide it by.
        """
        return judge(parse(fail_if), self)

    def changed(self) -> tuple[list[str], int]:
        """Return measures that differ in some pair of runs, and how many there are in all.

        None if no runs have the same random numbers.
        """
        names = self.columns.get("runs", [])
        return [name for name in names if self._is_changed(name)], len(names)

    def _is_changed(self, column: str) -> bool:
        for group in self.groups(None):
            if self.shared(group):
                a, b = (self.rows(side, "runs", column, group).by_run() for side in (0, 1))
                pairs = [(value, b[run]) for run, value in a.items()]
                if any(x != y and (x == x or y == y) for x, y in pairs):  # nan is like nan
                    return True
        return False

    @cached_property
    def paired(self) -> tuple[int, int]:
        """Number of runs in the first folder paired by seed with the second, and their total."""
        groups = list(self.groups(None))
        runs = sum(len(self.own_rows(0, "runs", "seed", group).runs) for group in groups)
        return sum(len(self.shared(group)) for group in groups), runs

    def __repr__(self) -> str:
        folders = " with ".join(str(side.folder) for side in self.sides)
        cells = f"{len(self.matched.pairs)} cells in both"
        return f"Comparison of {folders}: {cells}; frame(measure, by), judge(fail_if), changed()"

    def _repr_html_(self) -> str:
        return self.frame()._repr_html_()

    def frame(self, measure: str | None = None, by: Sequence[str] | None = ()) -> Frame:
        """Return `differences` as columns."""
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
