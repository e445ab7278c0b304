"""Read a results folder: the manifest, and the tables as columns of numpy arrays."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dva_sim.errors import ConfigError

MANIFEST = "manifest.json"
TABLES = "tables"

Columns = dict[str, NDArray[Any]]


@dataclass(frozen=True)
class Results:
    """What a study left behind.

    Every table begins with the design columns `part`, `cell` (position in the grid, -1 for
    a reference run), `config` (hash of the resolved scenario), one column per factor under
    its dotted key, `is_reference`, `person`, `trial` and `seed`; the measures follow.

    Attributes:
        folder: Where it lies.
        manifest: The study as resolved, its base scenarios, `--set` list, versions, failures.
    """

    folder: Path
    manifest: dict[str, Any]

    @classmethod
    def load(cls, folder: str | Path) -> Results:
        """Open a results folder.

        Raises:
            ConfigError: it is not one, or its study has not been completed.
        """
        path = Path(folder) / MANIFEST
        try:
            manifest = json.loads(path.read_text(encoding="utf-8"))
        except FileNotFoundError:
            raise ConfigError(_not_results(Path(folder))) from None
        except (OSError, ValueError) as error:
            raise ConfigError(f"cannot be read as a manifest: {error}", path) from None
        if not isinstance(manifest, dict) or "study" not in manifest:
            raise ConfigError("is not the manifest of a study", path)
        return cls(Path(folder), manifest)

    @property
    def study(self) -> dict[str, Any]:
        """The study as resolved: question, seed, persons, replications, factors, parts."""
        return dict(self.manifest["study"])

    @property
    def factors(self) -> dict[str, list[Any]]:
        """Levels of each factor, in the order declared."""
        return dict(self.study["factors"])

    @property
    def answer(self) -> dict[str, Any] | None:
        """The declared contrast, if there is one."""
        return self.study.get("answer")

    @property
    def failures(self) -> list[dict[str, Any]]:
        """Runs that failed: their design columns and the `error`."""
        return list(self.manifest.get("failures", []))

    @property
    def tables(self) -> list[str]:
        """Names of the tables."""
        return sorted(path.stem for path in (self.folder / TABLES).glob("*.parquet"))

    def has(self, name: str) -> bool:
        """Whether the study wrote a table of that name."""
        return name in self.tables

    def table(self, name: str, part: str | None = None) -> Columns:
        """The columns of a table, in the order of the rows (part, cell, person, trial).

        Missing values are nan in columns of numbers and None in all others; a column of
        whole numbers with missing values comes as floats.

        Args:
            name: `runs`, `events`, `tracks`, ...
            part: Only the rows of this part.

        Raises:
            ConfigError: no such table, or a damaged file.
        """
        import duckdb

        if not self.has(name):
            there = ", ".join(self.tables) or "none"
            raise ConfigError(f"{self.folder} has no table {name!r}; tables: {there}")
        query = "SELECT * FROM read_parquet(?)" + (" WHERE part = ?" if part is not None else "")
        file = str(self.folder / TABLES / f"{name}.parquet")
        try:
            with duckdb.connect(config={"threads": 1}) as connection:
                values = [file] if part is None else [file, part]
                columns = connection.execute(query, values).fetchnumpy()
        except duckdb.Error as error:
            raise ConfigError(f"cannot be read: {str(error).splitlines()[0]}", file) from None
        return {key: _plain(column) for key, column in columns.items()}


def _not_results(folder: Path) -> str:
    if not folder.is_dir():
        return f"{folder} is not a folder; give the folder that 'dva-sim run' wrote"
    return f"{folder} holds no finished results: it has no {MANIFEST}; finish the study first"


def _plain(column: NDArray[Any]) -> NDArray[Any]:
    """A column without numpy's mask."""
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
