"""The event table: each event in exactly one state, its times in order, none ever lost."""

from __future__ import annotations

import math
from collections import OrderedDict
from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Literal

from dva_sim.core.handling import Handling
from dva_sim.protocol.messages import Position


class State(StrEnum):
    """State of an event."""

    PENDING = "pending"
    ASSIGNED = "assigned"
    ON_SCENE = "on scene"
    CONFIRMED = "confirmed"
    CONTAINED = "contained"
    REFUTED = "refuted"
    ESCALATED = "escalated"
    EXPIRED = "expired"


S = State
STEPS = ("detected", "assigned", "departed", "arrived", "confirmed", "contained", "closed")
ACT_STEPS = ("act_assigned", "act_departed", "act_arrived", "contained", "closed")
FINAL = frozenset({S.CONTAINED, S.REFUTED, S.ESCALATED, S.EXPIRED})  # and CONFIRMED, mostly
_GIVEN_UP = frozenset({S.ESCALATED, S.EXPIRED})
NEXT: dict[State, frozenset[State]] = {
    S.PENDING: frozenset({S.ASSIGNED, S.CONFIRMED, S.REFUTED}) | _GIVEN_UP,
    S.ASSIGNED: frozenset({S.PENDING, S.ON_SCENE, S.CONFIRMED, S.REFUTED}) | _GIVEN_UP,
    S.ON_SCENE: frozenset({S.PENDING, S.CONFIRMED, S.REFUTED}) | _GIVEN_UP,
    S.CONFIRMED: frozenset({S.CONTAINED, S.REFUTED, S.ESCALATED}),
}

MOST_OPEN = 10_000  # events at the same time; a report of one more is refused
KEPT_CLOSED = 1000  # who comes late with word of one of the last is still understood
MOST_SOURCES = 64  # whose reports of one event are told apart
DEGREE = 111_000.0  # of latitude [m]
SAME_SPOT = 0.001  # where reports are not merged, what is taken back was reported just here [m]


@dataclass(slots=True)
class Event:
    """One event as the DVA knows it.

    Attributes:
        number: The DVA's number for it.
        kind: `fire`, `gas_leak` or `flood`.
        position: Position in the first report.
        severity: 0 to 1, the highest reported.
        needs_containment: True if it is over only once somebody has contained it.
        reports: Number of merged reports.
        sources: Confidence of each device that reported it and has not taken that back.
        responder: Device that goes there to confirm it: a guard or a robot.
        operator: Device that drives the robot, if a robot goes.
        actor: Guard that deals with it once it is confirmed, or stands by to.
        taken_up: True if its present order to look was accepted.
        act_taken_up: True if its present order to contain it, or to stand by, was accepted.
        attempts: Orders taken up for it.
        preemptions: Number of times its responder was redirected.
        waiting_since: Start of the wait for a responder [s]; an order that nobody accepted does not
            end the wait.
        failed: Responders that set out and gave the order back.
        sent: Devices ever ordered there; only they can report findings.
        times: Time of each step in `STEPS` and `ACT_STEPS` that was taken [s].
        handling: Decisions on the event.
    """

    number: int
    kind: str
    position: Position
    severity: float
    needs_containment: bool = False
    state: State = State.PENDING
    reports: int = 1
    sources: dict[str, float] = field(default_factory=dict)
    responder: str | None = None
    operator: str | None = None
    actor: str | None = None
    taken_up: bool = False
    act_taken_up: bool = False
    attempts: int = 0
    preemptions: int = 0
    waiting_since: float = 0.0
    failed: set[str] = field(default_factory=set)
    sent: set[str] = field(default_factory=set)
    times: dict[str, float] = field(default_factory=dict)
    handling: Handling = field(default_factory=Handling)

    @property
    def open(self) -> bool:
        """True if the event is not closed."""
        if self.state is State.CONFIRMED:
            return self.needs_containment
        return self.state not in FINAL

    @property
    def confidence(self) -> float:
        """Probability that the event is real; the sources are assumed to err independently."""
        return 1.0 - math.prod(1.0 - c for c in self.sources.values())

    @property
    def holder(self) -> str | None:
        """Device ordered to confirm it: the operator of a robot, or a guard."""
        return self.operator or self.responder

    @property
    def waits_for(self) -> Literal["confirm", "contain"] | None:
        """Task for which somebody is missing; None if nobody is."""
        if self.state is State.PENDING:
            return "confirm"
        lacks_actor = self.state is State.CONFIRMED and self.open and self.actor is None
        return "contain" if lacks_actor else None


