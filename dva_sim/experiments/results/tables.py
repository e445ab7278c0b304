"""Parquet tables from rows of runs: the same bytes in any order of runs, on any workers."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dva_sim.experiments.results.results import TABLES, quoted
from dva_sim.experiments.study.cell_grid import RunKey, StudyRun
from dva_sim.experiments.study.parts import REPEATS
from dva_sim.kernel.errors import ConfigError, DvaSimError
from dva_sim.simulation.models import Tables

_BATCH_ROWS = 20_000
_BEFORE_LEVELS = ("part", "cell", "config")
_BEHIND_LEVELS = ("is_reference", "person", "trial", "seed")
DESIGN_COLUMNS = (*_BEFORE_LEVELS, *_BEHIND_LEVELS)

Value = bool | int | float | str | None
Row = dict[str, Value]
TablesOf = Callable[[RunKey], Tables | None]
Columns = dict[str, set[type]]


def write_tables(folder: Path, jobs: Sequence[StudyRun], tables_of: TablesOf) -> None:
    """Write `tables/<name>.parquet` for every table that some run filled.

    Rows are in the order of `jobs`: part, cell, person, trial. The runs of repeats make a table
    of their own. Memory stays bounded: rows pass in batches through a database file that is
    removed afterwards. Each run is read once; once more only if its first rows do not show what
    all the others hold.

    Args:
        folder: Results folder.
        jobs: The runs.
        tables_of: The tables of a run, by its key; None of one that is not done.

    Raises:
        DvaSimError: the disk is full or refuses to be written.
    """
    import duckdb

    target = folder / TABLES
    try:
        target.mkdir(exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".tables-", dir=folder) as name:
            originals = [job for job in jobs if not job.is_repeat]
            repeats = [job for job in jobs if job.is_repeat]
            made = _write(Path(name), originals, tables_of)
            made += _write(
                Path(name), repeats, lambda key: {REPEATS: (tables_of(key) or {}).get("runs", [])}
            )
            for path in made:
                path.replace(target / path.name)
        for stale in set(target.glob("*.parquet")) - {target / path.name for path in made}:
            stale.unlink()
    except (OSError, duckdb.Error) as error:
        reason = str(error).splitlines()[0]
        raise DvaSimError(
            f"tables cannot be written in {folder}: {reason}; finished runs are kept: "
            "mend that, then run the command again"
        ) from None


def design_row(job: StudyRun) -> Row:
    """Return the columns that say which run it was; a reference run has no levels."""
    return {
        "part": job.part,
        "cell": job.cell,
        "config": job.config,
        **job.levels,
        "is_reference": job.is_reference,
        "person": job.person,
        "trial": job.trial,
        "seed": job.seed,
    }


def _write(folder: Path, jobs: Sequence[StudyRun], tables_of: TablesOf) -> list[Path]:
    """Return all tables of some runs."""
    factors = dict.fromkeys(factor for job in jobs for factor in job.levels)
    design: Columns = {c: set() for c in (*_BEFORE_LEVELS, *factors, *_BEHIND_LEVELS)}
    tables: dict[str, _Table] = {}
    with ExitStack() as stack:
        for name, rows in _rows(jobs, tables_of):
            if name not in tables:
                tables[name] = stack.enter_context(_Table(folder, name, design))
            tables[name].add(rows)
        again = {
            name: stack.enter_context(table.emptied())
            for name, table in tables.items()
            if not table.is_whole()
        }
        for name, rows in _rows(jobs, tables_of) if again else ():
            if name in again:
                again[name].add(rows)
        return [table.save() for table in (tables | again).values()]


def _rows(jobs: Iterable[StudyRun], tables_of: TablesOf) -> Iterator[tuple[str, list[Row]]]:
    """Yield the rows of each table of each run, with the columns that say which run it was."""
    for job in jobs:
        design = design_row(job)
        for table, rows in (tables_of(job.key) or {}).items():
            if rows:
                yield table, [design | row for row in rows]


class _Table:
    """One table, made with the columns and types that its first batch of rows shows.

    Its database is its own and single-threaded, and its batches are of one size: so its bytes do
    not depend on the machine's mood.

    Args:
        folder: Folder of its file, and meanwhile of its database.
        name: Its name.
        types_of_columns: Columns already known, in order; further ones are found in rows.
    """

    def __init__(self, folder: Path, name: str, types_of_columns: Columns) -> None:
        self._folder = folder
        self._name = name
        self._seen = {column: set(types) for column, types in types_of_columns.items()}
        self._waiting: list[Row] = []
        self._kinds: dict[str, str] = {}  # of the table in the database, once it is made
        self._fits = True

    def __enter__(self) -> _Table:
        import duckdb

        config: dict[str, str | bool | int | float | list[str]]
        config = {"threads": 1, "preserve_insertion_order": True}
        odd = "?" in str(self._folder.absolute())  # behind which DuckDB expects options
        self._apart = tempfile.TemporaryDirectory(dir=None if odd else self._folder)
        file = Path(self._apart.name) / "rows.duckdb"
        self._database = duckdb.connect(str(file), config=config)
        return self

    def __exit__(self, *_: object) -> None:
        self._database.close()
        self._apart.cleanup()

    def add(self, rows: list[Row]) -> None:
        """Take some rows in."""
        self._waiting += rows
        while len(self._waiting) >= _BATCH_ROWS:
            self._pass_on()

    def is_whole(self) -> bool:
        """Return True if every row fitted the columns and types of the table."""
        self._pass_on()
        return self._fits

    def emptied(self) -> _Table:
        """Return an empty table for all columns and types seen so far."""
        return _Table(self._folder, self._name, self._seen)

    def save(self) -> Path:
        """Write it; the file."""
        self._pass_on()
        path = self._folder / f"{self._name}.parquet"
        self._database.execute("COPY rows TO $1 (FORMAT parquet, COMPRESSION zstd)", [str(path)])
        return path

    def _pass_on(self) -> None:
        """Pass a batch of waiting rows to the database, as long as its table fits them."""
        batch = self._waiting[:_BATCH_ROWS]
        self._waiting = self._waiting[_BATCH_ROWS:]
        columns = dict.fromkeys(chain(self._seen, *batch))
        values = {column: [row.get(column) for row in batch] for column in columns}
        for column, cells in values.items():
            self._seen.setdefault(column, set()).update(map(type, cells))
        kinds = {column: _sql_type(types) for column, types in self._seen.items()}
        if not self._kinds:
            text = ", ".join(f"{quoted(column)} {kind}" for column, kind in kinds.items())
            self._database.execute(f"CREATE TABLE rows ({text})")
            self._kinds = kinds
        self._fits = self._fits and kinds == self._kinds
        if self._fits and batch:
            try:
                arrays = {column: _array(values[column], kind) for column, kind in kinds.items()}
            except (TypeError, ValueError, OverflowError) as error:
                problem = f"table {self._name!r} cannot hold what a run has: {error}"
                raise ConfigError(problem) from None
            self._database.register("batch", arrays)
            self._database.execute("INSERT INTO rows SELECT * FROM batch")
            self._database.unregister("batch")


def _sql_type(types: set[type]) -> str:
    if str in types:
        return "VARCHAR"
    if float in types or types <= {type(None)}:
        return "DOUBLE"
    return "BIGINT" if int in types else "BOOLEAN"


def _array(values: list[Value], kind: str) -> NDArray[Any]:
    """Return a column for DuckDB; missing values are masked, and become NULL."""
    if kind == "VARCHAR":
        texts = [v if v is None or isinstance(v, str) else str(v) for v in values]
        return np.array(texts, dtype=object)
    dtype = {"DOUBLE": np.float64, "BIGINT": np.int64, "BOOLEAN": np.bool_}[kind]
    filled: NDArray[Any] = np.array([0 if v is None else v for v in values], dtype=dtype)
    if kind == "DOUBLE":
        filled += 0.0  # -0.0 becomes 0.0
    return np.ma.masked_array(filled, mask=[v is None for v in values])
