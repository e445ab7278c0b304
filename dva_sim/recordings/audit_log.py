"""The audit log: who did what, when, why and with which outcome, in a file that only grows.

Each row carries the SHA-256 of its content and of the row before, so that a row that was changed,
removed or moved breaks the chain there. Numbers are never given twice, and a run of the console
ends with a row that says so: a log whose end was cut lacks one of both. Those who can write the
file can also compute a new chain; then only the hash of the last row, printed when the console ends
and kept in the recording, shows it.

References:
    Schneier, B., and Kelsey, J., "Secure audit logs to support computer forensics", ACM TISSEC 2
    (1999): hash chains, and why the newest hash has to be kept elsewhere.
"""

from __future__ import annotations

import hashlib
import json
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, Final

from dva_sim.kernel.errors import ConfigError, DvaSimError

FORMAT: Final = 1
SUFFIX: Final = ".sqlite"
BEGIN = "begin"  # action of the row before those of one console
END = "end"  # action of the row after those of one console
NOTHING_BEFORE: Final = "0" * 64  # digest before the first row
OPEN_WITHIN: Final = 2.0  # maximum wait for another process's lock [s]
_TABLES = f"""
BEGIN IMMEDIATE;
CREATE TABLE about (name TEXT PRIMARY KEY, value TEXT NOT NULL);
CREATE TABLE audit (
  number INTEGER PRIMARY KEY AUTOINCREMENT, time_s REAL NOT NULL, at_utc TEXT NOT NULL,
  author TEXT NOT NULL, device TEXT NOT NULL, role TEXT NOT NULL, action TEXT NOT NULL,
  event INTEGER, subject TEXT NOT NULL, cause TEXT NOT NULL, outcome TEXT NOT NULL,
  text TEXT NOT NULL, details TEXT NOT NULL, before TEXT NOT NULL, hash TEXT NOT NULL
);
CREATE TRIGGER audit_is_not_changed BEFORE UPDATE ON audit
  BEGIN SELECT RAISE(ABORT, 'the audit log only grows'); END;
CREATE TRIGGER audit_is_not_cut BEFORE DELETE ON audit
  BEGIN SELECT RAISE(ABORT, 'the audit log only grows'); END;
INSERT INTO about VALUES ('kind', 'dva-sim audit log'), ('format', '{FORMAT}');
COMMIT;
"""


class AuditWriteError(DvaSimError):
    """A row that could not be written; the file holds no part of it."""


@dataclass(frozen=True, kw_only=True)
class AuditEntry:
    """Entry about one action.

    Attributes:
        time_s: Time of the run [s].
        at_utc: By the clock on the wall, as in ISO 8601.
        author: Name of the author, for people.
        device: The id of the device by which it was done.
        role: Role of the author.
        action: Kind of action, in a word or two.
        event: About which event, if any.
        subject: To whom, such as a robot.
        cause: Reason.
        outcome: `done`, or `refused`, or what else became of it.
        text: Text of a note, or reason of a refusal.
        details: More, such as what the policy would have done.
    """

    time_s: float
    at_utc: str
    author: str
    device: str = ""
    role: str = ""
    action: str
    event: int | None = None
    subject: str = ""
    cause: str = ""
    outcome: str = "done"
    text: str = ""
    details: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class AuditRow(AuditEntry):
    """An entry with its row number and hash.

    Attributes:
        number: Number, from 1.
        before: The hash of the row before.
        hash: Hash of this row.
    """

    number: int
    before: str
    hash: str


NAMES: Final = tuple(entry.name for entry in fields(AuditEntry))
COLUMNS: Final = ("number", *NAMES, "before", "hash")
_INSERT = f"INSERT INTO audit ({', '.join(COLUMNS)}) VALUES ({', '.join('?' * len(COLUMNS))})"
_SELECT = f"SELECT {', '.join(COLUMNS)} FROM audit"
_LAST = "SELECT number, hash FROM audit ORDER BY number DESC LIMIT 1"