@dataclass
class EventTable:
    """The open events, and the last that were closed.

    Attributes:
        merge_distance: Reports of one kind nearer than this are one event [m].
        open: Open events by number, oldest first.
        closed: The last that were closed.
        total: Number of events ever opened.
        counts: Number of events in each state; they add up to `total` (S6).
    """

    merge_distance: float = 8.0
    open: dict[int, Event] = field(default_factory=dict)
    closed: OrderedDict[int, Event] = field(default_factory=OrderedDict)
    total: int = 0
    counts: dict[State, int] = field(default_factory=lambda: dict.fromkeys(State, 0))
    waiting: dict[int, Event] = field(default_factory=dict)
    _changed: dict[int, Event] = field(default_factory=dict)

    def get(self, number: int) -> Event | None:
        """The event of that number, if it is open or was closed lately."""
        return self.open.get(number) or self.closed.get(number)

    @property
    def full(self) -> bool:
        """True if no further event fits."""
        return len(self.open) >= MOST_OPEN

    def near(self, kind: str, position: Position) -> Event | None:
        """The open event that a report is about, if it is known."""
        if self.merge_distance <= 0:
            return None
        limit = self.merge_distance
        every = (e for e in self.open.values() if e.kind == kind)
        return next((e for e in every if apart(e.position, position) < limit), None)

    def reported_by(self, source: str, kind: str, position: Position) -> list[Event]:
        """The open events that a device reported there and has not taken back."""
        near = max(self.merge_distance, SAME_SPOT)
        return [
            e
            for e in self.open.values()
            if e.kind == kind and source in e.sources and apart(e.position, position) < near
        ]

    def merge(self, event: Event, severity: float) -> None:
        """One more report of an event."""
        event.reports += 1
        event.severity = max(event.severity, severity)
        self.touch(event)

    def note_source(self, event: Event, source: str, confidence: float) -> None:
        """A device has reported an event; said twice it is not more certain."""
        if source in event.sources or len(event.sources) < MOST_SOURCES:
            event.sources[source] = max(confidence, event.sources.get(source, 0.0))

    def take_back(self, event: Event, source: str) -> None:
        """A device does not see it any longer."""
        event.sources.pop(source, None)
        self.touch(event)

    def add(
        self, kind: str, position: Position, severity: float, now: float, contain: bool = False
    ) -> Event:
        """A new event."""
        self.total += 1
        event = Event(self.total, kind, position, severity, contain, waiting_since=now)
        event.times["detected"] = now
        self.counts[event.state] += 1
        self.open[event.number] = self.waiting[event.number] = event
        self.touch(event)
        return event

    def restore(self, event: Event) -> None:
        """An event that an earlier life of the DVA knew; `counts` and `total` know it already."""
        (self.open if event.open else self.closed)[event.number] = event
        self.touch(event)

    def move(self, event: Event, state: State, now: float) -> None:
        """Change the state of an event by the rules.

        Raises:
            ValueError: that step does not exist.
        """
        if state not in NEXT.get(event.state, ()) or not event.open:
            raise ValueError(f"event {event.number} cannot go from {event.state} to {state}")
        self.counts[event.state] -= 1
        self.counts[state] += 1
        event.state = state
        _note_time(event, state, now)
        self._close_if_over(event, now)
        self.touch(event)

    def touch(self, event: Event) -> None:
        """Note that an event has changed."""
        self._changed[event.number] = event
        if event.open and event.waits_for is not None:
            if event.number not in self.waiting:
                self.waiting[event.number] = event
        else:
            self.waiting.pop(event.number, None)

    def changes(self) -> list[Event]:
        """The events that have changed since this was last asked."""
        changed, self._changed = self._changed, {}
        return list(changed.values())

    def in_state(self, *states: State) -> Iterator[Event]:
        """Open events in one of these states, oldest first."""
        return (e for e in self.open.values() if e.state in states)

    def _close_if_over(self, event: Event, now: float) -> None:
        if event.open:
            return
        event.times["closed"] = now
        del self.open[event.number]
        self.closed[event.number] = event
        if len(self.closed) > KEPT_CLOSED:
            self.closed.popitem(last=False)


def apart(a: Position, b: Position) -> float:
    """Distance of two places that are near each other [m]."""
    north = (a.latitude - b.latitude) * DEGREE
    east = (a.longitude - b.longitude) * DEGREE * math.cos(math.radians(a.latitude))
    return math.hypot(north, east)


def _note_time(event: Event, state: State, now: float) -> None:
    if state is State.PENDING:
        event.responder = event.operator = None
        event.taken_up = False
        for step in STEPS[1:4]:
            event.times.pop(step, None)
    elif state is State.ASSIGNED:
        event.times["assigned"] = now
    elif state in (State.CONFIRMED, State.CONTAINED):
        event.times[state.value] = now
        if state is State.CONFIRMED:
            event.waiting_since = now
