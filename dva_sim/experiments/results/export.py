"""Tables for other programs: CSV or Parquet, each table a file, with what the columns mean."""

from __future__ import annotations

import csv
import shutil
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from dva_sim.experiments.results.results import Results, escaped, quoted
from dva_sim.kernel.csv_cells import ACTS, HIDES, SHOWN, harmless, harmless_row
from dva_sim.kernel.errors import ConfigError, DvaSimError
from dva_sim.kernel.resources import refuse_to_replace
from dva_sim.kernel.suggestions import either
from dva_sim.kernel.whole_files import whole

FORMATS = ("csv", "parquet")
DICTIONARY = "columns.csv"


def export(
    results: Results,
    out: Path,
    tables: Sequence[str] = (),
    form: str | None = None,
    overwrite: bool = False,
) -> list[Path]:
    """Write tables of results as files.

    A name that ends in `.csv` or `.parquet` is one table, `runs` if none is named. Any other
    is a folder for all of them or those named, with their dictionary in `columns.csv`. Missing
    values are empty in CSV. The same results give the same bytes.

    Args:
        out: File or folder.
        tables: Names of tables.
        form: `csv` (the default of folders) or `parquet`.
        overwrite: Replace what is there already.

    Returns:
        What was written.

    Raises:
        ConfigError: no such table or format, or a file that is there already.
        DvaSimError: the disk is full or refuses to be written.
    """
    if not str(out).isprintable():
        raise ConfigError(f"{str(out)!r} cannot be a file name")
    files = _files(results, out, tables, form)
    refuse_to_replace(files, overwrite)
    for path, write in files.items():
        _put(path, write)
    return list(files)


_Write = Callable[[Path], object]


def _files(
    results: Results, out: Path, tables: Sequence[str], form: str | None
) -> dict[Path, _Write]:
    """Return writers of the output files, by path."""
    if form is not None and form not in FORMATS:
        raise ConfigError(f"--format {form!r} should be {either(FORMATS)}")
    ending = out.suffix.removeprefix(".")
    if ending in FORMATS and not out.is_dir():
        if form not in (None, ending) or len(tables) > 1:
            raise ConfigError(f"{out} is one {ending} file; give a folder for several, or another")
        return {out: _writer(results, tables[0] if tables else "runs", ending)}
    if out.suffix and not out.is_dir():
        allowed = either(f".{name}" for name in FORMATS)
        raise ConfigError(f"{out} should end in {allowed}; a folder for all tables has no ending")
    if out.is_file():
        raise ConfigError(
            f"{out} is a file; give a folder, or a name that ends in .csv or .parquet"
        )
    names = tables or results.tables
    ending = form or "csv"
    files = {out / f"{name}.{ending}": _writer(results, name, ending) for name in names}
    return files | {out / DICTIONARY: partial(_write_dictionary, results, names)}


def _writer(results: Results, table: str, form: str) -> _Write:
    write = shutil.copyfile if form == "parquet" else _write_csv
    return partial(write, results.path_of(table))


# How a cell is written, by the type of its column; no text acts in a spreadsheet.
_CELLS = {
    "DOUBLE": "nullif({0}, 'nan')",
    "VARCHAR": "regexp_replace(CASE WHEN regexp_matches({0}, '"
    + ACTS
    + "') THEN '''' || {0} ELSE {0} END, '"
    + HIDES
    + f"', '{SHOWN}', 'g')",
}


def _write_csv(source: Path, path: Path) -> None:
    """Write a table as CSV; nan and missing values both become empty cells."""
    import duckdb

    with duckdb.connect(config={"threads": 1}) as connection:
        rows = connection.read_parquet(escaped(source))
        columns = ", ".join(
            f"{_CELLS.get(str(kind), '{0}').format(quoted(n))} AS {quoted(harmless(n))}"
            for n, kind in zip(rows.columns, rows.types, strict=True)
        )
        rows.project(columns).write_csv(str(path), header=True)


def _write_dictionary(results: Results, tables: Sequence[str], path: Path) -> None:
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("table", "column", "unit", "meaning"))
        for table in tables:
            writer.writerows(map(harmless_row, results.columns(table)))


def _put(path: Path, write: _Write) -> None:
    """Put a file there whole or not at all."""
    import duckdb

    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with whole(path) as part:
            write(part)
    except (OSError, duckdb.Error) as error:
        reason = str(error).splitlines()[0]
        raise DvaSimError(f"{path} cannot be written: {reason}") from None
