"""From the table of runs to paired effects: who is compared with whom, and along what.

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

MOST_PANELS = 4


@dataclass(frozen=True)
class Factor:
    """What a study varies, and the levels it takes, in the order declared."""

    name: str
    levels: tuple[Level, ...]

    @property
    def is_numeric(self) -> bool:
        """Whether its levels are quantities, so that "from ... on" makes sense."""
        return all(isinstance(v, int | float) and not isinstance(v, bool) for v in self.levels)


class RunGrid:
    """The runs of one part of a study, as a grid.

    Args:
        table: Columns of the table `runs`, or of another with the same leading columns.
        name: Which part.
        factors: What the study varies; those that the table does not know are left out.
    """

    def __init__(self, table: Table, name: str, factors: Sequence[Factor]) -> None:
        self.name = name
        self.factors = tuple(f for f in factors if f.name in table)
        here = np.asarray(table["part"]) == name
        aside = np.asarray(table["is_reference"]).astype(bool)
        self.persons = np.unique(np.asarray(table["person"])[here])
        self.trials = np.unique(np.asarray(table["trial"])[here])
        self.treated = {key: np.asarray(values)[here & ~aside] for key, values in table.items()}
        self.references = {key: np.asarray(values)[here & aside] for key, values in table.items()}
        codes = [codes_of(self.treated, f) for f in self.factors]
        known = np.all([c >= 0 for c in codes], axis=0) if codes else np.True_
        self._known = np.broadcast_to(known, len(self.treated["person"]))
        self._index = (*codes, *self._who(self.treated))

    def _who(self, rows: Table) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        return (
            np.searchsorted(self.persons, rows["person"]),
            np.searchsorted(self.trials, rows["trial"]),
        )

    def __len__(self) -> int:
        return int(self._known.sum())

    def first_of_cells(self, column: str) -> list[Any]:
        """A column's value in the first run of each cell, in the order of `settings`."""
        shape = [len(f.levels) for f in self.factors]
        codes = tuple(i[self._known] for i in self._index[: len(shape)])
        cells = np.ravel_multi_index(codes, shape) if shape else np.zeros(len(self), int)
        known, first = np.unique(cells, return_index=True)
        rows = dict(zip(known.tolist(), np.flatnonzero(self._known)[first].tolist(), strict=True))
        values = self.treated[column]
        return [values[rows[i]] if i in rows else None for i in range(math.prod(shape))]

    @cached_property
    def ran(self) -> NDArray[np.bool_]:
        """Whether each cell `(levels of factor 1, ...)` has a run at all."""
        ran = np.zeros([len(f.levels) for f in self.factors], dtype=bool)
        ran[tuple(i[self._known] for i in self._index[: len(self.factors)])] = True
        return ran

    def has(self, column: str) -> bool:
        """Whether at least one run gives a number for this column."""
        values = self.treated.get(column)
        return values is not None and bool(np.isfinite(as_floats(values)).any())

    def grid(self, column: str) -> Floats:
        """One column as `(levels of factor 1, ..., persons, trials)`; nan where no run is."""
        return self.laid_out(self.values(column))

    def values(self, column: str) -> Floats:
        """One column, a value for each run; nan where no run of the study has any."""
        if column not in self.treated:
            return np.full(len(self._known), np.nan)
        return as_floats(self.treated[column])

    def laid_out(self, values: Floats) -> Floats:
        """One value for each row of `treated`, as the same grid."""
        shape = (*(len(f.levels) for f in self.factors), len(self.persons), len(self.trials))
        grid = np.full(shape, np.nan)
        grid[tuple(i[self._known] for i in self._index)] = values[self._known]
        return grid

    def reference(self, column: str) -> Floats:
        """One column of the reference runs as `(persons, trials)`."""
        values = np.full((len(self.persons), len(self.trials)), np.nan)
        if column in self.references:
            values[self._who(self.references)] = as_floats(self.references[column])
        return values

    def excess(self, column: str) -> Floats:
        """The grid of a column in excess of the reference run of the same person and trial."""
        return np.asarray(self.grid(column) - self.reference(column))

    def has_reference(self, column: str) -> bool:
        """Whether an excess can be taken at all."""
        return bool(np.isfinite(self.reference(column)).any())

    def where(self, grid: NDArray[_Entry], setting: Mapping[str, Level]) -> NDArray[_Entry]:
        """The part of a grid at some levels; the axes of the other factors stay."""
        index = tuple(
            f.levels.index(setting[f.name]) if f.name in setting else slice(None)
            for f in self.factors
        )
        return np.asarray(grid[index])

    def settings(self, but: Sequence[str] = ()) -> Iterator[Setting]:
        """Every combination of levels of the factors, except those named in `but`."""
        free = [f for f in self.factors if f.name not in but]
        for levels in itertools.product(*(f.levels for f in free)):
            yield {f.name: level for f, level in zip(free, levels, strict=True)}


