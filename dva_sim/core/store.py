"""Persistent state of the DVA: events, devices and permissions, in a SQLite file.

Detectors report an event once and a holder is granted a robot once, so neither can be rebuilt
by asking around; hence a file. What comes by itself within seconds is not kept: positions,
modes, signs of life, auctions. Each change is kept before anything is said because of it, so
that a DVA that was killed never promised what its next life does not know. After the kill of
the process nothing is lost; after a power failure the last moments may be. While nothing can be
written, to a full disk for example, no permission is given, and nothing is confirmed that would
be lost.

Times are kept on a clock of their own, which runs only while a DVA runs: how long an event has
waited must not depend on the wall clock, which may be an hour off by then, or on how long the DVA
was down, which only the wall clock could tell.
"""

from __future__ import annotations

import json
import math
import sqlite3
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

from dva_sim.core.dva import Dva
from dva_sim.core.emergencies import RobotStop
from dva_sim.core.events import KEPT_CLOSED, Choice, Event, Handling, State
from dva_sim.core.registry import DeviceEntry
from dva_sim.core.sessions import Grant
from dva_sim.core.stored_rows import (
    GrantRow,
    RevocationRow,
    StopRow,
    StoredDevice,
    StoredEvent,
    read_row,
)
from dva_sim.kernel.errors import ConfigError
from dva_sim.protocol.messages import Device, PermissionRevocation, Position

FORMAT = 3
OLDER = 1, 2  # times by the wall clock; without emergencies
MICROSECONDS = 1e6
OPEN_WITHIN = 1.0  # maximum wait for another process's lock when the file is opened [s]
KEEPS_TIME = 1.0  # interval at which the time is written while events are open [s]
IDLE = 10  # factor on that interval while no event is open
WRITE_AHEAD_S = 0.1  # the core calls once a second: what is due this soon is written now [s]
WRITE_WITHIN_MS = 50  # maximum wait for the lock on each write, during which the DVA stands still
_TABLES = f"""
BEGIN IMMEDIATE;
CREATE TABLE IF NOT EXISTS about (name TEXT PRIMARY KEY, value INTEGER NOT NULL);
CREATE TABLE IF NOT EXISTS events (number INTEGER PRIMARY KEY, open INTEGER, data TEXT NOT NULL);
CREATE TABLE IF NOT EXISTS devices (id TEXT PRIMARY KEY, data TEXT NOT NULL);
CREATE TABLE IF NOT EXISTS grants (session TEXT PRIMARY KEY, data TEXT NOT NULL);
CREATE TABLE IF NOT EXISTS untold (session TEXT PRIMARY KEY, data TEXT NOT NULL);
CREATE TABLE IF NOT EXISTS stops (robot TEXT PRIMARY KEY, data TEXT NOT NULL);
INSERT OR REPLACE INTO about VALUES ('format', {FORMAT});
COMMIT;
"""
_TRY_LOCK = "BEGIN IMMEDIATE; COMMIT;"  # fails while somebody else writes to the file
_PLAIN: tuple[str, ...] = (
    *("number", "kind", "severity", "needs_containment", "reports", "sources"),
    *("responder", "operator", "actor", "taken_up", "act_taken_up", "attempts", "preemptions"),
)


