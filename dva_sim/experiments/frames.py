"""A table as columns of numpy arrays, which other tools can take over."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from dva_sim.guesses import listed

if TYPE_CHECKING:
    from duckdb import DuckDBPyRelation

_SHOWN = 10  # rows in a notebook

Array = NDArray[Any]


class Frame(dict[str, Array]):
    """Columns by name, each of shape `(n,)`.

    Missing values are nan in columns of numbers and None in all others.
    """

    @property
    def rows(self) -> int:
        """How many rows it has."""
        return len(next(iter(self.values()), ()))

    def where(self, rows: Array) -> Frame:
        """Some rows, by a mask or by their numbers."""
        return Frame({name: values[rows] for name, values in self.items()})

    def to_pandas(self) -> Any:
        """The same as a pandas.DataFrame; pandas must be installed.

        Raises:
            ModuleNotFoundError: it is not.
        """
        return import_module("pandas").DataFrame(dict(self))

    def to_duckdb(self) -> DuckDBPyRelation:
        """The same as a relation of duckdb, to ask by SQL; missing numbers are NULL."""
        import duckdb

        connection = duckdb.connect()
        connection.register("rows", {name: _masked(values) for name, values in self.items()})
        return connection.table("rows")

    def __repr__(self) -> str:
        return f"Frame of {self.rows} rows, {len(self)} columns: {listed(self)}"

    def _repr_html_(self) -> str:
        heads = "".join(f"<th>{escape(name)}</th>" for name in self)
        body = "".join(f"<tr>{self._html_row(row)}</tr>" for row in range(self.rows)[:_SHOWN])
        table = f"<table><thead><tr>{heads}</tr></thead><tbody>{body}</tbody></table>"
        return f"{table}<p>{self.rows} rows</p>"

    def _html_row(self, row: int) -> str:
        return "".join(f"<td>{escape(plain(values[row]))}</td>" for values in self.values())


def frame_of(rows: Sequence[Mapping[str, Any]]) -> Frame:
    """Rows as columns; what a row does not say is missing."""
    names = dict.fromkeys(name for row in rows for name in row)
    return Frame({name: _column([row.get(name) for row in rows]) for name in names})


def _column(values: list[Any]) -> Array:
    types = {type(value) for value in values}
    if str in types or types == {type(None)}:
        return np.array(values, dtype=object)
    if type(None) in types:
        return np.array([np.nan if value is None else value for value in values], dtype=float)
    return np.array(values)


def plain(value: Any) -> str:
    """A value as text: four figures of a number, nothing for what is missing."""
    if value is None or (isinstance(value, float) and np.isnan(value)):
        return ""
    if isinstance(value, bool | np.bool_):
        return "yes" if value else "no"
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def without_mask(column: Array) -> Array:
    """A column without numpy's mask; whole numbers with missing values come as floats."""
    if not isinstance(column, np.ma.MaskedArray):
        return column
    if column.dtype.kind == "f":
        return np.ma.filled(column, np.nan)
    missing = np.ma.getmaskarray(column)
    if not missing.any():
        return np.asarray(column.data)
    if column.dtype.kind in "iu":
        return np.where(missing, np.nan, column.data)
    values = column.data.astype(object)
    values[missing] = None
    return np.asarray(values)


def _masked(values: Array) -> Array:
    """A column for duckdb, which takes what is masked for NULL."""
    if values.dtype.kind != "f":
        return values
    return np.ma.masked_array(values, mask=np.isnan(values))
