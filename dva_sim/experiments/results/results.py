"""Results folder: the manifest, and tables as columns of numpy arrays.

Nothing is concluded or drawn here: `experiments.report` reads results, and `dva_sim.Results` adds
what it finds. The data dictionary says what every column means: times of events are seconds of the
run; what did not happen is missing (nan, or empty in CSV); columns `*_share` are from 0 to 1, and
columns of counts have no unit. What is measured is said where it is computed (`Model.columns`).
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from html import escape
from importlib import import_module
from pathlib import Path
from textwrap import shorten
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, Field, ValidationError

from dva_sim.experiments.study.designs import MAX_RUNS
from dva_sim.experiments.study.parts import DESIGN, REPEATS, Level
from dva_sim.experiments.study.study import Status, Study
from dva_sim.kernel.config import Config, Scalar, first_mistake
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.suggestions import hint, listed
from dva_sim.kernel.units import unit_of
from dva_sim.simulation.models import MODELS

if TYPE_CHECKING:
    from duckdb import DuckDBPyConnection, DuckDBPyRelation


OwnColumns = Mapping[str, Mapping[str, Mapping[str, Any]]]
"""Meanings of users' own columns, kept in the results folder, by table and name."""


class Column(NamedTuple):
    """A line of the dictionary.

    Attributes:
        table: Name of the table.
        unit: Unit as printed; empty for none.
        meaning: Meaning in words; empty if nothing is known of it.
    """

    table: str
    name: str
    unit: str
    meaning: str


def describe(
    table: str,
    columns: Sequence[str],
    models: Sequence[str],
    factors: Sequence[str],
    own_columns: OwnColumns | None = None,
) -> list[Column]:
    """Describe some columns of a table of results.

    Args:
        table: Its name.
        columns: Their names.
        models: Those of the study's parts; where meanings differ, all are given.
        factors: Names of the study's factors.
        own_columns: Descriptions of user-defined columns, from the results.
    """
    table_of = "runs" if table == REPEATS else table
    added = (own_columns or {}).get(table_of, {})
    return [
        Column(table, name, unit_of(name), _meaning(table_of, name, models, factors, added))
        for name in columns
    ]


def _meaning(
    table: str,
    name: str,
    models: Iterable[str],
    factors: Sequence[str],
    added: Mapping[str, Mapping[str, Any]],
) -> str:
    if name in factors:
        return f"factor of the study: the scenario key {name}"
    if name in DESIGN:
        return DESIGN[name]
    if name in added:
        return str(added[name]["meaning"])
    meanings = {model: meaning for model in models if (meaning := _of_model(model, table, name))}
    if len(set(meanings.values())) <= 1:
        return next(iter(meanings.values()), "")
    return "; ".join(f"{model}: {meaning}" for model, meaning in meanings.items())


def _of_model(model: str, table: str, name: str) -> str:
    """Return the meaning of a column in a shipped model; empty for other models."""
    columns = MODELS[model].columns.get(table, ()) if model in MODELS else ()
    return next((column.meaning for column in columns if column.name == name), "")


_SHOWN = 10  # rows in a notebook

Array = NDArray[Any]


class Frame(dict[str, Array]):
    """Columns by name, each of shape `(n,)`.

    Missing values are nan in columns of numbers and None in all others.
    """

    @property
    def rows(self) -> int:
        """Number of rows."""
        return len(next(iter(self.values()), ()))

    def where(self, rows: Array | slice) -> Frame:
        """Return some rows, by a mask or by their numbers."""
        return Frame({name: values[rows] for name, values in self.items()})

    def to_rows(self) -> list[dict[str, Any]]:
        """Return the row by row, each with its value of every column."""
        columns = [values.tolist() for values in self.values()]
        return [dict(zip(self, row, strict=True)) for row in zip(*columns, strict=True)]

    def to_pandas(self) -> Any:
        """Convert to a pandas.DataFrame.

        Raises:
            ConfigError: pandas is not installed.
        """
        try:
            return import_module("pandas").DataFrame(dict(self))
        except ModuleNotFoundError:
            raise ConfigError("to_pandas needs pandas: pip install pandas") from None

    def to_polars(self) -> Any:
        """Convert to a polars.DataFrame; missing values are null.

        Raises:
            ConfigError: polars is not installed.
        """
        try:
            frame = import_module("polars").DataFrame
        except ModuleNotFoundError:
            raise ConfigError("to_polars needs polars: pip install polars") from None
        columns = {
            name: values.tolist() if values.dtype == object else values
            for name, values in self.items()
        }
        return frame(columns, nan_to_null=True)

    def to_duckdb(self) -> DuckDBPyRelation:
        """Convert to a DuckDB relation for SQL queries; missing numbers are NULL."""
        import duckdb

        connection = duckdb.connect()
        connection.register("rows", {name: _masked(values) for name, values in self.items()})
        return connection.table("rows")

    def __repr__(self) -> str:
        return f"Frame of {self.rows} rows, {len(self)} columns: {listed(self)}"

    def _repr_html_(self) -> str:
        heads = "".join(f"<th>{escape(name)}</th>" for name in self)
        rows = [map(plain, row.values()) for row in self.where(slice(_SHOWN)).to_rows()]
        cells = ("".join(f"<td>{escape(text)}</td>" for text in row) for row in rows)
        body = "".join(f"<tr>{row}</tr>" for row in cells)
        table = f"<table><thead><tr>{heads}</tr></thead><tbody>{body}</tbody></table>"
        return f"{table}<p>{self.rows} rows</p>"


