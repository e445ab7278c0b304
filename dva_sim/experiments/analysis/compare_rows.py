"""The values of a measure in some cells of two folders, and the difference between them."""

from __future__ import annotations

from collections.abc import Set
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from dva_sim.experiments.analysis.matched_cells import Levels
from dva_sim.experiments.results.results import Array
from dva_sim.kernel.errors import ConfigError
from dva_sim.statistics import LEVEL, Interval, paired_difference, person_means

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
