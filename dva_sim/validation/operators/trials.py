"""Trials of many persons as columns, and numbers of them with intervals.

A number is worth as much as it stays the same when other persons are drawn.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Values = dict[str, float]

RESAMPLES = 300
LEVEL = 0.95


@dataclass(frozen=True)
class Trials:
    """Trials of one cell, one after the other.

    Attributes:
        person: Person of each trial, from 0 `(n,)`.
        columns: Measured values by name `(n,)`; nan where there are none.
    """

    person: Ints
    columns: Mapping[str, Floats]

    def __getitem__(self, name: str) -> Floats:
        return self.columns[name]

    def __len__(self) -> int:
        return len(self.person)

    def where(self, keep: NDArray[np.bool_]) -> Trials:
        """Return those of the trials that a mask `(n,)` keeps."""
        return Trials(self.person[keep], {n: c[keep] for n, c in self.columns.items()})

    def by(self, *names: str) -> list[tuple[tuple[float, ...], Trials]]:
        """Return the trials of each combination of values of some columns, in rising order."""
        keys = np.column_stack([self.columns[name] for name in names])
        distinct = np.unique(keys, axis=0)
        return [(tuple(key.tolist()), self.where((keys == key).all(axis=1))) for key in distinct]

    def drawn(self, persons: Ints) -> Trials:
        """Return the trials of some persons, who count as often as they are drawn."""
        rows = np.concatenate([self._rows[p] for p in persons])
        number = np.concatenate([np.full(len(self._rows[p]), i) for i, p in enumerate(persons)])
        return Trials(number, {n: c[rows] for n, c in self.columns.items()})

    @cached_property
    def _rows(self) -> dict[int, Ints]:
        return {int(p): np.flatnonzero(self.person == p) for p in np.unique(self.person)}


Cells = Mapping[str, Trials]
Measure = Callable[[Cells], Values]


@dataclass(frozen=True)
class LineValue:
    """A simulated number.

    Attributes:
        value: The number.
        low: Lower end of the 95 % Monte Carlo interval over persons, given the model.
        high: Its other end; both equal `value` where nothing is left to chance.
        persons: Number of persons; 0: none.
    """

    value: float
    low: float
    high: float
    persons: int = 0


def certain(value: float) -> LineValue:
    """Return a number that rests on no persons."""
    return LineValue(value, value, value)


def collect(rows: Sequence[tuple[int, Sequence[Mapping[str, Any]]]]) -> Trials:
    """Return rows of each person as columns; what is no number is left out.

    Args:
        rows: Number of the person, and the rows.
    """
    person = np.array([p for p, own in rows for _ in own], dtype=np.int64)
    flat = [row for _, own in rows for row in own]
    names = [n for n, v in flat[0].items() if v is None or isinstance(v, int | float)]
    columns = {n: np.array([_number(row[n]) for row in flat]) for n in names}
    return Trials(person, columns)


def with_intervals(
    measure: Measure, cells: Cells, rng: np.random.Generator
) -> dict[str, LineValue]:
    """Return values of a measure with bootstrap intervals over persons.

    Args:
        measure: From trials to numbers.
        cells: Trials of the same persons in each.
        rng: Draws the persons.
    """
    persons = np.unique(next(iter(cells.values())).person)
    values = measure(cells)
    draws: dict[str, list[float]] = {name: [] for name in values}
    for _ in range(RESAMPLES):
        who = rng.choice(persons, len(persons))
        again = measure({name: trials.drawn(who) for name, trials in cells.items()})
        for name, drawn in draws.items():
            drawn.append(again[name])
    return {
        name: LineValue(float(value), *_middle(draws[name]), len(persons))
        for name, value in values.items()
    }


def _middle(draws: Sequence[float]) -> tuple[float, float]:
    """Return the central interval of the draws, nan excluded."""
    finite = [draw for draw in draws if not math.isnan(draw)]
    if not finite:
        return math.nan, math.nan
    tail = 0.5 * (1.0 - LEVEL)
    low, high = np.quantile(finite, [tail, 1.0 - tail])
    return float(low), float(high)


def person_means(trials: Trials, name: str) -> Floats:
    """Return the mean of each person `(persons,)`, without what is missing."""
    values = trials[name]
    is_finite = np.isfinite(trials[name])
    total = np.bincount(trials.person[is_finite], values[is_finite])
    count = np.bincount(trials.person[is_finite])
    return np.asarray(total[count > 0] / count[count > 0])


def person_means_of(trials: Trials, get: Callable[[Trials], Floats]) -> Floats:
    """Return the mean of each person of something made of its trials `(persons,)`."""
    values = get(trials)
    return np.asarray(np.bincount(trials.person, values) / np.bincount(trials.person))


def person_medians(trials: Trials, name: str) -> Floats:
    """Return the median of each person `(persons,)`."""
    values = trials[name]
    return np.array([np.nanmedian(values[trials.person == p]) for p in np.unique(trials.person)])


def mean(trials: Trials, name: str) -> float:
    """Return the mean over persons of their means."""
    means = person_means(trials, name)
    return float(means.mean()) if len(means) else float("nan")


def _number(value: Any) -> float:
    return float("nan") if value is None else float(value)
