"""MomentReader as tables write them: ISO 8601 with or without an offset, or seconds."""

from __future__ import annotations

from datetime import UTC, datetime
from functools import lru_cache
from typing import Final
from zoneinfo import ZoneInfo, available_timezones

from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.suggestions import guess
from dva_sim.kernel.table_files import Cell

_MILLISECONDS: Final = 1e11  # larger numbers are milliseconds since 1970; as seconds, the year 5138
_DAY: Final = len("2026-03-01")
_FORMS: Final = "ISO 8601, such as 2026-03-01T08:00:00+01:00, or seconds"


@lru_cache(maxsize=8)
def zone_named(name: str) -> ZoneInfo:
    """Return a time zone.

    Raises:
        ConfigError: there is none of that name.
    """
    try:
        return ZoneInfo(name)
    except (OSError, ValueError, KeyError):
        if not (zones := available_timezones()):
            problem = "this computer knows no time zones: pip install tzdata"
            raise ConfigError(f"time_zone {name!r}: {problem}") from None
        near = guess(name, zones)
        more = f"did you mean {near!r}?" if near else "write one such as Europe/Lisbon, or UTC"
        raise ConfigError(f"time_zone {name!r} is not known; {more}") from None


class MomentReader:
    """Reads the moments of one table, which are all dates or all seconds."""

    def __init__(self, time_zone: str | None) -> None:
        self._name = time_zone
        self._zone = zone_named(time_zone) if time_zone else None
        self._is_seconds: bool | None = None

    @property
    def is_dated(self) -> bool:
        """True if the moments are dates; False: seconds, or none has been read."""
        return self._is_seconds is False

    def read(self, cell: Cell) -> float:
        """Return the time of a cell [s], counted from 1970 if it is a date.

        Raises:
            ConfigError: not a moment, or an ambiguous one, or one of the other form.
        """
        try:
            return self.parse(cell.decimal)
        except ConfigError as problem:
            if problem.line is not None:
                raise
            raise cell.error(f"time {problem.problem}") from None

    def parse(self, moment: str | float) -> float:
        """Return the time of a text or number whose place is not known [s].

        Raises:
            ConfigError: as `read`.
        """
        text = str(moment)
        seconds = _seconds(text)
        is_seconds = seconds is not None
        if self._is_seconds is None:
            self._is_seconds = is_seconds
        elif self._is_seconds != is_seconds:
            forms = ("seconds", "a date") if is_seconds else ("a date", "seconds")
            raise ConfigError(f"{text!r} is {forms[0]}, and the table begins with {forms[1]}: "
                              "write all in one form")  # fmt: skip
        return self._date(text) if seconds is None else seconds

    def text(self, time: float) -> str:
        """Return a moment as people read it."""
        if not self.is_dated:
            return f"{time:,.10g} s"
        return datetime.fromtimestamp(time, self._zone or UTC).isoformat()

    def _date(self, text: str) -> float:
        try:
            moment = datetime.fromisoformat(text)
        except ValueError:
            raise ConfigError(f"{text[:40]!r} should be {_FORMS}") from None
        if len(text) <= _DAY:
            raise ConfigError(f"{text!r} has no time of day: write {text}T08:00:00, or the like")
        if moment.tzinfo is not None:
            return moment.timestamp()
        if self._zone is None:
            raise ConfigError(f"{text!r} has no offset: set events.time_zone, such as "
                              "Europe/Lisbon, or UTC")  # fmt: skip
        local = moment.replace(tzinfo=self._zone)
        first = local.utcoffset()
        second = local.replace(fold=1).utcoffset()
        assert first is not None
        assert second is not None
        if first > second:
            written = f"{local.isoformat()} or {local.replace(fold=1).isoformat()}"
            raise ConfigError(f"{text!r} occurs twice in {self._name}, when clocks go back: "
                              f"write {written}")  # fmt: skip
        if first < second:
            raise ConfigError(f"{text!r} does not exist in {self._name}, where clocks go forward: "
                              "correct it, or write its offset")  # fmt: skip
        return local.timestamp()


def _seconds(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    if not abs(value) < _MILLISECONDS:
        raise ConfigError(f"{text!r} is too large for seconds; of milliseconds, write a thousandth")
    return value
