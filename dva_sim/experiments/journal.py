"""What a running study has done so far: one row per run, safe against being killed."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any

from dva_sim.errors import ConfigError, DvaSimError

FILE = "journal.sqlite"
_PATIENCE_S = 30.0  # how long another runner may hold the journal

_SCHEMA = """
CREATE TABLE IF NOT EXISTS study (id INTEGER PRIMARY KEY CHECK (id = 1), identity TEXT NOT NULL);
CREATE TABLE IF NOT EXISTS runs (
  config TEXT, seed INTEGER, tables TEXT NOT NULL, cost_s REAL NOT NULL,
  PRIMARY KEY (config, seed));
CREATE TABLE IF NOT EXISTS failures (
  config TEXT, seed INTEGER, error TEXT NOT NULL, PRIMARY KEY (config, seed));
"""

Key = tuple[str, int]
Value = bool | int | float | str | None
Tables = dict[str, list[dict[str, Value]]]


@dataclass(frozen=True, slots=True)
class Outcome:
    """How one run ended.

    Attributes:
        key: The run: hash of its configuration, and seed.
        tables: Its tables as JSON; None if it failed.
        cost_s: What it cost [CPU s].
        error: Why it failed; None if it did not.
    """

    key: Key
    tables: str | None
    cost_s: float = 0.0
    error: str | None = None


class Journal:
    """The runs of one study, in a SQLite file in WAL mode.

    A batch is kept whole or not at all. A run kept twice (by two runners) is kept once.

    Args:
        folder: Results folder, which must exist.
        identity: Hash of the study; a journal belongs to one study.

    Raises:
        ConfigError: the journal is another study's, or not a journal.
    """

    def __init__(self, folder: Path, identity: str) -> None:
        self.path = folder / FILE
        with self._told():
            self._db = sqlite3.connect(self.path, timeout=_PATIENCE_S, isolation_level=None)
            try:
                self._open(identity)
            except BaseException:
                self._db.close()
                raise

    def _open(self, identity: str) -> None:
        self._db.execute("PRAGMA journal_mode = WAL")
        self._db.execute("PRAGMA synchronous = NORMAL")
        self._db.executescript(f"BEGIN IMMEDIATE; {_SCHEMA} COMMIT;")
        self._db.execute("INSERT OR IGNORE INTO study VALUES (1, ?)", (identity,))
        (found,) = self._db.execute("SELECT identity FROM study").fetchone()
        if found != identity:
            raise ConfigError(
                f"{self.path.parent} holds another study ({found}, not {identity}), or this one "
                "before it or the program was changed; give another folder with -o"
            )

    def __enter__(self) -> Journal:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._db.close()

    def add(self, batch: Iterable[Outcome]) -> None:
        """Keep some outcomes; a success replaces an earlier failure, never the reverse.

        Raises:
            DvaSimError: the disk is full, or another program holds the journal.
        """
        outcomes = list(batch)
        with self._told(), self._transaction():
            self._db.executemany(
                "INSERT OR IGNORE INTO runs VALUES (?, ?, ?, ?)",
                [(*o.key, o.tables, o.cost_s) for o in outcomes if o.tables is not None],
            )
            self._db.executemany(
                "INSERT OR REPLACE INTO failures VALUES (?, ?, ?)",
                [(*o.key, o.error or "failed") for o in outcomes if o.tables is None],
            )

    @contextmanager
    def _transaction(self) -> Iterator[None]:
        self._db.execute("BEGIN IMMEDIATE")
        try:
            yield
            self._db.execute("COMMIT")
        except BaseException:
            if self._db.in_transaction:
                self._db.execute("ROLLBACK")
            raise

    def done(self) -> set[Key]:
        """Keys of the runs that need not be run again."""
        with self._told():
            return set(self._db.execute("SELECT config, seed FROM runs"))

    def failures(self) -> dict[Key, str]:
        """Runs that failed and have not succeeded since, with the reason."""
        query = "SELECT * FROM failures WHERE (config, seed) NOT IN (SELECT config, seed FROM runs)"
        with self._told():
            return {(config, seed): error for config, seed, error in self._db.execute(query)}

    def tables(self, key: Key) -> Tables | None:
        """The tables of a run; None if it is not done."""
        query = "SELECT tables FROM runs WHERE config = ? AND seed = ?"
        with self._told():
            row = self._db.execute(query, key).fetchone()
        return None if row is None else json.loads(row[0])

    def costs(self) -> dict[Key, float]:
        """What each run cost [CPU s]."""
        with self._told():
            rows: list[Any] = self._db.execute("SELECT config, seed, cost_s FROM runs").fetchall()
        return {(config, seed): cost for config, seed, cost in rows}

    @contextmanager
    def _told(self) -> Iterator[None]:
        """Turn what a user can mend into one line."""
        try:
            yield
        except sqlite3.OperationalError as error:
            raise DvaSimError(f"{self.path}: {_remedy(str(error))}") from None
        except sqlite3.DatabaseError as error:
            raise ConfigError(f"is not the journal of a study ({error})", self.path) from None


def _remedy(problem: str) -> str:
    if "full" in problem:
        return "the disk is full; finished runs are kept: free space, then run the command again"
    if "locked" in problem:
        return f"held by another program for more than {_PATIENCE_S:g} s; try again later"
    return problem
