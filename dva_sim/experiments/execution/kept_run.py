"""One run that people took part in, as a results folder: a journal while it runs, then tables.

While the run goes on its lines go into a journal (SQLite in WAL mode) by a thread of its own, so
that the run waits for no disk. At its end the tables are made of the journal, which is removed.
Of a run that was killed the journal is left; `complete` makes its tables as if the run had ended
with the last line. The journal stays, too, while any table cannot be made, so that a later version
of the program can make it.
"""

from __future__ import annotations

import json
import os
import platform
import queue
import sqlite3
import threading
from collections.abc import Iterable, Mapping, Sequence
from contextlib import closing, suppress
from pathlib import Path
from typing import Any, Final

from dva_sim.experiments.results.folder_lock import FolderLock
from dva_sim.experiments.results.manifest import machine, write_json
from dva_sim.experiments.results.results import (
    JOURNAL,
    MACHINE,
    MANIFEST,
    TABLES,
    digests,
    missing_tables,
)
from dva_sim.experiments.results.tables import write_tables
from dva_sim.experiments.study.cell_grid import runs_in
from dva_sim.kernel.errors import ConfigError, DvaSimError, RunsFailed
from dva_sim.simulation.full.dva_trace import OWN_CODE
from dva_sim.simulation.full.run_journal import JournalLine, compute_recording
from dva_sim.simulation.measures import episodes
from dva_sim.simulation.measures.drives import command_rows, drive_rows
from dva_sim.simulation.measures.reported import reported_rows
from dva_sim.simulation.models import Tables
from dva_sim.simulation.scenario import Scenario

Missing = dict[str, str]  # reasons, by table

KEPT_RUN: Final = "console.sqlite"  # the journal
RETRY_DELAY_S: Final = 1.0  # pause before writing to a full disk is tried again [s]
_FORMAT: Final = 1
_TABLES: Final = episodes.TABLES | {
    "drives": drive_rows,
    "commands": command_rows,
    "reported": reported_rows,
}
_SCHEMA = """
CREATE TABLE IF NOT EXISTS run (id INTEGER PRIMARY KEY CHECK (id = 1), format INTEGER NOT NULL,
  manifest TEXT NOT NULL, scenario TEXT NOT NULL, seed INTEGER NOT NULL);
CREATE TABLE IF NOT EXISTS grown (number INTEGER PRIMARY KEY, line TEXT NOT NULL);
CREATE TABLE IF NOT EXISTS state (number INTEGER PRIMARY KEY, key TEXT UNIQUE, line TEXT NOT NULL);
"""
_STATE = """
INSERT INTO state (key, line) VALUES (?, ?) ON CONFLICT (key) DO UPDATE SET line = excluded.line
"""


class KeptRun:
    """The journal of a run in its results folder, which no other process may write into.

    Args:
        folder: The results folder; the lock on it is held by the caller.
        manifest: Manifest of the run, without its tables.
        scenario: Scenario of the run.
        seed: Seed of the run.

    Attributes:
        problem: Reason why nothing can be written now; empty if it can.

    Raises:
        DvaSimError: the folder cannot be written.
    """

    def __init__(
        self, folder: Path, manifest: Mapping[str, Any], scenario: Scenario, seed: int
    ) -> None:
        self._folder = folder
        self.problem = ""
        _remove(folder, KEPT_RUN)
        documents = json.dumps(manifest), json.dumps(scenario.model_dump(mode="json"))
        try:
            self._db = _connected(folder)
            self._db.execute("PRAGMA journal_mode = WAL")
            self._db.execute("PRAGMA synchronous = NORMAL")
            self._db.executescript(_SCHEMA)
            self._db.execute("INSERT INTO run VALUES (1, ?, ?, ?, ?)", [_FORMAT, *documents, seed])
        except sqlite3.Error as error:
            raise DvaSimError(f"{folder} cannot be written: {error}") from None
        self._waiting: queue.SimpleQueue[Sequence[JournalLine] | None] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._write, daemon=True)
        self._thread.start()

    def put(self, lines: Sequence[JournalLine]) -> None:
        """Keep some lines, together or none of them, as soon as the disk takes them."""
        self._waiting.put(lines)

    def close(self) -> None:
        """Write all pending entries, and make the tables.

        Raises:
            DvaSimError: the disk is full or cannot be written; what is in the journal is kept.
            RunsFailed: some tables could not be made; the others are there.
        """
        self._waiting.put(None)
        self._thread.join()
        if self.problem:
            raise DvaSimError(
                f"{self._folder}: what happened last could not be written: {self.problem}; "
                f"mend that, then `dva-sim show {self._folder}` makes the tables of the rest"
            )
        missing = _finish(self._folder, own_code=True)
        if missing:
            raise RunsFailed(
                f"{self._folder}: {missing_tables(missing)}; the others are written, and "
                f"`dva-sim show {self._folder}` tries again"
            )

    # --- in its own thread -------------------------------------------------------------------

    def _write(self) -> None:
        lines: list[JournalLine] = []
        is_over = False
        while not is_over:
            new, is_over = self._next(bool(lines))
            lines += new
            try:
                self._keep(lines)
                lines = []
                self.problem = ""
            except (sqlite3.Error, OSError) as error:
                self.problem = str(error)
        self._db.close()

    def _next(self, is_behind: bool) -> tuple[list[JournalLine], bool]:
        """Return the new lines, and True if these were the last; lines that failed are retried."""
        journal_lines: list[JournalLine] = []
        with suppress(queue.Empty):
            batch = self._waiting.get(timeout=RETRY_DELAY_S if is_behind else None)
            while batch is not None:
                journal_lines += batch
                batch = self._waiting.get_nowait()
            return journal_lines, True
        return journal_lines, False

    def _keep(self, lines: Iterable[JournalLine]) -> None:
        if not is_left(self._folder):
            self._restore()
        self._db.execute("BEGIN IMMEDIATE")
        try:
            for key, line in lines:
                if key:
                    self._db.execute(_STATE, [key, line])
                else:
                    self._db.execute("INSERT INTO grown (line) VALUES (?)", [line])
            self._db.execute("COMMIT")
        except BaseException:
            if self._db.in_transaction:
                self._db.execute("ROLLBACK")
            raise

    def _restore(self) -> None:
        """Make a removed folder again, with all of the journal, which is still open."""
        self._folder.mkdir(parents=True, exist_ok=True)
        copy = _connected(self._folder)
        try:
            self._db.backup(copy)
        except BaseException:
            copy.close()
            raise
        self._db.close()
        self._db = copy