def frame_of(rows: Sequence[Mapping[str, Any]]) -> Frame:
    """Return rows as columns; values absent from a row are missing."""
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
    """Return a value as text: four digits of a number, nothing for a missing value."""
    if value is None or (isinstance(value, float) and np.isnan(value)):
        return ""
    if isinstance(value, bool | np.bool_):
        return "yes" if value else "no"
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def without_mask(column: Array) -> Array:
    """Return a column without numpy's mask; whole numbers with missing values come as floats."""
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
    """Return a column for duckdb, with masked values as NULL."""
    if values.dtype.kind != "f":
        return values
    return np.ma.masked_array(values, mask=np.isnan(values))


MANIFEST = "manifest.json"
MACHINE = "machine.json"
JOURNAL = "journal.sqlite"  # of a study that runs; see `execution.checkpoint`
TABLES = "tables"
_NOT_AS_WRITTEN = "is damaged, edited or of other results; the study's command makes it again"


def digests(folder: Path) -> dict[str, str]:
    """Return SHA-256 of every table in a folder, by the table's name."""
    return {path.stem: digest_of(path) for path in sorted(folder.glob("*.parquet"))}


def digest_of(path: Path) -> str:
    """Return SHA-256 of a file."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def missing_tables(reasons: Mapping[str, str]) -> str:
    """Return which tables cannot be made, each with its reason."""
    return "; ".join(f"table {name!r} cannot be made: {why}" for name, why in reasons.items())


class _Cell(Config):
    """A configuration of a study."""

    part: str
    cell: Annotated[int, Field(ge=-1, le=MAX_RUNS)]
    config: str
    levels: dict[str, Level]


class _LinkNumbers(Config):
    """Numbers of a link that reports calculate with."""

    model_config = ConfigDict(extra="allow")

    delay_s: float | None = None
    jitter_s: float | None = None
    rate_bps: float | None = None
    up: _LinkNumbers | None = None
    down: _LinkNumbers | None = None


class _Played(Config):
    """Scenario of a manifest, as far as reports calculate with it."""

    model_config = ConfigDict(extra="allow")

    model: Literal[tuple(MODELS)] = "full"  # type: ignore[valid-type]
    horizon_s: float | None = None
    link: _LinkNumbers | None = None
    robot: dict[str, Any] = Field(default_factory=dict)
    command: dict[str, Scalar] = Field(default_factory=dict)


class _Manifest(Config):
    """Form of a manifest, as far as it is read; the study's is that of its file."""

    model_config = ConfigDict(extra="allow")

    study: Study
    question: str = ""
    status: Status | None = None
    scenarios: dict[str, _Played] = Field(default_factory=dict)
    set: list[str | tuple[str, Any]] = Field(default_factory=list)
    changes: dict[str, Any] = Field(default_factory=dict)
    cells: list[_Cell] = Field(default_factory=list)
    runs: Annotated[int, Field(ge=0, le=MAX_RUNS)] = 0
    versions: dict[str, str | bool | None] = Field(default_factory=dict)
    stopped: dict[str, Scalar] | None = None
    failures: list[dict[str, Scalar]] = Field(default_factory=list)
    tables: dict[str, str] = Field(default_factory=dict)
    columns: dict[str, dict[str, dict[str, Any]]] = Field(default_factory=dict)


def checked_manifest(manifest: Any, file: Path) -> dict[str, Any]:
    """Return the parsed data as a manifest, if it has the form of one.

    Keys of other versions of the program are let through.

    Raises:
        ConfigError: it has not.
    """
    if not isinstance(manifest, dict) or "study" not in manifest:
        raise ConfigError("is not the manifest of a study", file)
    try:
        _Manifest.model_validate(manifest)
    except ValidationError as problems:
        errors = problems.errors(include_url=False)
        if faults := [fault for fault in errors if fault["type"] != "extra_forbidden"]:
            text, _ = first_mistake(_Manifest, manifest, faults)
            raise ConfigError(f"is damaged: {text}", file) from None
    return manifest


