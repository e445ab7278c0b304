"""Grid of runs, from their table to paired effects along the levels of a factor.

The runs of a part are laid out as a grid: one axis per factor, then person, then trial.
Subtracting two slices of it pairs them by person and trial, which is the whole method.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from dva_sim.experiments.study.parts import Level

Table = Mapping[str, NDArray[Any]]
Floats = NDArray[np.float64]
Setting = dict[str, Level]
_Entry = TypeVar("_Entry", np.float64, np.bool_)


@dataclass(frozen=True)
class Factor:
    """Factor of a study and its levels, in the order declared."""

    name: str
    levels: tuple[Level, ...]

    @property
    def is_numeric(self) -> bool:
        """True if all levels are quantities, so that "from ... on" makes sense."""
        return all(isinstance(v, int | float) and not isinstance(v, bool) for v in self.levels)


class RunGrid:
    """The runs of one part of a study, as a grid.

    Args:
        table: Columns of the table `runs`, or of another with the same leading columns.
        name: Name of the part.
        factors: Factors of the study; those missing from the table are left out.

    Attributes:
        levels: Levels of each factor, by its name.
        persons: All persons, ascending.
        trials: All trials, ascending.
        person: Person of each run of a cell `(persons * trials,)`.
        treated: Columns of the runs but for the references.
        references: Columns of the reference runs.
    """

    def __init__(self, table: Table, name: str, factors: Sequence[Factor]) -> None:
        self.name = name
        self.factors = tuple(f for f in factors if f.name in table)
        self.levels = {f.name: f.levels for f in self.factors}
        here = np.asarray(table["part"]) == name
        aside = np.asarray(table["is_reference"]).astype(bool)
        self.persons = np.unique(np.asarray(table["person"])[here])
        self.trials = np.unique(np.asarray(table["trial"])[here])
        self.person = self.persons.repeat(len(self.trials))
        self.treated = {key: np.asarray(values)[here & ~aside] for key, values in table.items()}
        self.references = {key: np.asarray(values)[here & aside] for key, values in table.items()}
        codes = [codes_of(self.treated, f) for f in self.factors]
        has_cell = np.all([c >= 0 for c in codes], axis=0) if codes else np.True_
        self._known = np.broadcast_to(has_cell, len(self.treated["person"]))
        self._index = (*codes, *self._who(self.treated))

    def _who(self, rows: Table) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        return (
            np.searchsorted(self.persons, rows["person"]),
            np.searchsorted(self.trials, rows["trial"]),
        )

    def __len__(self) -> int:
        return int(self._known.sum())

    def first_of_cells(self, column: str) -> list[Any]:
        """Return a column's value in the first run of each cell, in the order of `settings`."""
        shape = [len(f.levels) for f in self.factors]
        codes = tuple(i[self._known] for i in self._index[: len(shape)])
        cells = np.ravel_multi_index(codes, shape) if shape else np.zeros(len(self), int)
        numbers, first = np.unique(cells, return_index=True)
        rows = dict(zip(numbers.tolist(), np.flatnonzero(self._known)[first].tolist(), strict=True))
        values = self.treated[column]
        return [values[rows[i]] if i in rows else None for i in range(math.prod(shape))]

    @cached_property
    def ran(self) -> NDArray[np.bool_]:
        """Mark the cells `(levels of factor 1, ...)` that have at least one run."""
        ran = np.zeros([len(f.levels) for f in self.factors], dtype=bool)
        ran[tuple(i[self._known] for i in self._index[: len(self.factors)])] = True
        return ran

    def has(self, column: str) -> bool:
        """Return True if at least one run gives a number for this column."""
        values = self.treated.get(column)
        return values is not None and bool(np.isfinite(as_floats(values)).any())

    def grid(self, column: str) -> Floats:
        """Return one column as `(levels of factor 1, ..., persons, trials)`.

        Nan where no run is.
        """
        return self.laid_out(self.values(column))

    def values(self, column: str) -> Floats:
        """Return one column, a value for each run; nan where no run of the study has any."""
        if column not in self.treated:
            return np.full(len(self._known), np.nan)
        return as_floats(self.treated[column])

    def laid_out(self, values: Floats) -> Floats:
        """Return one value for each row of `treated`, as the same grid."""
        shape = (*(len(f.levels) for f in self.factors), len(self.persons), len(self.trials))
        grid = np.full(shape, np.nan)
        grid[tuple(i[self._known] for i in self._index)] = values[self._known]
        return grid

    def reference(self, column: str) -> Floats:
        """Return one column of the reference runs as `(persons, trials)`."""
        values = np.full((len(self.persons), len(self.trials)), np.nan)
        if column in self.references:
            values[self._who(self.references)] = as_floats(self.references[column])
        return values

    def excess(self, column: str) -> Floats:
        """Return the grid of a column less the reference run of the same person and trial."""
        return np.asarray(self.grid(column) - self.reference(column))

    def outcome(self, column: str) -> Floats:
        """Return the grid of a column, in excess of the reference if the column has one."""
        return self.excess(column) if self.has_reference(column) else self.grid(column)

    def has_reference(self, column: str) -> bool:
        """Return True if reference runs exist, so that an excess can be computed."""
        return bool(np.isfinite(self.reference(column)).any())

    def where(self, grid: NDArray[_Entry], setting: Mapping[str, Level]) -> NDArray[_Entry]:
        """Return the part of a grid at some levels; the axes of the other factors stay."""
        index = tuple(
            f.levels.index(setting[f.name]) if f.name in setting else slice(None)
            for f in self.factors
        )
        return np.asarray(grid[index])

    def at(self, setting: Mapping[str, Level]) -> NDArray[np.bool_]:
        """Mark the rows of `treated` at some levels; other factors may have any of theirs."""
        mask = self._known.copy()
        for factor, codes in zip(self.factors, self._index, strict=False):
            if factor.name in setting:
                mask &= codes == factor.levels.index(setting[factor.name])
        return mask

    def rows_at(self, setting: Mapping[str, Level]) -> dict[str, NDArray[Any]]:
        """Return columns of the runs at some levels."""
        here = self.at(setting)
        return {name: values[here] for name, values in self.treated.items()}

    def settings(self, but: Sequence[str] = ()) -> Iterator[Setting]:
        """Yield every combination of levels of the factors, except those named in `but`."""
        free = [f for f in self.factors if f.name not in but]
        for levels in itertools.product(*(f.levels for f in free)):
            yield {f.name: level for f, level in zip(free, levels, strict=True)}