def _connected(folder: Path, mode: str = "rwc") -> sqlite3.Connection:
    file = f"{(folder / KEPT_RUN).absolute().as_uri()}?mode={mode}"
    # The writer's thread is not the one that opens it; they never use it at the same time.
    return sqlite3.connect(file, isolation_level=None, uri=True, check_same_thread=False)


def is_left(folder: Path) -> bool:
    """Return True if a results folder holds the journal of a run, running or killed."""
    return (folder / KEPT_RUN).is_file()


def complete(folder: Path) -> None:
    """Make the missing tables of a killed run, if there is one.

    The manifest's `partial` names the tables that cannot be made.

    Raises:
        FolderInUse: the run still goes on.
        ConfigError: the journal is damaged, or made by a later version.
        DvaSimError: the folder cannot be written.
    """
    if is_left(folder):
        with FolderLock(folder):
            if is_left(folder):
                _finish(folder)


def tables_so_far(folder: Path) -> tuple[dict[str, Any], Tables]:
    """Return the manifest and the tables of a run that still runs; its folder is only read.

    Raises:
        ConfigError: the journal is damaged, or made by a later version.
    """
    manifest, scenario, seed, lines = _read(folder)
    tables, missing, lasted = _tables(folder, scenario, seed, lines)
    return manifest | {"partial": {"until_s": lasted, "missing": missing}}, tables


def _finish(folder: Path, own_code: bool = False) -> Missing:
    """Make tables of the journal, which is removed last; return the tables that cannot be made."""
    manifest, scenario, seed, lines = _read(folder, own_code)
    tables, missing, lasted = _tables(folder, scenario, seed, lines)
    if missing:
        manifest |= {"partial": {"missing": missing}, "runs": int("runs" in tables)}
    jobs = runs_in(manifest)
    write_tables(folder, jobs, lambda _: tables)
    write_json(folder / MANIFEST, manifest | {"tables": digests(folder / TABLES)})
    facts = {"wall_s": lasted, "platform": platform.platform()}
    write_json(folder / MACHINE, machine(jobs, {}) | facts)
    _remove(folder, JOURNAL)  # of a study that was replaced
    if not missing:
        _remove(folder, KEPT_RUN)
    return missing


def _read(
    folder: Path, own_code: bool = False
) -> tuple[dict[str, Any], Scenario, int, list[JournalLine]]:
    """Return the manifest, scenario, seed and journal lines of a run.

    Args:
        folder: The results folder.
        own_code: Classes in files that the scenario names may be run: only by who has run them.
    """
    path = folder / KEPT_RUN
    mode = "rw" if os.access(folder, os.W_OK) else "ro&immutable=1"
    try:
        with closing(_connected(folder, mode)) as db:
            query = "SELECT format, manifest, scenario, seed FROM run"
            form, manifest, scenario, seed = db.execute(query).fetchone()
            if form > _FORMAT:
                raise ConfigError("was made by a later version of dva-sim", path)
            db.execute("BEGIN")  # both of the same moment
            lines = db.execute("SELECT key, line FROM state ORDER BY number").fetchall()
            grown = db.execute("SELECT line FROM grown ORDER BY number").fetchall()
    except (sqlite3.Error, TypeError) as error:
        raise ConfigError(
            f"is not the journal of a run, or damaged ({error}); move it away to start over", path
        ) from None
    document = json.loads(scenario)
    if not own_code and OWN_CODE in json.dumps(document["events"]):
        raise ConfigError("names a class in a Python file; results never run code", path)
    document = Scenario.model_validate(document)
    every = [*lines, *(("", line) for (line,) in grown)]
    return json.loads(manifest), document, seed, every


def _tables(
    folder: Path, scenario: Scenario, seed: int, lines: Sequence[JournalLine]
) -> tuple[Tables, Missing, float]:
    """Return the tables, the missing ones, and the duration [s] of a run.

    A run that never began has no rows.
    """
    if not lines:
        return {}, {}, 0.0
    try:
        recording = compute_recording(scenario, seed, lines)
    except ValueError as error:
        raise ConfigError(f"contains no lines of a run: {error}", folder / KEPT_RUN) from None
    tables: Tables = {}
    missing: Missing = {}
    for name, make in _TABLES.items():
        try:
            tables[name] = make(recording)
        except Exception as error:  # a bug in one table must not cost the others
            missing[name] = f"{type(error).__name__}: {error}"
    return tables, missing, recording.duration


def _remove(folder: Path, name: str) -> None:
    for ending in ("", "-wal", "-shm"):
        with suppress(OSError):
            folder.joinpath(f"{name}{ending}").unlink()
