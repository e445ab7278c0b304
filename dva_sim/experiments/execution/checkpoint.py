"""Journal of a running study: one row per run, safe against a kill.

Used to resume a study and to show progress while it runs.
"""

from __future__ import annotations

import json
import os
import shutil
import sqlite3
import tempfile
import time
import weakref
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dva_sim.experiments.execution import kept_run
from dva_sim.experiments.results.manifest import failures
from dva_sim.experiments.results.results import (
    JOURNAL,
    MANIFEST,
    TABLES,
    Results,
    checked_manifest,
    digests,
)
from dva_sim.experiments.results.tables import TablesOf, write_tables
from dva_sim.experiments.study.cell_grid import RunKey, StudyRun, runs_in
from dva_sim.kernel.errors import ConfigError, DvaSimError
from dva_sim.simulation.models import Tables

_PATIENCE_S = 600.0  # how long another runner may hold the checkpoint, to write its tables
_LOOK_S = 1.0  # Ctrl-C is not heard for as long

_SCHEMA = """
CREATE TABLE IF NOT EXISTS study (
  id INTEGER PRIMARY KEY CHECK (id = 1), identity TEXT NOT NULL, wall_s REAL NOT NULL DEFAULT 0,
  manifest TEXT);
CREATE TABLE IF NOT EXISTS runs (
  config TEXT, seed INTEGER, tables TEXT, cost_s REAL NOT NULL, error TEXT,
  PRIMARY KEY (config, seed), CHECK ((tables IS NULL) <> (error IS NULL)));
"""
_ADD = """
INSERT INTO runs VALUES (?, ?, ?, ?, ?) ON CONFLICT (config, seed) DO UPDATE
SET tables = excluded.tables, cost_s = excluded.cost_s, error = excluded.error
WHERE tables IS NULL
"""


@dataclass(frozen=True, slots=True)
class RunOutcome:
    """Result of one run: its tables, or the error that it failed with.

    Attributes:
        key: The run: hash of its configuration, and seed.
        tables: Its tables as JSON; None if it failed.
        cost_s: Cost of the run [CPU s].
        error: Error message; None if it did not fail.
    """

    key: RunKey
    tables: str | None
    cost_s: float = 0.0
    error: str | None = None


class NotBegun(ConfigError):
    """A journal of nothing: its study was stopped as it began."""