def person_means(values: Floats) -> Floats:
    """Return `(stops, persons, trials)` to means over trials `(persons, stops)`.

    Nan where no trial.
    """
    return nan_mean(values, axis=-1).T


def nan_mean(values: Floats, axis: int) -> Floats:
    """Return the mean of the finite values; NaN without a warning if there is none."""
    is_finite = np.isfinite(values)
    count = is_finite.sum(axis=axis)
    total = np.where(is_finite, values, 0.0).sum(axis=axis)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def present(values: Floats) -> Floats:
    """Return the finite values, flat."""
    return values[np.isfinite(values)]


def as_floats(values: NDArray[Any]) -> Floats:
    """Return any column as floats: true is 1, nothing is nan, words are nan."""
    if values.dtype.kind in "biuf":
        return values.astype(float)
    numbers = int | float | np.number | np.bool_
    return np.array([float(v) if isinstance(v, numbers) else np.nan for v in values], dtype=float)


def codes_of(table: Table, factor: Factor) -> NDArray[np.intp]:
    """Index of each row's level of a factor; -1 if it matches none.

    The level None is where nothing stands, which in a column of numbers is read as nan.
    """
    values = np.asarray(table[factor.name])
    codes = np.full(len(values), -1, dtype=np.intp)
    for code, level in enumerate(factor.levels):
        if level is None:
            codes[[v is None or v != v for v in values.tolist()]] = code
        elif isinstance(level, int | float):
            codes[np.isclose(as_floats(values), float(level), rtol=1e-9, atol=1e-12)] = code
        else:
            codes[values.astype(str) == str(level)] = code
    return codes


def plain_level(value: Any) -> Level:
    """Return a level as it was declared: numpy's numbers as Python's."""
    plain: Level = value.item() if isinstance(value, np.generic) else value
    return plain
