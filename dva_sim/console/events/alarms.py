"""Alarms by the practice of control rooms: pure, without a clock and without a page.

An alarm is a condition that somebody has to act on, and whether somebody has said to have seen it.
Both together are its state: unacknowledged, acknowledged, or returned (over, and nobody has seen
it). An alarm that is over and seen is removed. A person who cannot act now may shelve one, always
with an end and a reason, and never an unacknowledged critical one; one that gets graver comes back
at once. There is one list, the gravest on top. In a flood, alarms of one kind and place are one
row ("7 x fire, Corridor 2"), so that the list stays short enough to be read.

References:
    ANSI/ISA-18.2-2016 and IEC 62682:2022, management of alarm systems: the states and the
    transitions between them, shelving with a limit, and a flood, which begins with 10 alarms within
    10 minutes and ends with fewer than 5.
    EEMUA Publication 191, 3rd edition (2013): an alarm needs an action, one in 10 minutes is what
    one person can deal with, and nothing blinks but what is new.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Final, NamedTuple

from dva_sim.console.wire.events import AlarmRow

PRIORITIES: Final = ("critical", "high", "medium", "low")
NEW_FOR: Final = 5.0  # so long an alarm stands out as new [s]
FLOOD_WINDOW: Final = 600.0  # [s]
FLOOD_BEGINS, FLOOD_ENDS = 10, 5  # alarms within that window
MAX_SHELF: Final = 8 * 3600.0  # a shift [s]
MAX_ALARMS: Final = 500  # that are known at once; of more the gravest


class AlarmState(StrEnum):
    """State of an alarm."""

    UNACKNOWLEDGED = "unacknowledged"
    ACKNOWLEDGED = "acknowledged"
    RETURNED = "returned"


class AlarmCondition(NamedTuple):
    """Condition that needs somebody to act.

    Attributes:
        key: Key that identifies it as long as it lasts.
        kind: Kind of problem: equal ones fold in a flood.
        priority: Priority, one of `PRIORITIES`.
        place: Place; empty if it does not matter.
        text: Description for people.
        since_ms: Start by the run's clock [ms].
        event: The event it is about, if any.
        seen_by: Person who acknowledged it elsewhere, as by a message to the DVA.
    """

    key: str
    kind: str
    priority: str
    place: str
    text: str
    since_ms: int = 0
    event: int | None = None
    seen_by: str | None = None


@dataclass(frozen=True)
class RaisedAlarm:
    """A condition, and who has seen it.

    Attributes:
        condition: Latest condition.
        state: See `AlarmState`.
        raised: Start of the present state, real time [s].
        is_on: True while the condition lasts.
        is_worse: True if it has become graver since somebody acknowledged it elsewhere.
        seen_by: Person who acknowledged it.
        shelved_until: Real time [s]; None if it is not shelved.
        shelved_by: Person who shelved it.
        shelved_why: Reason in words.
    """

    condition: AlarmCondition
    state: AlarmState
    raised: float
    is_on: bool = True
    is_worse: bool = False
    seen_by: str = ""
    shelved_until: float | None = None
    shelved_by: str = ""
    shelved_why: str = ""


class Alarms:
    """All alarms of a control room.

    Attributes:
        known: Alarms by key.
        is_flood: True while so many come that they fold.
        left_out: Conditions that found no place.
    """

    def __init__(self) -> None:
        self.known: dict[str, RaisedAlarm] = {}
        self.is_flood = False
        self.left_out = 0
        self._raised: deque[float] = deque(maxlen=MAX_ALARMS)

    # --- what happens -----------------------------------------------------------------------

    def update(self, conditions: Iterable[AlarmCondition], now: float) -> None:
        """Set the present conditions; those not named are over."""
        on = sorted(conditions, key=lambda c: PRIORITIES.index(c.priority))
        self.left_out = max(0, len(on) - MAX_ALARMS)
        present = {condition.key: condition for condition in on[:MAX_ALARMS]}
        for key, alarm in list(self.known.items()):
            if alarm.is_on and key not in present:
                self._is_over(key)
        for key, condition in present.items():
            before = self.known.get(key)
            if before is None or not before.is_on:
                self._raise(condition, now, before)
            else:
                self._go_on(before, condition, now)
        self.go_on(now)

    def go_on(self, now: float) -> None:
        """Time goes by: shelves end, and so may a flood."""
        self._unshelve_the_due(now)
        self._look_for_a_flood(now)

    def _raise(self, condition: AlarmCondition, now: float, before: RaisedAlarm | None) -> None:
        alarm = RaisedAlarm(condition, AlarmState.UNACKNOWLEDGED, now)
        if before is not None:  # it comes back: a shelf goes on
            alarm = replace(
                alarm,
                shelved_until=before.shelved_until,
                shelved_by=before.shelved_by,
                shelved_why=before.shelved_why,
            )
        self._raised.append(now)
        self._keep(self._seen(alarm, condition.seen_by))

    def _go_on(self, before: RaisedAlarm, condition: AlarmCondition, now: float) -> None:
        alarm = replace(before, condition=condition)
        graver = PRIORITIES.index(condition.priority) < PRIORITIES.index(before.condition.priority)
        if graver:
            alarm = replace(alarm, shelved_until=None, shelved_by="", shelved_why="")
            alarm = replace(alarm, state=AlarmState.UNACKNOWLEDGED, raised=now, seen_by="")
            alarm = replace(alarm, is_worse=condition.seen_by is not None)
            self._raised.append(now)
        self._keep(self._seen(alarm, condition.seen_by))

    @staticmethod
    def _seen(alarm: RaisedAlarm, by: str | None) -> RaisedAlarm:
        if by is None or alarm.is_worse or alarm.state is not AlarmState.UNACKNOWLEDGED:
            return alarm
        return replace(alarm, state=AlarmState.ACKNOWLEDGED, seen_by=by)

    def _is_over(self, key: str) -> None:
        alarm = self.known[key]
        if alarm.state is AlarmState.ACKNOWLEDGED:
            del self.known[key]
        else:
            self._keep(replace(alarm, state=AlarmState.RETURNED, is_on=False))

    def _keep(self, alarm: RaisedAlarm) -> None:
        self.known[alarm.condition.key] = alarm
        while len(self.known) > 2 * MAX_ALARMS:  # of those that are over, the oldest goes
            gone = (key for key, alarm in self.known.items() if not alarm.is_on)
            del self.known[next(gone)]

    def _unshelve_the_due(self, now: float) -> None:
        for key, alarm in list(self.known.items()):
            if alarm.shelved_until is not None and alarm.shelved_until <= now:
                self.unshelve(key, now)

    def _look_for_a_flood(self, now: float) -> None:
        rate = self.rate(now)
        self.is_flood = rate >= (FLOOD_ENDS if self.is_flood else FLOOD_BEGINS)

    def rate(self, now: float) -> int:
        """Return how many alarms were raised within the last 10 minutes."""
        while self._raised and now - self._raised[0] > FLOOD_WINDOW:
            self._raised.popleft()
        return len(self._raised)

    # --- what people do ---------------------------------------------------------------------

    def members(self, key: str) -> list[str]:
        """Return the alarms that a row of the list stands for; none if there is no such row."""
        if key in self.known:
            return [key]
        return [each for each, alarm in self.known.items() if _group(alarm.condition) == key]

    def acknowledge(self, key: str, by: str) -> None:
        """Note that somebody has seen an alarm; one that is over as well goes."""
        alarm = self.known.get(key)
        if alarm is None:
            return
        if alarm.is_on:
            alarm = replace(alarm, state=AlarmState.ACKNOWLEDGED, seen_by=by, is_worse=False)
            self.known[key] = alarm
        else:
            del self.known[key]

    def must_be_seen(self, key: str) -> bool:
        """Return True if an alarm is critical, lasts, and nobody has acknowledged it."""
        alarm = self.known[key]
        is_open = alarm.is_on and alarm.state is AlarmState.UNACKNOWLEDGED
        return is_open and alarm.condition.priority == PRIORITIES[0]

    def shelve(self, key: str, seconds: float, by: str, now: float, why: str = "") -> None:
        """Take an alarm out of the list for so long [s], as nobody can act on it now."""
        until = now + min(seconds, MAX_SHELF)
        alarm = replace(self.known[key], shelved_until=until, shelved_by=by, shelved_why=why)
        self.known[key] = alarm

    def unshelve(self, key: str, now: float) -> None:
        """Put an alarm back in the list; what lasts is new there again."""
        alarm = replace(self.known[key], shelved_until=None, shelved_by="", shelved_why="")
        if alarm.is_on:
            alarm = replace(alarm, state=AlarmState.UNACKNOWLEDGED, raised=now, seen_by="")
            alarm = self._seen(alarm, alarm.condition.seen_by)
        self.known[key] = alarm

    # --- what is shown ----------------------------------------------------------------------

    def rows(self, now: float) -> list[AlarmRow]:
        """Return the list: the gravest first, and of those the newest that nobody has seen."""
        listed = [alarm for alarm in self.known.values() if alarm.shelved_until is None]
        return [_row(alarms, now) for alarms in sorted(self._folded(listed), key=_rank)]

    def shelved(self, now: float) -> list[AlarmRow]:
        """Return the shelved alarms with their remaining time; the first to return first."""
        alarms = [alarm for alarm in self.known.values() if alarm.shelved_until is not None]
        alarms.sort(key=lambda alarm: alarm.shelved_until or 0.0)
        return [_row([alarm], now) for alarm in alarms]

    def _folded(self, listed: Sequence[RaisedAlarm]) -> Iterator[list[RaisedAlarm]]:
        """Return each for itself, or in a flood those of a kind and place together."""
        groups: dict[str, list[RaisedAlarm]] = {}
        for alarm in listed:
            key = _group(alarm.condition) if self.is_flood else alarm.condition.key
            groups.setdefault(key, []).append(alarm)
        return iter(groups.values())


def _group(condition: AlarmCondition) -> str:
    return f"{condition.kind} at {condition.place}"


_URGENCY: Final = {
    AlarmState.UNACKNOWLEDGED: 0,
    AlarmState.RETURNED: 1,
    AlarmState.ACKNOWLEDGED: 2,
}


def _rank(alarms: Sequence[RaisedAlarm]) -> tuple[int, int, float, str]:
    priority = min(PRIORITIES.index(alarm.condition.priority) for alarm in alarms)
    urgency = min(_URGENCY[alarm.state] for alarm in alarms)
    return priority, urgency, -max(alarm.raised for alarm in alarms), alarms[0].condition.key


def _row(alarms: Sequence[RaisedAlarm], now: float) -> AlarmRow:
    """Return a row of the list, for one alarm or for several that are alike."""
    first = min(alarms, key=lambda alarm: _rank([alarm]))
    condition = first.condition
    count = len(alarms)
    whose = (alarm.condition.key.partition(" ")[2] for alarm in alarms)
    where = condition.place or ", ".join(filter(None, whose))
    many = f"{count} x {condition.kind}" + (f", {where}" if where else "")
    until = first.shelved_until
    return {
        "key": condition.key if count == 1 else _group(condition),
        "priority": condition.priority,
        "state": str(first.state),
        "text": condition.text if count == 1 else many,
        "place": condition.place,
        "count": count,
        "event": condition.event if count == 1 else None,
        "since_ms": min(alarm.condition.since_ms for alarm in alarms),
        "is_new": first.state is AlarmState.UNACKNOWLEDGED and now - first.raised < NEW_FOR,
        "seen_by": first.seen_by,
        "left_s": None if until is None else max(0, round(until - now)),
        "shelved_by": first.shelved_by,
        "shelved_why": first.shelved_why,
    }