class Store:
    """SQLite file with the state that a DVA keeps across restarts.

    Args:
        file: File; created if missing.

    Attributes:
        past: Offset from the DVA's time to the time that is kept [s].
        keeps_time: Interval at which the time is written while events are open [s].
        between_writes: Callback before each statement that writes, and after the last; it may
            raise.

    Raises:
        ConfigError: the file cannot be opened, or is something else.
    """

    def __init__(self, file: Path | str) -> None:
        self.past = 0.0
        self.keeps_time = KEEPS_TIME
        self.between_writes: Callable[[], object] = lambda: None
        self._time_kept_at = -math.inf  # by the DVA's time
        self._sessions: dict[str, dict[str, str]] = {table: {} for table in _KEYS}
        self._session_changes = 0
        self._asks = False
        self._held: dict[int, Grant] = {}  # by session, as the DVA was last seen
        self._events: dict[int, Event] = {}
        self._devices: dict[str, DeviceEntry | None] = {}
        self._lasting: set[str] = set()
        self._path = file
        try:
            self._file = sqlite3.connect(file, isolation_level=None, timeout=OPEN_WITHIN)
        except sqlite3.Error as error:
            raise self._useless(error) from None
        try:
            self._open()
        except BaseException:
            self._file.close()
            raise

    def _open(self) -> None:
        """Check that the file is a DVA's memory; any other file stays as it is.

        Nothing is written to one of this format: the disk may be full when a DVA restarts.
        """
        try:
            (tables,) = self._file.execute("SELECT count(*) FROM sqlite_master").fetchone()
            version = self._about("format") if tables else None
            is_ours = version in (None, *OLDER, FORMAT)
        except (sqlite3.OperationalError, ValueError, OverflowError) as error:
            # A database without the table `about` is another program's, and sound.
            if "no such" not in str(error):
                raise self._useless(error) from None
            version = None
            is_ours = False
        except sqlite3.Error as error:
            raise self._useless(error) from None
        if not is_ours:
            raise ConfigError(f"is not a DVA's memory of format {FORMAT}", self._path)
        try:
            self._file.execute("PRAGMA journal_mode=WAL")
            # With a write-ahead log only a power failure can undo a commit, not a kill.
            self._file.execute("PRAGMA synchronous=NORMAL")
            self._file.executescript(_TRY_LOCK if version == FORMAT else _TABLES)
            self._file.execute(f"PRAGMA busy_timeout={WRITE_WITHIN_MS}")
        except sqlite3.Error as error:
            raise self._useless(error) from None

    def _useless(self, error: Exception) -> ConfigError:
        return ConfigError(f"cannot be used as the DVA's memory: {error}", self._path)

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def copy(self) -> bytes:
        """Return the file as it is now."""
        return self._file.serialize()

    # --- to the file -------------------------------------------------------------------

    def keep(self, dva: Dva, changed: Iterable[Event], now: float) -> str | None:
        """Write what has changed; return why that failed, in words, or None.

        Failed writes are retried with the next call. A permission that was not written is
        withdrawn: the next life of the DVA could give the robot to somebody else.
        """
        self._events |= {event.number: event for event in changed}
        self._devices |= dva.registry.changes()
        changes = _session_changes(dva)
        asks = dva.dispatcher.questions.asks
        changed_sessions = changes != self._session_changes or asks != self._asks
        if not (self._events or self._devices or changed_sessions or self._time_is_due(dva, now)):
            return None
        sessions = self._sessions if changes == self._session_changes else _of_sessions(dva)
        lasting = dva.with_something_open()
        entries = dva.registry.entries
        # A silent device is kept only while something of it is open: see `_of_entry`.
        self._devices |= {i: entries[i] for i in lasting ^ self._lasting if i in entries}
        try:
            self._file.execute("BEGIN IMMEDIATE")
            self._write(dva, sessions, lasting, now)
            self.between_writes()
            self._file.execute("COMMIT")
            self.between_writes()
        except sqlite3.Error as error:
            if self._file.in_transaction:
                self._file.execute("ROLLBACK")
            self._withdraw(dva)
            return f"cannot keep its memory: {error}"
        self._events = {}
        self._devices = {}
        self._sessions = sessions
        self._session_changes = changes
        self._lasting = lasting
        self._asks = asks
        self._time_kept_at = now
        if changed_sessions:
            self._held = _held(dva)
        return None

    def knows(self, session: int) -> bool:
        """Return True for a permission that the file holds."""
        return str(session) in self._sessions["grants"]

    def _withdraw(self, dva: Dva) -> None:
        """End each permission that is not in the file; what it has replaced holds again.

        Nobody has heard of it yet, so nobody has to hear that it is over.
        """
        sessions = dva.sessions
        grants = _held(dva)
        unkept = [grant for session, grant in grants.items() if not self.knows(session)]
        for grant in unkept:
            sessions.permissions.end(grant.session)
        for session, before in self._held.items():
            replaced = session not in grants and session not in sessions.unacknowledged
            if replaced and any(_is_same_right(grant, before) for grant in unkept):
                sessions.permissions.restore(before)
        self._held = _held(dva)

    def _time_is_due(self, dva: Dva, now: float) -> bool:
        due = self._time_kept_at + self.keeps_time * (1 if dva.events.open else IDLE)
        return now >= due - WRITE_AHEAD_S

    def _write(
        self, dva: Dva, sessions: dict[str, dict[str, str]], lasting: set[str], now: float
    ) -> None:
        def put(statement: str, rows: Iterable[Sequence[object]]) -> None:
            self.between_writes()
            self._file.executemany(statement, rows)

        events = (
            (e.number, e.open, json.dumps(_of_event(e, dva, self.past)))
            for e in self._events.values()
        )
        put("INSERT OR REPLACE INTO events VALUES (?, ?, ?)", events)
        changed = {i: e for i, e in self._devices.items() if e is not None}
        devices = ((i, json.dumps(_of_entry(e, i in lasting))) for i, e in changed.items())
        put(_PUT_DEVICE, devices)
        gone = self._devices.keys() - changed.keys()
        put("DELETE FROM devices WHERE id = ?", ((i,) for i in gone))
        for table, rows_by_key in sessions.items():
            before = self._sessions[table]
            gone = before.keys() - rows_by_key.keys()
            put(f"DELETE FROM {table} WHERE {_KEYS[table]} = ?", ((s,) for s in gone))
            new = rows_by_key.items() - before.items()
            put(f"INSERT OR REPLACE INTO {table} VALUES (?, ?)", sorted(new))
        count = dva.sessions.permissions.count
        asks = dva.dispatcher.questions.asks
        time = int((now + self.past) * MICROSECONDS + 0.5)
        put(_PUT_ABOUT, [("sessions", count), ("ask_first", int(asks)), ("time", time)])

    # --- from the file -----------------------------------------------------------------

    def recall(self, dva: Dva, now: float) -> bool:
        """Restore what an earlier DVA knew; return whether there was anything.

        Devices count as heard just now: each has its time-out to show that it is there. Who was
        silent, with nothing of it open, is forgotten: it would only hold a place until then. What
        had waited has waited as long as when the earlier one last wrote, at most a second before
        it ended; the time since then does not count.

        Raises:
            ConfigError: what the file holds makes no sense.
        """
        try:
            has_memory = self._recall(dva, now)
        except (sqlite3.Error, ValueError, OverflowError) as error:
            raise self._useless(error) from None
        dva.check_access(now)
        return has_memory

    def _recall(self, dva: Dva, now: float) -> bool:
        # The kept time goes on from the last write, as if the DVA had not been down.
        self.past = self._time() - now
        silent = set[str]()
        for id_tag, data, is_silent in self._file.execute(_DEVICES):
            if is_silent:
                silent.add(id_tag)
            else:
                dva.registry.add(_entry(read_row(StoredDevice, data), now))
        has_memory = bool(dva.registry.entries)
        for state, count in self._counts().items():
            dva.events.counts[state] += count
        for (data,) in self._file.execute(_RECENT, (KEPT_CLOSED,)):
            has_memory = True
            row = read_row(StoredEvent, data)
            event = _event(row, self.past)
            dva.events.restore(event)
            for name in row["engaged"]:
                dva.orders.engaged.begin(name, event)
        dva.events.total = sum(dva.events.counts.values())
        self._recall_sessions(dva, now)
        # Older files do not say whether people are asked first: the configuration decides.
        if self._is_about("ask_first"):
            self._asks = dva.dispatcher.questions.asks = bool(self._about("ask_first"))
        # Taken and dropped: what was just read need not be written again.
        dva.registry.changes()
        dva.events.changes()
        self._devices = dict.fromkeys(silent)  # is gone from the file with the next write
        return has_memory

    def _time(self) -> float:
        """Return the time of the last write [s]; older files hold events only."""
        if self._is_about("time"):
            return self._about("time") / MICROSECONDS
        times = [0.0]
        for (data,) in self._file.execute("SELECT data FROM events"):
            row = read_row(StoredEvent, data)
            times += [row["waiting_since"], *row["times"].values()]
        return max(times)

    def _counts(self) -> dict[State, int]:
        rows = self._file.execute(
            "SELECT json_extract(data, '$.state'), count(*) FROM events GROUP BY 1"
        )
        return {State(state): count for state, count in rows}

    def _recall_sessions(self, dva: Dva, now: float) -> None:
        permissions = dva.sessions.permissions
        for table, sessions in self._sessions.items():
            columns = f"{_KEYS[table]}, data"
            sessions |= self._file.execute(f"SELECT {columns} FROM {table} ORDER BY rowid")
        for data in self._sessions["grants"].values():
            permissions.restore(_grant(read_row(GrantRow, data)))
        for data in self._sessions["untold"].values():
            dva.sessions.tell_robot(PermissionRevocation(*read_row(RevocationRow, data)))
        for robot, data in self._sessions["stops"].items():
            stopped_by, tick = read_row(StopRow, data)
            if robot not in dva.registry.entries:
                raise ValueError("a robot is stopped that is not registered")
            dva.emergencies.restore(robot, RobotStop(stopped_by, tick, now, now))
        self._session_changes, self._held = _session_changes(dva), _held(dva)
        self._lasting = dva.with_something_open()
        # New sessions have to lie above all that robots have ever received.
        permissions.count = max(permissions.count, self._about("sessions"))

    def _is_about(self, name: str) -> bool:
        row = self._file.execute("SELECT 1 FROM about WHERE name = ?", (name,)).fetchone()
        return row is not None

    def _about(self, name: str) -> int:
        row = self._file.execute("SELECT value FROM about WHERE name = ?", (name,)).fetchone()
        value = int(row[0]) if row else 0
        if abs(value) >= 2**62:
            raise ValueError(f"{name} is {value}")
        return value