class Checkpoint:
    """The runs of one study, in a SQLite file in WAL mode: one row for each.

    A batch is kept whole or not at all. A run kept twice (by two runners) is kept once.

    Args:
        folder: Results folder, which must exist.
        identity: Hash of the study; a checkpoint belongs to one study. None accepts any.
        must_exist: It is to be read only, not begun.

    Attributes:
        identity: Hash of its study.

    Raises:
        ConfigError: the checkpoint is another study's, or not a checkpoint.
        NotBegun: it is to be read, and holds nothing yet.
        DvaSimError: it cannot be written, or another program holds it.
    """

    def __init__(self, folder: Path, identity: str | None, must_exist: bool = False) -> None:
        self.path = folder / JOURNAL
        with self._readable_errors():
            self._db = self._connected(must_exist)
            try:
                if not must_exist:
                    self._open(identity)
                (self.identity,) = self._db.execute("SELECT identity FROM study").fetchone()
            except BaseException:
                self._db.close()
                raise
        if identity not in (None, self.identity):
            self._db.close()
            raise ConfigError(
                f"{folder} holds another study ({self.identity}, not {identity}), or this one "
                "before it, the program or its libraries were changed; give another folder with -o"
            )

    def _connected(self, must_exist: bool) -> sqlite3.Connection:
        """Open read-only if nothing else is possible; the last entries may then be missing."""
        file = f"{self.path.absolute().as_uri()}?mode={'rw' if must_exist else 'rwc'}"
        if must_exist and not os.access(self.path.parent, os.W_OK):
            file = f"{self.path.absolute().as_uri()}?mode=ro&immutable=1"
        return sqlite3.connect(file, timeout=_LOOK_S, isolation_level=None, uri=True)

    def _open(self, identity: str | None) -> None:
        self._patiently("PRAGMA journal_mode = WAL")
        self._db.execute("PRAGMA synchronous = NORMAL")
        with self._transaction():
            for statement in _SCHEMA.split(";"):
                self._db.execute(statement)
            self._db.execute("INSERT OR IGNORE INTO study (id, identity) VALUES (1, ?)", [identity])

    def __enter__(self) -> Checkpoint:
        return self

    def __exit__(self, *_: object) -> None:
        self._db.close()

    def add(self, batch: Iterable[RunOutcome], wall_s: float = 0.0) -> None:
        """Keep some outcomes; a success takes the place of a failure, never the reverse.

        Args:
            batch: The outcomes.
            wall_s: Time gone by since the last batch [s].

        Raises:
            DvaSimError: the disk is full, or another program holds the checkpoint.
        """
        rows = [(*o.key, o.tables, o.cost_s, o.error) for o in batch]
        with self._readable_errors(), self._transaction():
            self._db.executemany(_ADD, rows)
            self._db.execute("UPDATE study SET wall_s = wall_s + ?", [wall_s])

    @contextmanager
    def alone(self) -> Iterator[None]:
        """Keep other runners of this study waiting for as long as the block takes.

        Raises:
            DvaSimError: another program holds the checkpoint.
        """
        with self._readable_errors():
            self._patiently("BEGIN IMMEDIATE")
        try:
            yield
        finally:
            self._db.execute("ROLLBACK")

    @contextmanager
    def _transaction(self) -> Iterator[None]:
        self._patiently("BEGIN IMMEDIATE")
        try:
            yield
            self._db.execute("COMMIT")
        except BaseException:
            if self._db.in_transaction:
                self._db.execute("ROLLBACK")
            raise

    def _patiently(self, statement: str) -> None:
        """Retry while another process holds the lock, in steps that let Ctrl-C through."""
        end = time.monotonic() + _PATIENCE_S
        while True:
            try:
                self._db.execute(statement)
                return
            except sqlite3.OperationalError as error:
                if "locked" not in str(error) or time.monotonic() > end:
                    raise

    def describe(self, manifest: Mapping[str, Any]) -> None:
        """Keep the definition of the study, so that it can be read here before it is complete.

        Raises:
            DvaSimError: the disk is full, or another program holds the checkpoint.
        """
        with self._readable_errors(), self._transaction():
            self._db.execute("UPDATE study SET manifest = ?", [json.dumps(manifest)])

    def manifest(self) -> dict[str, Any] | None:
        """Return the manifest stored by `describe`; None if there is none."""
        if "manifest" not in {row[1] for row in self._ask("PRAGMA table_info(study)")}:
            return None
        ((text,),) = self._ask("SELECT manifest FROM study")
        with self._readable_errors():
            return None if text is None else checked_manifest(json.loads(text), self.path)

    def done(self) -> set[RunKey]:
        """Return keys of the runs that need not be run again."""
        return set(self._ask("SELECT config, seed FROM runs WHERE tables IS NOT NULL"))

    def failures(self) -> dict[RunKey, str]:
        """Return runs that failed and have not succeeded since, with the reason."""
        query = "SELECT config, seed, error FROM runs WHERE tables IS NULL"
        return {(config, seed): error for config, seed, error in self._ask(query)}

    def tables(self, key: RunKey) -> Tables | None:
        """Return the tables of a run; None if it is not done."""
        query = "SELECT tables FROM runs WHERE config = ? AND seed = ?"
        with self._readable_errors():
            return next((json.loads(text) for (text,) in self._ask(query, key) if text), None)

    def costs(self) -> dict[RunKey, float]:
        """Return the cost of each completed run [CPU s]."""
        query = "SELECT config, seed, cost_s FROM runs WHERE tables IS NOT NULL"
        return {(config, seed): cost for config, seed, cost in self._ask(query)}

    @property
    def wall_s(self) -> float:
        """Run time of the study so far, over all sessions [s]."""
        return float(self._ask("SELECT wall_s FROM study")[0][0])

    def _ask(self, query: str, values: Sequence[Any] = ()) -> list[Any]:
        with self._readable_errors():
            return self._db.execute(query, values).fetchall()

    @contextmanager
    def _readable_errors(self) -> Iterator[None]:
        """Turn errors that a user can mend into one line."""
        try:
            yield
        except sqlite3.OperationalError as error:
            if "no such table: study" in str(error):
                raise NotBegun("holds no run yet; run the study again", self.path) from None
            raise DvaSimError(f"{self.path}: {_remedy(str(error))}") from None
        except (sqlite3.DatabaseError, TypeError, ValueError, RecursionError) as error:
            raise ConfigError(
                f"is not the journal of a study, or damaged ({error}); move it away to start over",
                self.path,
            ) from None


