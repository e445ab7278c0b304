"""Measures: each column of a table, described once, beside the code that computes it.

Tables, data dictionaries, reports and the measures of studies are derived from these objects. The
unit is the ending of the name, see `units`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

from dva_sim.kernel.units import unit_of
from dva_sim.kernel.wording import without_unit

# Units whose measures have a minimum of 0 unless stated otherwise.
_NEVER_NEGATIVE = frozenset({"s", "m", "m/s", "Hz", "bit/s", "B", "N s"})


@dataclass(frozen=True)
class Measure:
    """A column of a table of results.

    Attributes:
        name: Name of the column; it ends in the unit.
        meaning: Meaning in words, for the data dictionary.
        title: Name in reports; by default the name without its unit.
        better: Direction of improvement, where one can be stated.
        awaits: Event that a duration waits for, such as `confirmation`. A run without it counts
            with the whole time available.
        low: Minimum possible value; by default derived from the name and the unit.
        high: Maximum possible value; likewise.
        is_number: True for numbers; other columns cannot be requested as measures.
    """

    name: str
    meaning: str
    title: str = ""
    better: Literal["small", "large"] = "small"
    awaits: str = ""
    low: float | None = None
    high: float | None = None
    is_number: bool = True

    @property
    def unit(self) -> str:
        """Unit as printed; empty for a measure without one."""
        return unit_of(self.name)

    @property
    def words(self) -> str:
        """Name in reports."""
        return self.title or without_unit(self.name)

    @property
    def bounds(self) -> tuple[float, float]:
        """Minimum and maximum possible value."""
        is_share = self.name.endswith("_share")
        low = 0.0 if is_share or self.unit in _NEVER_NEGATIVE else -math.inf
        high = 1.0 if is_share else math.inf
        return low if self.low is None else self.low, high if self.high is None else self.high

    def as_json(self) -> dict[str, Any]:
        """Return the description for a results folder, readable without this class."""
        values = {"meaning": self.meaning, "title": self.title, "better": self.better}
        return values | ({} if self.is_number else {"is_number": False})


Columns = Mapping[str, tuple[Measure, ...]]
"""The columns of each table."""


def text(name: str, meaning: str) -> Measure:
    """Return a column of text, which cannot be requested as a measure."""
    return Measure(name, meaning, is_number=False)


def names_of(measures: Iterable[Measure]) -> tuple[str, ...]:
    """Return the names of numeric measures."""
    return tuple(measure.name for measure in measures if measure.is_number)