_KEYS = {"grants": "session", "untold": "session", "stops": "robot"}
# An update in place keeps the order of rows, which is that of registration.
_PUT_DEVICE = """
INSERT INTO devices VALUES (?, ?) ON CONFLICT (id) DO UPDATE SET data = excluded.data
"""
_DEVICES = "SELECT id, data, json_extract(data, '$.silent') FROM devices ORDER BY rowid"
_PUT_ABOUT = "INSERT OR REPLACE INTO about VALUES (?, ?)"
_RECENT = """
SELECT data FROM (
  SELECT number, data FROM events WHERE open
  UNION SELECT * FROM (SELECT number, data FROM events WHERE NOT open ORDER BY number DESC LIMIT ?)
) ORDER BY number
"""


def _of_event(event: Event, dva: Dva, past: float) -> dict[str, Any]:
    engaged = dva.orders.engaged
    people = (event.responder, event.operator, event.actor)
    return {name: getattr(event, name) for name in _PLAIN} | {
        "state": event.state.value,
        "position": [event.position.latitude, event.position.longitude],
        "waiting_since": event.waiting_since + past,
        "times": {step: time + past for step, time in event.times.items()},
        "failed": sorted(event.failed),
        "sent": sorted(event.sent),
        "handling": _of_handling(event.handling, past),
        "engaged": [name for name in people if name and engaged.is_at(name, event)],
    }


