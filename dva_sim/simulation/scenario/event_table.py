"""Events from a table: a CSV file of dated alarms in place of a scenario's list of events.

A scenario is expanded when it is built, so that the alarms themselves, not the name of a file,
are what its runs depend on, are kept with its results, and are hashed.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from typing import Annotated, Any, Final

from pydantic import BeforeValidator, Field, GetCoreSchemaHandler, PrivateAttr
from pydantic_core import CoreSchema, core_schema

from dva_sim.kernel.config import Config, Fail
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.suggestions import either, hint, listed
from dva_sim.kernel.table_files import Cell, CsvTable, read_table
from dva_sim.protocol.event_kinds import EVENT_KINDS
from dva_sim.simulation.scenario.moments import MomentReader, zone_named

Point = tuple[float, float]
COLUMNS: Final[Mapping[str, tuple[str, ...]]] = {
    "time": ("timestamp", "datetime", "date_time", "time_s", "at_s"),
    "kind": ("type", "alarm", "event"),
    "x": ("x_m",),
    "y": ("y_m",),
    "lat": ("latitude",),
    "lon": ("longitude", "lng", "long"),
    "room": ("zone",),
    "severity": (),
    "confidence": (),
    "false_alarm": ("false",),
}
"""Columns of a table, each with other names that it may have."""
_PLACES: Final = "x and y, lat and lon, or room"
_YES = ("true", "yes", "1")
_NO = ("false", "no", "0", "")


def _as_text(value: Any) -> Any:
    """Write a moment that YAML has read as text again, with the offset that the file gives."""
    if not isinstance(value, datetime):
        return str(value) if hasattr(value, "isoformat") else value
    offset = (getattr(value, "_yaml", None) or {}).get("tz")
    return value.isoformat() + ("+00:00" if offset == "Z" else offset or "")


class EventTableConfig(Config):
    """Events from a table of dated alarms; each is reported when it begins.

    Attributes:
        table: CSV file with a header: `time`, `kind`, and `x` and `y` [m], `lat` and `lon` [deg],
            or `room`; optional `severity`, `confidence` and `false_alarm`.
        start: Moment of simulated time 0, as text in ISO 8601; or seconds, if the table has them.
            Left out, the first row; for seconds 0.
        time_zone: Time zone of times without an offset, such as `Europe/Lisbon`.
        kinds: Kinds of events by the table's own words: `{Brandmelder: fire}`; null: leave out.
    """

    table: str
    start: Annotated[float | str | None, BeforeValidator(_as_text)] = None
    time_zone: str | None = None
    kinds: dict[str, str | None] = Field(default_factory=dict)


class OrTable:
    """Marks a list of events that a file may give as a table; `build` expands it."""

    keyed: Final = EventTableConfig

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        """Choose by the form of the value, so that mistakes are reported for that form alone."""
        forms = {"list": handler(source), "keyed": handler.generate_schema(EventTableConfig)}
        return core_schema.tagged_union_schema(forms, _form_of)


def _form_of(value: Any) -> str:
    return "keyed" if isinstance(value, Mapping | EventTableConfig) else "list"


class WithTable(Config):
    """A scenario whose events may have come from a table."""

    _told: tuple[str, tuple[str, ...]] = PrivateAttr(("", ()))

    @property
    def events_summary(self) -> str:
        """Count per kind, first, last and time 0 of a table's events; empty without a table."""
        return self._told[0]

    @property
    def events_doubts(self) -> tuple[str, ...]:
        """Rows of a table that are not in the run, or repeat others; each without full stop."""
        return self._told[1]

    def tell(self, events: TableEvents) -> None:
        """Keep what is said of the table that the events have come from."""
        self._told = events.summary, events.doubts


@dataclass(frozen=True, kw_only=True)
class TableAlarm:
    """A row: start [s], kind, place, share of severity and confidence; None where not given."""

    at_s: float
    kind: str
    room: str | None
    position: Point | None
    severity: float | None
    confidence: float | None
    false_alarm: bool


@dataclass(frozen=True)
class Ground:
    """Ground on which the alarms of a table lie.

    Attributes:
        rooms: Names of rooms or zones.
        is_placed: True if places matter.
        to_xy: Converts latitude and longitude [deg] to x, y [m]; None: no location on earth.
        why_not: Says why nothing can happen at a point; empty: it can.
        room_at: Name of the room around a point; None: none.
        ignored: Columns that play no part here.
    """

    rooms: Sequence[str]
    is_placed: bool
    to_xy: Callable[[float, float], Point] | None
    why_not: Callable[[float, float], str]
    room_at: Callable[[float, float], str | None]
    ignored: tuple[str, ...] = ()


@dataclass(frozen=True)
class TableEvents:
    """Alarms of a table in order of time, and what became of its rows.

    Attributes:
        alarms: Alarms within the run.
        summary: Count per kind, first, last, and time 0, in a line.
        doubts: Rows that are not in the run, and rows that repeat others.
    """

    alarms: list[TableAlarm]
    summary: str
    doubts: tuple[str, ...]