@dataclass(frozen=True)
class StudyView:
    """How a reader looks at a part: what runs along x, what is a line, what is a panel.

    Attributes:
        part: The runs.
        measure: Column the question is about.
        line: Factor with a line for each level, or None.
        over: Factor along x, or None.
        contrast: The two levels of `line` compared, the first minus the second; or None.
        within: The panel that the answer speaks of.
        smallest_effect: Smallest difference declared to matter, in the measure's unit.
        outside: Whether each cell `(levels of factor 1, ...)` is an extrapolation, beyond the
            delays at which people were watched; None where nothing is known of that.
        possible: The least and the greatest value that the measure can take at all.
        averages_points: Whether the trials are points in ranges, over which means are taken.
    """

    part: RunGrid
    measure: str
    line: Factor | None
    over: Factor | None
    contrast: tuple[Level, Level] | None
    within: Setting
    smallest_effect: float | None = None
    outside: NDArray[np.bool_] | None = None
    possible: tuple[float, float] = (-math.inf, math.inf)
    averages_points: bool = False

    @property
    def lines(self) -> tuple[Level, ...]:
        """Levels of the line factor; a single None where there is none."""
        return self.line.levels if self.line else (None,)

    @property
    def stops(self) -> tuple[Level, ...]:
        """Levels along x; a single None where there is none."""
        return self.over.levels if self.over else (None,)

    @property
    def panels(self) -> list[Setting]:
        """Settings of all other factors, the last fastest; of each, the answer's level first.

        Settings that the design leaves out are no panels.
        """
        names = [f.name for f in (self.line, self.over) if f]
        every = list(self.part.settings(but=names))
        order = sorted(every, key=lambda panel: [self._is_aside(*item) for item in panel.items()])
        return [panel for panel in order if self.part.where(self.part.ran, panel).any()] or order

    @property
    def shown(self) -> list[Setting]:
        """The panels that a figure has room for."""
        return self.panels[:MOST_PANELS]

    def _is_aside(self, factor: str, level: Level) -> bool:
        return level != self.within.get(factor, level)

    @property
    def widest(self) -> float:
        """The greatest difference between two values that the measure can take."""
        return self.possible[1] - self.possible[0]

    def setting(self, panel: Setting, line: Level) -> Setting:
        """The levels that a line of a panel stands for."""
        return dict(panel) | ({self.line.name: line} if self.line else {})

    def along_x(self) -> dict[str, Any]:
        """The levels along x under their factor's name; nothing where there is no such factor."""
        return {self.over.name: self.over.levels} if self.over else {}

    def at_stop(self, stop: int) -> Setting:
        """The level along x of one stop."""
        return {self.over.name: self.over.levels[stop]} if self.over else {}

    def curve(self, grid: Floats, panel: Setting, line: Level) -> Floats:
        """Values along x as `(stops, persons, trials)`."""
        values = self.part.where(grid, self.setting(panel, line))
        return values if self.over else values[np.newaxis]

    @property
    def values(self) -> Floats:
        """The measure as it is judged: in excess of the reference wherever there is one."""
        if self.part.has_reference(self.measure):
            return self.part.excess(self.measure)
        return self.part.grid(self.measure)

    def stops_outside(self, panel: Setting, lines: Sequence[Level] | None = None) -> list[int]:
        """The stops of a panel at which at least one line, of some or all, is an extrapolation."""
        if self.outside is None:
            return []
        some = self.lines if lines is None else lines
        marks = np.array([self._marks(panel, line) for line in some]).any(axis=0)
        return [int(stop) for stop in np.flatnonzero(marks)]

    def _marks(self, panel: Setting, line: Level) -> NDArray[np.bool_]:
        outside = np.asarray(self.outside, dtype=float)
        return np.atleast_1d(self.part.where(outside, self.setting(panel, line)) > 0)

    def difference(self, panel: Setting, first: Level, second: Level) -> Floats:
        """First minus second, paired by person and trial, as person means `(persons, stops)`."""
        grid = self.values
        return person_means(self.curve(grid, panel, first) - self.curve(grid, panel, second))


def person_means(values: Floats) -> Floats:
    """`(stops, persons, trials)` to means over trials `(persons, stops)`; nan where no trial."""
    return nan_mean(values, axis=-1).T


def nan_mean(values: Floats, axis: int) -> Floats:
    """Mean of what is there; nan, in silence, where nothing is."""
    there = np.isfinite(values)
    count = there.sum(axis=axis)
    total = np.where(there, values, 0.0).sum(axis=axis)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def present(values: Floats) -> Floats:
    """The finite values, flat."""
    return values[np.isfinite(values)]


def as_floats(values: NDArray[Any]) -> Floats:
    """Any column as floats: true is 1, nothing is nan, words are nan."""
    if values.dtype.kind in "biuf":
        return values.astype(float)
    return np.array([_float(v) for v in values], dtype=float)


def _float(value: Any) -> float:
    return float(value) if isinstance(value, int | float | np.number | np.bool_) else np.nan


def codes_of(table: Table, factor: Factor) -> NDArray[np.intp]:
    """Which level of a factor each row has; -1 for none of them.

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
    """A level as it was declared: numpy's numbers as Python's."""
    plain: Level = value.item() if isinstance(value, np.generic) else value
    return plain