@dataclass(frozen=True)
class Results:
    """Results of a study.

    Every table begins with the design columns `part`, `cell` (position in the grid, -1 for
    a reference run), `config` (hash of the resolved scenario), one column per factor under
    its dotted key, `is_reference`, `person`, `trial` and `seed`; the measures follow.

    Attributes:
        folder: Results folder.
        manifest: The study as resolved, its base scenarios, `--set` list, versions, failures;
            `partial` where the study is not finished.
        aside: Temporary folder of its tables, if the study is not finished.
    """

    folder: Path
    manifest: dict[str, Any]
    aside: Path | None = None
    _offers: ClassVar = "failures, machine"  # what to ask it for

    @classmethod
    def load(cls, folder: str | Path) -> Self:
        """Open a results folder.

        Raises:
            ConfigError: it is not one, or its study has not been completed.
        """
        path = Path(folder) / MANIFEST
        try:
            manifest = json.loads(path.read_text(encoding="utf-8"))
        except (FileNotFoundError, NotADirectoryError):
            raise ConfigError(_not_results(Path(folder))) from None
        except (OSError, ValueError, RecursionError) as error:
            raise ConfigError(f"cannot be read as a manifest: {error}", path) from None
        return cls(Path(folder), checked_manifest(manifest, path))

    @property
    def study(self) -> dict[str, Any]:
        """The study as resolved: question, seed, persons, replications, factors, parts."""
        return dict(self.manifest["study"])

    @property
    def factors(self) -> dict[str, list[Any]]:
        """Levels of each factor, in the order declared."""
        return dict(self.study["factors"])

    @property
    def question(self) -> str:
        """Question that the study answers."""
        return str(self.study.get("question", ""))

    @property
    def partial(self) -> str:
        """Remark on how much of an unfinished study is there; empty if complete."""
        gaps = self.manifest.get("partial")
        if gaps is None:
            return ""
        missing = f"{text}. " if (text := missing_tables(gaps.get("missing", {}))) else ""
        if "until_s" in gaps:
            return (
                f"Partial: {missing}The run goes on; what follows is of its first "
                f"{gaps['until_s']:.0f} s."
            )
        if missing:
            return f"Partial: {missing.strip()}"
        persons = self.study["persons"]
        return (
            f"Partial: {gaps['done']} of {gaps['of']} runs are done. What follows rests on the "
            f"{gaps['persons']} of {persons} persons who have all of theirs, and will change."
        )

    @property
    def machine(self) -> dict[str, Any]:
        """Times, costs and machine; nothing where they have not come along."""
        try:
            machine = json.loads((self.folder / MACHINE).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return {}
        return machine if isinstance(machine, dict) else {}

    @property
    def failures(self) -> list[dict[str, Any]]:
        """Runs that failed: their design columns and the `error`."""
        return list(self.manifest.get("failures", []))

    @property
    def distrusted(self) -> dict[str, str]:
        """Parts in which a class of the user's failed, so that something else decided: how often.

        A statement on such a part would hold for the default as well.
        """
        runs = self.table("runs") if self.has("runs") else {}
        parts = np.asarray(runs.get("part", []))
        values = {str(part): _failures_in(runs, parts == part) for part in dict.fromkeys(parts)}
        return {part: entry for part, entry in values.items() if entry}

    @property
    def tables(self) -> list[str]:
        """Names of the tables."""
        return sorted(path.stem for path in self._tables.glob("*.parquet"))

    def has(self, name: str) -> bool:
        """Return True if the study wrote a table of that name."""
        return name in self.tables

    @cached_property
    def runs(self) -> Frame:
        """The table of runs, one row each, repeats apart; empty if none was completed.

        Raises:
            ConfigError: the manifest tells of runs, and the table is not there or damaged.
        """
        if not self.has("runs") and self.manifest.get("runs", 0) <= len(self.failures):
            return Frame()
        return self.table("runs")

    def columns(self, table: str) -> list[Column]:
        """Return meanings of a table's columns.

        Raises:
            ConfigError: no such table, or a damaged file.
        """
        scenarios = self.manifest.get("scenarios", {}).values()
        models = dict.fromkeys(scenario.get("model", "full") for scenario in scenarios)
        factors = [*self.factors, *((self.study.get("design") or {}).get("ranges") or {})]
        described = self.manifest.get("columns")
        return describe(table, self.names(table), list(models), factors, described)

    def names(self, table: str) -> list[str]:
        """Return the columns of a table, without its rows being read.

        Raises:
            ConfigError: no such table, or a damaged file.
        """
        return list(self._read(table, "*", "LIMIT 0"))

    def path_of(self, table: str) -> Path:
        """Return the Parquet file of a table.

        Raises:
            ConfigError: no such table, or another than the manifest was written beside.
        """
        if not self.has(table):
            suggestion = hint(table, self.tables, "tables")
            raise ConfigError(f"{self.folder} has no table {table!r}; {suggestion}")
        path = self._tables / f"{table}.parquet"
        expected = self.manifest.get("tables", {}).get(table)
        if expected is not None and table not in self._seen:
            if digest_of(path) != expected:
                raise ConfigError(_NOT_AS_WRITTEN, path)
            self._seen.add(table)
        return path

    def table(
        self, name: str, part: str | None = None, columns: Sequence[str] | None = None
    ) -> Frame:
        """Return the columns of a table, in the order of the rows (part, cell, person, trial).

        Missing values are nan in columns of numbers and None in all others; a column of
        whole numbers with missing values comes as floats.

        Args:
            name: `runs`, `events`, `tracks`, ...
            part: Only the rows of this part.
            columns: Only these, which must be there.

        Raises:
            ConfigError: no such table, or a damaged file.
        """
        selection = "*" if columns is None else ", ".join(map(quoted, columns))
        return self._read(name, selection, "" if part is None else "WHERE part = ?", part)

    def _read(self, name: str, columns: str, rows: str, part: str | None = None) -> Frame:
        import duckdb

        file = escaped(self.path_of(name))
        values = [file] if part is None else [file, part]
        try:
            with _database().cursor() as cursor:
                query = f"SELECT {columns} FROM read_parquet(?) {rows}"
                arrays = cursor.execute(query, values).fetchnumpy()
        except duckdb.Error as error:
            raise ConfigError(f"cannot be read: {str(error).splitlines()[0]}", file) from None
        return Frame({key: without_mask(column) for key, column in arrays.items()})

    @property
    def _tables(self) -> Path:
        return (self.aside or self.folder) / TABLES

    @cached_property
    def _seen(self) -> set[str]:
        """Tables that were found as written."""
        return set()

    def __repr__(self) -> str:
        """Return the summary of contents and queries, without reading a table."""
        runs = self.manifest.get("runs", 0)
        cells = len(self.manifest.get("cells", ()))
        failed = f", {len(self.failures)} failed" if self.failures else ""
        return "\n".join(
            (
                f"Results in {self.folder}: {runs} runs in {cells} configurations{failed}",
                shorten(self.question, 100, placeholder=" ..."),
                f"{self._offers}, tables {', '.join(self.tables) or 'none'}",
            )
        )


@cache
def _database() -> DuckDBPyConnection:
    """Return the reader of all tables of a process: opening one takes longer than reading."""
    import duckdb

    return duckdb.connect(config={"threads": 1, "enable_external_file_cache": False})


def escaped(path: Path) -> str:
    """Return a path for DuckDB, to which `?`, `*` and `[` in it would mean several files."""
    return re.sub(r"[?*\[]", r"[\g<0>]", str(path))


def quoted(name: str) -> str:
    """Return the name of a column, as SQL takes it."""
    return '"' + name.replace('"', '""') + '"'


def _not_results(folder: Path) -> str:
    if not folder.is_dir():
        return f"{folder} is not a folder; give the folder that 'dva-sim run' wrote"
    if (folder / JOURNAL).exists():
        return (
            f"{folder} holds a study that is not finished; the command that began it goes on "
            "from there, and 'dva-sim show' and 'report' tell what is known so far"
        )
    return (
        f"{folder} holds no finished results: it has no {MANIFEST}; give the folder that "
        "'dva-sim run' wrote"
    )


_FAILED = "plugin_failures", "policy_failed"  # columns, of which a model has one


def _failures_in(runs: Mapping[str, Any], here: NDArray[np.bool_]) -> str:
    """Say how often user classes failed in some runs; empty if never."""
    columns = [np.asarray(runs[name], dtype=np.float64)[here] for name in _FAILED if name in runs]
    counts = np.nan_to_num(columns).sum(axis=0) if columns else np.zeros(0)
    times = int(counts.sum())
    failed = int(np.count_nonzero(counts))
    if not times:
        return ""
    return f"a class of yours failed {times} times, in {failed} of {here.sum()} runs"
