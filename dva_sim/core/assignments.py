"""Assignments of devices to events, and the rules that hold whatever a policy advises.

A guard or a robot is at one event, an operator at as many as it has robots.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

from dva_sim.core.events import Event, apart
from dva_sim.protocol.messages import Position


@dataclass
class Assignments:
    """Event that each device works on, also while it still finishes a closed one.

    The caller limits the number of events of a device; this table accepts any number.
    """

    _events: dict[str, dict[int, Event]] = field(default_factory=dict)

    def begin(self, device: str, event: Event) -> None:
        """Note that a device is at one more event from now on."""
        self._events.setdefault(device, {})[event.number] = event

    def end(self, device: str, event: Event) -> bool:
        """Take a device from an event; return False if it was not there."""
        if not self.is_at(device, event):
            return False
        del self._events[device][event.number]
        if not self._events[device]:
            del self._events[device]
        return True

    def is_at(self, device: str, event: Event) -> bool:
        """Return True if a device is at exactly this event."""
        return self._events.get(device, {}).get(event.number) is event

    def find(self, device: str, number: int) -> Event | None:
        """Return the event of that number, if a device is at it."""
        return self._events.get(device, {}).get(number)

    def all(self, device: str) -> tuple[Event, ...]:
        """Return all events that a device is at, in the order of its orders."""
        return tuple(self._events.get(device, {}).values())

    def count(self, device: str) -> int:
        """Return at how many events a device is."""
        return len(self._events.get(device, ()))

    def pairs(self) -> list[tuple[str, Event]]:
        """Return every device with every event it is at."""
        return [(device, event) for device in self._events for event in self.all(device)]

    def __contains__(self, device: object) -> bool:
        return device in self._events

    def __iter__(self) -> Iterator[str]:
        return iter(self._events)

    def __len__(self) -> int:
        return len(self._events)


@dataclass(frozen=True, kw_only=True)
class Rules:
    """Rules that the DVA enforces.

    Attributes:
        escalate_after: An event that has waited so long for somebody is escalated [s]. 0: at
            once if nobody is free; infinite: never.
        containment: True if a confirmed event also needs a person to contain it.
        most_waiting: Maximum number of waiting events; beyond it the newest is escalated at once.
        merge_distance: Reports of one kind nearer than this are one event [m]; 0: never.
        max_attempts: Orders given for one event before it is escalated.
        order_limit: Time limit of an order; a responder who has not settled the event by then gives
            it back [s].
        depart_within: Time limit for setting out; a responder who accepted an order and stays gives
            it back then [s].
        still_within: Time limit without movement on the way; the same applies then [s].
        arrived_within: Distance for a confirmed arrival [m]: a responder counts as under way until
            its reported position is this near the event.
        bid_within: Time for which bids are taken [s].
        operator_span: Maximum number of robots that one operator handles at once.
        decide_within: Time that the policy waits for a person, where it asks first [s].
        declined_pause: Pause before the next request to a responder who declined an order or was
            not reached [s].
        severity_moves: True if the severity of an event rises with what is learnt of it; otherwise
            it is the highest reported.
    """

    escalate_after: float = 120.0
    containment: bool = False
    most_waiting: int | None = None
    merge_distance: float = 8.0
    max_attempts: int = 4
    order_limit: float = 900.0
    depart_within: float = math.inf
    still_within: float = math.inf
    arrived_within: float = math.inf
    bid_within: float = 2.0
    operator_span: int = 1
    decide_within: float = 60.0
    declined_pause: float = 10.0
    severity_moves: bool = False


STIRRED = 0.5  # least distance that counts as a move, above the noise of positions [m]
SET_OUT = "set out"
MOVE = "move"


class Promise(NamedTuple):
    """Next step that a device owes after accepting an order; `at` is its position, if known."""

    device: str
    event: Event
    owes: str
    at: Position | None


@dataclass
class Promises:
    """Deadlines of devices that have accepted an order: to set out, and then to keep moving.

    Only reports to the DVA count: `departed`, and positions as they are published. Time runs
    from when something was first owed, or from the last move.
    """

    rules: Rules
    _owed: dict[tuple[str, int], tuple[Promise, float]] = field(default_factory=dict)

    def overdue(self, promises: Iterable[Promise], now: float) -> list[Promise]:
        """Replace the promises by those of now; return the overdue ones."""
        before = self._owed
        self._owed = {}
        for promise in promises:
            key = promise.device, promise.event.number
            old, since = before.get(key, (promise, now))
            self._owed[key] = (promise, now) if _gets_on(old, promise) else (old, since)
        return [owed for owed, since in self._owed.values() if now >= self._ends(owed, since)]

    def next_deadline(self) -> float:
        """Return when the next owed step is overdue [s]."""
        return min((self._ends(*owed) for owed in self._owed.values()), default=math.inf)

    def _ends(self, owed: Promise, since: float) -> float:
        rules = self.rules
        return since + (rules.depart_within if owed.owes == SET_OUT else rules.still_within)


def _gets_on(old: Promise, new: Promise) -> bool:
    if old.event is not new.event or old.owes != new.owes:
        return True
    if new.owes == SET_OUT or new.at is None:
        return False
    return old.at is None or apart(old.at, new.at) >= STIRRED
