"""Which cells of two results folders are the same, as far as both vary the same things.

The values of a measure in some cells of two folders, and the difference between them.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence, Set
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from dva_sim.experiments.results.results import Array, Results
from dva_sim.experiments.study.cell_grid import REFERENCE
from dva_sim.experiments.study.parts import REPEATS, Level
from dva_sim.kernel.errors import ConfigError
from dva_sim.statistics import LEVEL, Interval, paired_difference, person_means

Levels = tuple[tuple[str, Level], ...]
_NOT = object()
_Cell = Mapping[str, Any]  # as in the manifest: part, cell, config, levels


@dataclass(frozen=True)
class Pair:
    """A cell of each folder that are compared with each other.

    Attributes:
        part: Name of the part.
        levels: What both have in common.
        first: Number of the cell in the first folder.
        second: Number of the cell in the second.
        is_same: Whether both ran the very same configuration.
    """

    part: str
    levels: Levels
    first: int
    second: int
    is_same: bool


@dataclass(frozen=True)
class Matched:
    """How the cells of two folders fit together.

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

    What is left is matched by its configuration, so that a folder of one cell finds its like in
    a grid. Reference runs and repeats take no part.
    """
    a, b = _cells(first), _cells(second)
    differing = _differing(a, b)
    by_levels = _matched(a, b, lambda cell: (cell["part"], _key(cell, differing)))
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
    for factor in dict.fromkeys(name for cell in (*a, *b) for name in cell["levels"]):
        here, there = _levels(a, factor), _levels(b, factor)
        if not set(here) & set(there):
            found[factor] = here, there
    return found


def _levels(cells: Iterable[_Cell], factor: str) -> tuple[Level, ...]:
    return tuple(dict.fromkeys(c["levels"][factor] for c in cells if factor in c["levels"]))


def _matched(
    a: Iterable[_Cell], b: Iterable[_Cell], key: Callable[[_Cell], Hashable]
) -> list[tuple[_Cell, _Cell]]:
    """Pairs of cells whose key is the same, and nobody else's."""
    once_a, once_b = _once(a, key), _once(b, key)
    return [(cell, once_b[name]) for name, cell in once_a.items() if name in once_b]


def _once(cells: Iterable[_Cell], key: Callable[[_Cell], Hashable]) -> dict[Hashable, _Cell]:
    cells = list(cells)
    counts = Counter(map(key, cells))
    return {key(cell): cell for cell in cells if counts[key(cell)] == 1}


def _without(cells: Iterable[_Cell], taken: Iterable[_Cell]) -> list[_Cell]:
    numbers = {(cell["part"], cell["cell"]) for cell in taken}
    return [cell for cell in cells if (cell["part"], cell["cell"]) not in numbers]


def _key(cell: _Cell, but: Iterable[str]) -> Levels:
    return tuple(sorted((k, v) for k, v in cell["levels"].items() if k not in set(but)))


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
        values: Of the measure `(n,)`.
        cell: Number of the cell in the first folder `(n,)`.
        person: Who `(n,)`.
        trial: Which `(n,)`.
        seed: Of the run `(n,)`.
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
        levels: What the cells have in common.
        runs: Runs of each folder that have a value.
        medians: Over these runs, of each folder.
        interval: Mean over persons of second minus first, with its 95 % interval.
        is_paired: Whether it rests on pairs of runs with the same luck.
        same: How many pairs have the very same value.
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
        """Whether nothing at all has changed."""
        return self.is_paired and self.same == self.runs[0] == self.runs[1]

    @property
    def is_told_from_zero(self) -> bool:
        """Whether the interval, taken for itself, leaves out zero."""
        return self.interval.low > 0 or self.interval.high < 0


def as_numbers(rows: Rows, name: str) -> Rows:
    """The same rows with floats for values: nan for missing ones, 1 and 0 for yes and no.

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
        levels: What the cells have in common.
        first: Rows of the first folder, as numbers.
        second: Those of the second.
    """
    a, b = first.means(), second.means()
    runs_a, runs_b = a.by_run(), b.by_run()
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