def read_events(
    table: EventTableConfig, horizon_s: float, ground: Ground, error: Fail
) -> TableEvents:
    """Read the alarms of a table that fall into a run.

    Args:
        table: The scenario's keys.
        horizon_s: Length of the run [s].
        ground: Floor and coordinates of the site.
        error: Makes the error for a problem at a key of the table.

    Raises:
        ConfigError: the file cannot be read, or a row is in doubt: file, row, column, what to do.
    """
    if table.time_zone is not None:
        try:
            zone_named(table.time_zone)
        except ConfigError as problem:
            raise error(problem.problem, ("time_zone",)) from None
    try:
        rows = read_table(table.table)
    except ConfigError as problem:
        if problem.file is None or (problem.line is None and "read" in problem.problem):
            text = f"table {table.table!r} {problem.problem}"
            raise error(text, ("table",)) from None
        raise
    return _Reader(table, rows, ground).events(horizon_s, error)


class _Reader:
    """Reads the rows of one table."""

    def __init__(self, table: EventTableConfig, rows: CsvTable, ground: Ground) -> None:
        self._table = table
        self._rows = rows
        self._ground = ground
        self._columns = self._find_columns()
        self._moments = MomentReader(table.time_zone)
        self._kinds = {_plain(kind): kind for kind in EVENT_KINDS}
        self._kinds |= {_plain(word): kind or "" for word, kind in table.kinds.items()}
        self._rooms = {room.casefold(): room for room in ground.rooms}

    def events(self, horizon_s: float, error: Fail) -> TableEvents:
        alarms = list[tuple[float, TableAlarm]]()
        skipped = 0
        order = 0
        seen = set[tuple[float, TableAlarm]]()
        repeats = list[int]()
        last = -math.inf
        for cells in self._rows.cells():
            time = self._moments.read(self._cell(cells, "time"))
            kind = self._kind(self._cell(cells, "kind"))
            if time < last and not order:
                order = cells.line
            last = time
            if not kind:
                skipped += 1
                continue
            alarms.append((time, self._alarm(cells, kind)))
            if alarms[-1] in seen:
                repeats.append(cells.line)
            seen.add(alarms[-1])
        if not alarms:
            raise ConfigError("has no alarms: write a row for each below the header",
                              self._rows.file)  # fmt: skip
        alarms.sort(key=lambda each: each[0])
        zero = self._zero(alarms[0][0], error)
        within = [replace(a, at_s=t - zero) for t, a in alarms if 0 <= t - zero < horizon_s]
        early = sum(time < zero for time, _ in alarms)
        late = len(alarms) - early - len(within)
        left_out = self._left_out(skipped, early, late, horizon_s)
        if not within:
            text = f"{left_out}: none is left; set events.start to a moment of the table"
            raise error(f"{text}, whose first row is at {self._moments.text(alarms[0][0])}", ())
        doubts = tuple(filter(None, (left_out, self._repeated(repeats))))
        return TableEvents(within, self._summary(within, zero, order), doubts)

    # --- columns -------------------------------------------------------------------------

    def _find_columns(self) -> dict[str, int]:
        names = [_plain(name) for name in self._rows.names]
        rows = self._rows
        columns: dict[str, int] = {}
        for column, aliases in COLUMNS.items():
            places = [n for n, name in enumerate(names) if name in (column, *aliases)]
            if len(places) > 1:
                twins = " and ".join(repr(rows.names[n]) for n in places)
                raise rows.error(f"has the columns {twins} for {column}: keep one", places[1])
            columns |= dict.fromkeys([column], places[0]) if places else {}
        has = f"it has {listed(rows.names)}"
        for column in ("time", "kind"):
            if column not in columns:
                raise rows.error(f"has no column {column!r}; {has}: name one so", 0)
        for one, other in (("x", "y"), ("lat", "lon")):
            if (one in columns) != (other in columns):
                missing = other if one in columns else one
                raise rows.error(f"has no column {missing!r}; {has}: add it", 0)
        if "x" in columns and "lat" in columns:
            raise rows.error("has x, y and lat, lon: keep one pair of them", columns["lat"])
        if self._ground.is_placed and not columns.keys() & {"x", "lat", "room"}:
            raise rows.error(f"has no column for the place: add {_PLACES}; {has}", 0)
        if "lat" in columns and self._ground.is_placed and self._ground.to_xy is None:
            problem = "has lat and lon, and this ground has no location on earth: give x and y [m]"
            raise rows.error(problem, columns["lat"])
        return columns

    def _cell(self, cells: Cell, column: str) -> Cell:
        return cells.at(self._columns[column])

    # --- cells ---------------------------------------------------------------------------

    def _alarm(self, cells: Cell, kind: str) -> TableAlarm:
        room, position = self._place(cells) if self._ground.is_placed else (None, None)
        severity = self._share(cells, "severity")
        confidence = self._share(cells, "confidence")
        return TableAlarm(
            at_s=0.0,
            kind=kind,
            room=room,
            position=position,
            severity=severity,
            confidence=confidence,
            false_alarm=self._false_alarm(cells),
        )

    def _kind(self, cell: Cell) -> str:
        kind = self._kinds.get(_plain(cell.text))
        if kind is None:
            word = cell.text or "alarm"
            raise cell.error(
                f"kind {cell.text!r} is not {either(EVENT_KINDS)}: say in the scenario which it "
                f"is, as in events.kinds: {{{word}: fire}}; null leaves it out"
            )
        return kind

    def _place(self, cells: Cell) -> tuple[str | None, Point | None]:
        room = self._room(cells)
        position = self._position(cells)
        if position is None:
            if room is None:
                raise cells.error(f"has no place: fill in {_PLACES}")
            return room, None
        x, y = position
        first = self._cell(cells, "x" if "x" in self._columns else "lat")
        if why := self._ground.why_not(x, y):
            raise first.error(f"({x:.6g}, {y:.6g}) m {why}: correct it, or give a room")
        around = self._ground.room_at(x, y)
        if room is not None and around != room:
            where = f"in {around!r}" if around else "in no room"
            raise first.error(f"({x:.6g}, {y:.6g}) m is {where}, not in {room!r}: correct one")
        return around, position

    def _room(self, cells: Cell) -> str | None:
        if "room" not in self._columns:
            return None
        cell = self._cell(cells, "room")
        if not cell.text:
            return None
        room = self._rooms.get(cell.text.casefold())
        if room is None:
            suggestion = hint(cell.text, list(self._ground.rooms), "rooms")
            raise cell.error(f"there is no room {cell.text!r}; {suggestion}")
        return room

    def _position(self, cells: Cell) -> Point | None:
        if "x" not in self._columns and "lat" not in self._columns:
            return None
        pair = ("x", "y") if "x" in self._columns else ("lat", "lon")
        first, second = (self._cell(cells, name) for name in pair)
        if not first.text and not second.text:
            return None
        if pair[0] == "x":
            return first.number("a number of metres"), second.number("a number of metres")
        latitude, longitude = (each.number("a number of degrees") for each in (first, second))
        if abs(latitude) > 90 or abs(longitude) > 180:
            raise first.error(f"{latitude:g}, {longitude:g} is no latitude and longitude")
        assert self._ground.to_xy is not None
        return self._ground.to_xy(latitude, longitude)

    def _share(self, cells: Cell, column: str) -> float | None:
        if column not in self._columns or not (cell := self._cell(cells, column)).text:
            return None
        value = cell.number("a share from 0 to 1")
        if not 0 <= value <= 1:
            raise cell.error(f"{column} should be a share from 0 to 1, not {cell.text!r}")
        return value

    def _false_alarm(self, cells: Cell) -> bool:
        if "false_alarm" not in self._columns:
            return False
        cell = self._cell(cells, "false_alarm")
        if cell.text.lower() not in (*_YES, *_NO):
            raise cell.error(f"false_alarm should be true or false, not {cell.text!r}")
        return cell.text.lower() in _YES

    # --- what is said of it --------------------------------------------------------------

    def _zero(self, first: float, error: Fail) -> float:
        start = self._table.start
        if start is None:
            return first if self._moments.is_dated else 0.0
        try:
            return self._moments.parse(start)
        except ConfigError as problem:
            raise error(f"start {problem.problem}", ("start",)) from None

    def _summary(self, alarms: Sequence[TableAlarm], zero: float, order: int) -> str:
        counts = Counter(alarm.kind for alarm in alarms)
        kinds = ", ".join(f"{count:,} {kind}" for kind, count in counts.most_common())
        first = " (the first row)" if self._table.start is None and self._moments.is_dated else ""
        parts = [
            f"{len(alarms):,} events of {self._rows.file.name}: {kinds}",
            f"the first at {alarms[0].at_s:,.10g} s, the last at {alarms[-1].at_s:,.10g} s",
            f"time 0 is {self._moments.text(zero)}{first}",
        ]
        if order:
            parts.append(f"line {order} is earlier than the one before: rows are sorted by time")
        used = {n for column, n in self._columns.items() if column not in self._ground.ignored}
        unused = [repr(name) for n, name in enumerate(self._rows.names) if n not in used]
        if unused:
            parts.append(f"not used: {listed(unused)}")
        return "; ".join(parts)

    def _left_out(self, skipped: int, early: int, late: int, horizon_s: float) -> str:
        reasons = {
            "of kinds that events.kinds leaves out": skipped,
            "before events.start": early,
            f"not before horizon_s {horizon_s:g}": late,
        }
        count = sum(reasons.values())
        why = ", ".join(f"{n:,} {reason}" for reason, n in reasons.items() if n)
        rows = "1 row" if count == 1 else f"{count:,} rows"
        return f"{rows} of {self._rows.file.name} left out: {why}" if count else ""

    def _repeated(self, lines: Sequence[int]) -> str:
        if not lines:
            return ""
        rows = "1 row repeats" if len(lines) == 1 else f"{len(lines):,} rows repeat"
        where = f"of {self._rows.file.name}: line {lines[0]}"
        return f"{rows} an earlier one {where}; each counts, so delete what is one alarm"


def _plain(word: str) -> str:
    """Return a word without capitals, and with one kind of joint: `Gas leak` is `gas_leak`."""
    return "_".join(word.casefold().replace("-", " ").replace("_", " ").split())
