"""Numbers of a figure, noted as they are drawn, for a CSV file beside it."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from dva_sim.kernel.csv_cells import harmless, harmless_row
from dva_sim.kernel.units import ending_of

if TYPE_CHECKING:
    pass


_DIGITS = 9


class Numbers:
    """Rows that say where (levels of factors, names) and what (numbers)."""

    def __init__(self) -> None:
        self._rows: list[dict[str, Any]] = []

    def add(self, where: Mapping[str, Any], columns: Mapping[str, Iterable[Any]]) -> None:
        """Add one row for each entry of the columns, which are of one length.

        Args:
            where: Levels and names that hold for all these rows.
            columns: Numbers, or levels, of each row.
        """
        for row in zip(*columns.values(), strict=True):
            self._rows.append(dict(where) | dict(zip(columns, row, strict=True)))

    def row(self, where: Mapping[str, Any], **columns: Any) -> None:
        """Add a single row."""
        self._rows.append(dict(where) | columns)

    def csv(self) -> bytes:
        """Return comma-separated text with a heading; missing values are empty."""
        heads = list(dict.fromkeys(key for row in self._rows for key in row))
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(harmless_row(heads))
        writer.writerows([_text(harmless(row.get(h))) for h in heads] for row in self._rows)
        return text.getvalue().encode()


def with_unit(word: str, measure: str) -> str:
    """Return `mean_s` for the mean of a measure in seconds."""
    ending = ending_of(measure)
    return f"{word}_{ending}" if ending else word


def in_units(measure: str, **columns: Any) -> dict[str, Any]:
    """Columns of a measure, such as its mean and limits, under names that end in its unit."""
    return {with_unit(word, measure): values for word, values in columns.items()}


def with_limits(column: str, middle: Any, low: Any, high: Any) -> dict[str, Any]:
    """Return a column with its limits: `response_s`, `response_low_s` and `response_high_s`."""
    stem = column.removesuffix(f"_{ending_of(column)}")
    return {column: middle} | in_units(column, **{f"{stem}_low": low, f"{stem}_high": high})


def _text(value: Any) -> str:
    if value is None or isinstance(value, str):
        return value or ""
    if isinstance(value, bool | np.bool_):
        return str(bool(value)).lower()
    if isinstance(value, float | np.floating):
        return "" if np.isnan(value) else f"{float(value):.{_DIGITS}g}"
    return str(value)