class AuditLog:
    """A file to which rows are added; an existing log is appended to.

    Args:
        path: File; created if missing.

    Attributes:
        number: Number of the last row.
        head: Its hash.

    Raises:
        ConfigError: the file cannot be used, is something else, or its chain is broken.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.number = 0
        self.head = NOTHING_BEFORE
        is_new = not path.exists() or _holds_nothing(path)
        if not is_new:
            verified = verify(self.path)
            if verified.problem is not None:
                text = f"row {verified.problem.number} {verified.problem.text}"
                raise ConfigError(f"is not an audit log that can be appended to: {text}", self.path)
            self.number = verified.rows
            self.head = verified.head
        try:
            self._file = sqlite3.connect(
                path, isolation_level=None, timeout=OPEN_WITHIN, check_same_thread=False
            )
            self._file.execute("PRAGMA journal_mode=WAL")
            self._file.execute("PRAGMA synchronous=FULL")  # what was said done survives a power cut
            if is_new:
                self._file.executescript(_TABLES)
        except sqlite3.Error as error:
            remedy = "mend that or give another file, then run the command again"
            raise ConfigError(f"cannot be used as an audit log: {error}; {remedy}", path) from None

    def append(self, entries: Sequence[AuditEntry]) -> list[AuditRow]:
        """Add rows, all or none; when this returns they are on the disk.

        Raises:
            AuditWriteError: they are not, for want of room for example.
        """
        try:
            self._file.execute("BEGIN IMMEDIATE")
            rows = self._rows(entries)  # after the last one, also where two consoles write
            self._file.executemany(_INSERT, map(_stored, rows))
            self._file.execute("COMMIT")
        except sqlite3.Error as error:
            with suppress(sqlite3.Error):
                self._file.execute("ROLLBACK")
            raise AuditWriteError(f"the audit log cannot be written: {error}") from None
        if rows:
            self.number = rows[-1].number
            self.head = rows[-1].hash
        return rows

    def _rows(self, entries: Sequence[AuditEntry]) -> list[AuditRow]:
        last = self._file.execute(_LAST).fetchone()
        last_number, before = last or (0, NOTHING_BEFORE)
        rows = list[AuditRow]()
        for number, entry in enumerate(entries, last_number + 1):
            rows.append(row_of(entry, number, before))
            before = rows[-1].hash
        return rows

    def close(self) -> None:
        """Put the file away, as one file without companions where that is possible."""
        with suppress(sqlite3.Error):
            self._file.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        self._file.close()


def row_of(entry: AuditEntry, number: int, before: str) -> AuditRow:
    """Return an entry as the row of that number, after one with that hash."""
    values = {name: _clean(getattr(entry, name)) for name in NAMES}
    values["details"] = json.loads(_packed(values["details"]))
    values["time_s"] = float(values["time_s"])
    plain = [number, *_columns(values), before]
    return AuditRow(**values, number=number, before=before, hash=hash_of(plain))


def hash_of(plain: Sequence[Any]) -> str:
    """Return the SHA-256 of a row: its columns in their order, as JSON, but for the hash itself."""
    return hashlib.sha256(json.dumps(plain, separators=(",", ":")).encode()).hexdigest()


def _clean(value: Any) -> Any:
    """Return the text that any file can hold: half a character pair is replaced."""
    return value.encode("utf-8", "replace").decode() if isinstance(value, str) else value


def _packed(details: Mapping[str, Any]) -> str:
    return json.dumps(details, sort_keys=True, separators=(",", ":"), allow_nan=False)


def _columns(values: Mapping[str, Any]) -> list[Any]:
    return [_packed(values[name]) if name == "details" else values[name] for name in NAMES]


def _stored(row: AuditRow) -> tuple[Any, ...]:
    return (row.number, *_columns(vars(row)), row.before, row.hash)


# --- reading ----------------------------------------------------------------------------------


@dataclass(frozen=True)
class FirstWrong:
    """The first wrong row, and its fault."""

    number: int
    text: str


@dataclass(frozen=True)
class Verified:
    """Result of a check of the whole chain.

    Attributes:
        rows: Number of valid rows, from the first one on.
        head: The hash of the last of them.
        problem: The first row that does not; None if all do.
        is_ended: True if the last row says that a console has ended there.
        doubts: Oddities that need not be wrong.
    """

    rows: int
    head: str
    problem: FirstWrong | None = None
    is_ended: bool = False
    doubts: tuple[str, ...] = ()


def read_rows(path: Path, after: int = 0, most: int = -1) -> list[AuditRow]:
    """Return the rows after a number, as they stand in the file.

    Raises:
        ConfigError: the file holds none, or what no log writes.
    """
    with closing(_opened(path)) as file:
        try:
            rows = file.execute(
                f"{_SELECT} WHERE number > ? ORDER BY number LIMIT ?", (after, most)
            )
            return [_row(values) for values in rows]
        except (sqlite3.Error, ValueError, TypeError, RecursionError) as error:
            raise ConfigError(f"cannot be read as an audit log: {error}", path) from None


def verify(path: Path) -> Verified:
    """Follow the chain from the first row, up to the first one that is wrong.

    Raises:
        ConfigError: it cannot be read at all.
    """
    with closing(_opened(path)) as file:
        try:
            return _followed(file)
        except (sqlite3.Error, ValueError, TypeError) as error:
            return Verified(0, NOTHING_BEFORE, FirstWrong(1, f"is not an audit log: {error}"))


def _followed(file: sqlite3.Connection) -> Verified:
    about = dict(file.execute("SELECT name, value FROM about"))
    if about.get("format") != str(FORMAT):
        return Verified(0, NOTHING_BEFORE, FirstWrong(1, f"is not an audit log of format {FORMAT}"))
    number = 0
    head = NOTHING_BEFORE
    last = ""
    for values in file.execute(f"{_SELECT} ORDER BY number"):
        if wrong := _wrong(values, number + 1, head):
            return Verified(number, head, FirstWrong(number + 1, wrong))
        number += 1
        head = values[-1]
        last = values[COLUMNS.index("action")]
    (highest,) = next(
        file.execute("SELECT max(seq) FROM sqlite_sequence WHERE name = 'audit'"), (0,)
    )
    if (highest or 0) > number:
        lost = f"is missing: rows up to {highest} were written, and the end was cut"
        return Verified(number, head, FirstWrong(number + 1, lost))
    return Verified(number, head, None, last == END, tuple(_doubts(file, last)))


def _wrong(values: Sequence[Any], number: int, head: str) -> str | None:
    """Return the fault of row `number`, given the hash `head` of the row before it."""
    if values[0] != number:
        return f"is missing: row {values[0]} follows row {number - 1}"
    *plain, before, stored = values
    if any(isinstance(value, bytes) for value in values):
        return "holds bytes where there should be text"
    if hash_of([*plain, before]) != stored:
        return "was changed: its content does not have its hash"
    if before != head:
        return f"does not follow row {number - 1}: a row was removed, moved or put in"
    return None


def verify_plain(rows: Sequence[Mapping[str, Any]]) -> Verified:
    """Verify rows kept elsewhere, as in a recording; they may begin at any row."""
    first = rows[0] if rows else {}
    number = first.get("number", 1) - 1
    head = first.get("before", NOTHING_BEFORE)
    last = ""
    for plain in rows:
        try:
            values = [plain["number"], *_columns(plain), plain["before"], plain["hash"]]
            wrong = _wrong(values, number + 1, head)
        except (KeyError, TypeError, ValueError) as error:
            wrong = f"is not whole: {error!r}"
        if wrong:
            return Verified(number, head, FirstWrong(number + 1, wrong))
        number += 1
        head = plain["hash"]
        last = plain["action"]
    return Verified(number, head, None, last == END)


def _doubts(file: sqlite3.Connection, last: str) -> Iterator[str]:
    if last != END:
        yield "its last row is not an end: a console writes it still, was killed, or it was cut"
    ((guards,),) = file.execute("SELECT count(*) FROM sqlite_master WHERE type = 'trigger'")
    if guards < _TABLES.count("CREATE TRIGGER"):
        yield "its guards against changes by hand were removed"


def _opened(path: Path) -> sqlite3.Connection:
    """Return the file, to be read only; nothing else opens it, since that would end SQLite's locks.

    Raises:
        ConfigError: it cannot be opened.
    """
    try:
        path.stat()
        return sqlite3.connect(f"{path.resolve().as_uri()}?mode=ro", uri=True, timeout=OPEN_WITHIN)
    except OSError as error:
        raise ConfigError(f"cannot be read: {error.strerror}", path) from None
    except sqlite3.Error as error:
        raise ConfigError(f"cannot be read: {error}", path) from None


def _holds_nothing(path: Path) -> bool:
    """Return True if a file is empty, or an SQLite file without tables."""
    if not path.stat().st_size:
        return True
    try:
        with closing(_opened(path)) as file:
            return not file.execute("SELECT count(*) FROM sqlite_master").fetchone()[0]
    except (sqlite3.Error, UnicodeDecodeError):  # of what is wrong, in the words of the file
        return False


def _row(values: Sequence[Any]) -> AuditRow:
    named = dict(zip(COLUMNS, values, strict=True))
    return row_in(named | {"details": json.loads(named["details"])})


def row_in(plain: Mapping[str, Any]) -> AuditRow:
    """Return the row that was stored as a dictionary; its hash is not looked at.

    Raises:
        TypeError: a column is missing or unknown.
        ValueError: a column holds what no log writes there.
    """
    row = AuditRow(**plain)
    for name in COLUMNS:
        value = getattr(row, name)
        if type(value) not in _TYPES.get(name, (str,)) or not _is_finite(value):
            raise ValueError(f"{name} of a row is {str(value)[:40]!r}")
    return row


_TYPES: Final[Mapping[str, tuple[type, ...]]] = {
    "number": (int,),
    "time_s": (float, int),
    "event": (int, type(None)),
    "details": (dict,),
}


def _is_finite(value: Any) -> bool:
    """Return True if all numbers in a value are finite."""
    try:
        json.dumps(value, allow_nan=False)
    except ValueError:
        return False
    return True


def plain_row(row: AuditRow) -> dict[str, Any]:
    """Return a row as a dictionary, in the order of the columns."""
    return {name: getattr(row, name) for name in COLUMNS}
