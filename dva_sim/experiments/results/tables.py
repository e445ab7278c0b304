"""From the rows of runs to Parquet: the same bytes whoever ran what, and in which order."""

from __future__ import annotations

import tempfile
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from dva_sim.experiments.results.results import TABLES, quoted
from dva_sim.experiments.study.cell_grid import RunKey, StudyRun
from dva_sim.experiments.study.parts import REPEATS
from dva_sim.kernel.errors import DvaSimError
from dva_sim.simulation.models import Tables

if TYPE_CHECKING:
    from duckdb import DuckDBPyConnection


_BATCH_ROWS = 20_000
_BEFORE_LEVELS = ("part", "cell", "config")
_BEHIND_LEVELS = ("is_reference", "person", "trial", "seed")
DESIGN_COLUMNS = (*_BEFORE_LEVELS, *_BEHIND_LEVELS)

Value = bool | int | float | str | None
Row = dict[str, Value]
TablesOf = Callable[[RunKey], Tables | None]


def write_tables(folder: Path, jobs: Sequence[StudyRun], tables_of: TablesOf) -> None:
    """Write `tables/<name>.parquet` for every table that some run filled.

    Rows are in the order of `jobs`: part, cell, person, trial. The runs of repeats make a table
    of their own. Memory stays bounded: rows pass in batches through a database file that is
    removed afterwards.

    Args:
        folder: Of the results.
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
            own = [job for job in jobs if not job.is_repeat]
            repeats = [job for job in jobs if job.is_repeat]
            made = [
                _write(Path(name), table, kinds, _rows(own, tables_of, table))
                for table, kinds in _columns(own, tables_of).items()
            ]
            if kinds := _columns(repeats, tables_of).get("runs"):
                made.append(_write(Path(name), REPEATS, kinds, _rows(repeats, tables_of, "runs")))
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
    """The columns that say which run it was; a reference run has no levels."""
    return {
        "part": job.part,
        "cell": job.index,
        "config": job.config,
        **dict(job.cell),
        "is_reference": job.is_reference,
        "person": job.person,
        "trial": job.trial,
        "seed": job.seed,
    }


def _rows(jobs: Iterable[StudyRun], tables_of: TablesOf, table: str) -> Iterator[Row]:
    for job in jobs:
        design = design_row(job)
        for row in (tables_of(job.key) or {}).get(table, ()):
            yield design | row


def _columns(jobs: Iterable[StudyRun], tables_of: TablesOf) -> dict[str, dict[str, str]]:
    """The SQL type of every column of every table, in the order first met."""
    factors = dict.fromkeys(factor for job in jobs for factor, _ in job.cell)
    order = (*_BEFORE_LEVELS, *factors, *_BEHIND_LEVELS)
    kinds: dict[str, dict[str, set[type]]] = {}
    for job in jobs:
        design = design_row(job)
        for table, rows in (tables_of(job.key) or {}).items():
            if rows:
                seen = kinds.setdefault(table, defaultdict(set, {c: set() for c in order}))
                for row in (design, *rows):
                    for column, value in row.items():
                        seen[column].add(type(value))
    return {t: {c: _sql_type(types) for c, types in seen.items()} for t, seen in kinds.items()}


def _sql_type(types: set[type]) -> str:
    if str in types:
        return "VARCHAR"
    if float in types or types <= {type(None)}:
        return "DOUBLE"
    return "BIGINT" if int in types else "BOOLEAN"


def _write(folder: Path, table: str, kinds: dict[str, str], rows: Iterator[Row]) -> Path:
    """One table, single-threaded so that its bytes do not depend on the machine's mood."""
    import duckdb

    path = folder / f"{table}.parquet"
    config: dict[str, str | bool | int | float | list[str]]
    config = {"threads": 1, "preserve_insertion_order": True}
    with duckdb.connect(str(folder / f"{table}.duckdb"), config=config) as connection:
        columns = ", ".join(f"{quoted(c)} {kind}" for c, kind in kinds.items())
        connection.execute(f"CREATE TABLE rows ({columns})")
        while batch := list(islice(rows, _BATCH_ROWS)):
            _insert(connection, kinds, batch)
        connection.execute("COPY rows TO $1 (FORMAT parquet, COMPRESSION zstd)", [str(path)])
    return path


def _insert(connection: DuckDBPyConnection, kinds: dict[str, str], batch: list[Row]) -> None:
    arrays = {c: _array([row.get(c) for row in batch], kind) for c, kind in kinds.items()}
    connection.register("batch", arrays)
    connection.execute("INSERT INTO rows SELECT * FROM batch")
    connection.unregister("batch")


def _array(values: list[Value], kind: str) -> NDArray[Any]:
    """A column for DuckDB; what is missing is masked, and becomes NULL."""
    if kind == "VARCHAR":
        texts = [v if v is None or isinstance(v, str) else str(v) for v in values]
        return np.array(texts, dtype=object)
    dtype = {"DOUBLE": np.float64, "BIGINT": np.int64, "BOOLEAN": np.bool_}[kind]
    filled: NDArray[Any] = np.array([0 if v is None else v for v in values], dtype=dtype)
    return np.ma.masked_array(filled, mask=[v is None for v in values])