def _event(row: dict[str, Any], past: float) -> Event:
    return Event(
        **{name: row[name] for name in _PLAIN},
        position=Position(*row["position"]),
        state=State(row["state"]),
        waiting_since=row["waiting_since"] - past,
        times={step: time - past for step, time in row["times"].items()},
        failed=set(row["failed"]),
        sent=set(row["sent"]),
        handling=_handling(row.get("handling"), past),
    )


def _of_handling(handling: Handling, past: float) -> dict[str, Any] | None:
    """Return the decisions on an event as a row; None if there are none."""
    if handling == Handling():
        return None
    return {
        "decisions": handling.decisions,
        "last": _of_choice(handling.last, past),
        "acknowledged": _of_choice(handling.acknowledged, past),
        "note": handling.note,
        "taken_off": sorted(handling.taken_off),
        # SQLite has no infinity: where there is no way, no time is expected.
        "expected": {
            d: (sent + past, eta)
            for d, (sent, eta) in handling.expected.items()
            if math.isfinite(eta)
        },
        "advised": handling.advised,
    }


def _handling(row: dict[str, Any] | None, past: float) -> Handling:
    if row is None:
        return Handling()
    return Handling(
        decisions=row["decisions"],
        last=_choice(row["last"], past),
        acknowledged=_choice(row["acknowledged"], past),
        note=row["note"],
        taken_off=set(row["taken_off"]),
        expected={d: (sent - past, eta) for d, (sent, eta) in row["expected"].items()},
        advised=row["advised"],
    )