def _remedy(problem: str) -> str:
    if "full" in problem:
        return "the disk is full; finished runs are kept: free space, then run the command again"
    if "locked" in problem:
        return f"held by another program for more than {_PATIENCE_S:g} s; try again later"
    if "readonly" in problem or "unable to open" in problem:
        return (
            f"cannot be written ({problem}): is the folder read-only? finished runs are kept: "
            "mend that, then run the command again"
        )
    if "I/O" in problem:
        return f"{problem}: is the disk full or gone? finished runs are kept: run the command again"
    return problem


def load_so_far(folder: str | Path) -> Results:
    """Open a results folder, also one whose study is still running or was interrupted.

    Of a run that people took part in and that was killed, the tables are made first; of one that
    still goes on, they are made aside, as of now.

    In an unfinished study, only persons with all of their runs count, so that every
    comparison is paired and no cell has other persons than its neighbour. The key `partial` of
    the manifest then tells how much is there.

    Raises:
        ConfigError: it is no results folder, or no person has all runs yet.
    """
    folder = Path(folder)
    if kept_run.is_left(folder):
        try:
            kept_run.complete(folder)
        except ConfigError:
            raise
        except DvaSimError:  # it goes on, or the folder can only be read
            manifest, tables = kept_run.tables_so_far(folder)
            return _aside(folder, manifest, runs_in(manifest), lambda _: tables)
    if (folder / MANIFEST).exists() or not (folder / JOURNAL).exists():
        return Results.load(folder)
    with Checkpoint(folder, None, must_exist=True) as checkpoint:
        return _so_far(folder, checkpoint)


def _so_far(folder: Path, checkpoint: Checkpoint) -> Results:
    manifest = checkpoint.manifest()
    if manifest is None:
        raise ConfigError(
            f"{folder} holds an unfinished study of another version of dva-sim, which can only "
            "be shown when it is complete"
        )
    every = runs_in(manifest)
    done = checkpoint.done()
    failed = checkpoint.failures()
    run_keys = set(done | failed.keys())
    unfinished = {run.person for run in every if run.key not in run_keys}
    whole = [run for run in every if run.person not in unfinished]
    keys = {run.key for run in every}
    if not any(run.key in done for run in whole):
        raise ConfigError(
            f"{folder}: {len(done & keys)} of {len(keys)} runs are done, and no person has all of "
            "theirs yet; try again in a while"
        )
    persons = len({run.person for run in whole})
    manifest["partial"] = {"done": len(done & keys), "of": len(keys), "persons": persons}
    manifest["runs"] = len({run.key for run in whole})
    manifest["failures"] = failures(whole, failed)
    return _aside(folder, manifest, whole, checkpoint.tables)


def _aside(
    folder: Path, manifest: dict[str, Any], runs: Sequence[StudyRun], tables_of: TablesOf
) -> Results:
    """Return results whose tables are kept for as long as somebody reads them."""
    aside = _tables_aside(runs, tables_of)
    manifest["tables"] = digests(aside / TABLES)
    results = Results(folder, manifest, aside)
    weakref.finalize(results, shutil.rmtree, aside, ignore_errors=True)
    return results


def _tables_aside(runs: Sequence[StudyRun], tables_of: TablesOf) -> Path:
    """Return tables of some runs, in a folder of their own that does not disturb who still runs."""
    try:
        aside = Path(tempfile.mkdtemp(prefix="dva-sim-"))
    except OSError as error:
        raise DvaSimError(f"tables cannot be kept for a moment: {error.strerror}") from None
    try:
        write_tables(aside, runs, tables_of)
    except BaseException:
        shutil.rmtree(aside, ignore_errors=True)
        raise
    return aside