def _of_choice(choice: Choice | None, past: float) -> list[Any] | None:
    return None if choice is None else [*choice._replace(time=choice.time + past)]


def _choice(row: list[Any] | None, past: float) -> Choice | None:
    if row is None:
        return None
    choice = Choice(*row)
    return choice._replace(time=choice.time - past)


def _session_changes(dva: Dva) -> int:
    return dva.sessions.permissions.changes + dva.sessions.changes + dva.emergencies.changes


def _held(dva: Dva) -> dict[int, Grant]:
    return {grant.session: grant for grant in dva.sessions.permissions.all()}


def _is_same_right(grant: Grant, other: Grant) -> bool:
    """Return True if a robot cannot have both."""
    if "sensors" in (grant.level, other.level):
        return (grant.robot, grant.holder, grant.level) == (other.robot, other.holder, other.level)
    return grant.robot == other.robot


def _of_sessions(dva: Dva) -> dict[str, dict[str, str]]:
    """Return permissions, ends that robots have not acknowledged, and stopped robots."""
    grants = dva.sessions.permissions.all()
    unacknowledged = [(s, send.body) for s, send in dva.sessions.unacknowledged.items()]
    return {
        "grants": {str(g.session): json.dumps(_plain(g)) for g in grants},
        "untold": {
            str(session): json.dumps(_plain(body))
            for session, body in unacknowledged
            if isinstance(body, PermissionRevocation)
        },
        "stops": {
            robot: json.dumps([stop.stopped_by, stop.tick])
            for robot, stop in dva.emergencies.stopped().items()
        },
    }


def _plain(value: Device | Grant | PermissionRevocation) -> list[Any]:
    return [getattr(value, field.name) for field in fields(value)]


def _grant(row: list[Any]) -> Grant:
    robot, holder, level, session, sensors, address = row
    return Grant(robot, holder, level, session, sensors=tuple(sensors), address=address)


def _of_entry(entry: DeviceEntry, lasts: bool) -> dict[str, Any]:
    registrations = list(entry.registrations)
    silent = entry.silent and not lasts
    return {"device": _plain(entry.device), "registrations": registrations, "silent": silent}


def _entry(row: dict[str, Any], now: float) -> DeviceEntry:
    registrations = deque(((i, t) for i, t in row["registrations"]), maxlen=8)
    return DeviceEntry(Device(*row["device"]), now, registrations=registrations)
