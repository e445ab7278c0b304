"""The book of events: each in exactly one state, its times in order, none ever lost."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import StrEnum

from dva_sim.protocol.messages import Position


class State(StrEnum):
    """Where an event stands; the last four are final."""

    PENDING = "pending"
    ASSIGNED = "assigned"
    ON_SCENE = "on scene"
    CONFIRMED = "confirmed"
    REFUTED = "refuted"
    ESCALATED = "escalated"
    EXPIRED = "expired"


STEPS = ("detected", "assigned", "departed", "arrived", "confirmed", "closed")
FINAL = frozenset({State.CONFIRMED, State.REFUTED, State.ESCALATED, State.EXPIRED})
NEXT = {
    State.PENDING: {State.ASSIGNED, State.CONFIRMED, State.ESCALATED, State.EXPIRED},
    State.ASSIGNED: {
        State.PENDING,
        State.ON_SCENE,
        State.CONFIRMED,
        State.REFUTED,
        State.ESCALATED,
        State.EXPIRED,
    },
    State.ON_SCENE: {
        State.PENDING,
        State.CONFIRMED,
        State.REFUTED,
        State.ESCALATED,
        State.EXPIRED,
    },
}


@dataclass
class Event:
    """One event as the DVA knows it.

    Attributes:
        number: The DVA's number for it.
        kind: `fire`, `gas_leak` or `flood`.
        position: Where it was first reported.
        severity: 0 to 1, the highest reported.
        reports: How many reports were merged into it.
        responder: Device that goes there: a guard or a robot.
        operator: Device that drives the robot, if a robot goes.
        pending_since: When it was last left without a responder [s].
        failed: Responders that set out and gave the order back.
        sent: Everybody who was ever ordered there; only they can tell what they found.
        times: Time of each step in `STEPS` that was taken [s].
    """

    number: int
    kind: str
    position: Position
    severity: float
    state: State = State.PENDING
    reports: int = 1
    responder: str | None = None
    operator: str | None = None
    attempts: int = 0
    pending_since: float = 0.0
    failed: set[str] = field(default_factory=set)
    sent: set[str] = field(default_factory=set)
    times: dict[str, float] = field(default_factory=dict)

    @property
    def open(self) -> bool:
        """Whether something can still happen to it."""
        return self.state not in FINAL


@dataclass
class EventBook:
    """All events of a run.

    Attributes:
        merge_distance_deg: Reports of one kind nearer than this [deg of latitude] are one event.
    """

    merge_distance_deg: float = 8.0 / 111_000
    events: dict[int, Event] = field(default_factory=dict)

    def report(self, kind: str, position: Position, severity: float, now: float) -> Event:
        """The event a report is about: a known one near by, or a new one."""
        for event in self.events.values():
            if event.open and event.kind == kind and self._near(event.position, position):
                event.reports += 1
                event.severity = max(event.severity, severity)
                return event
        number = len(self.events) + 1
        event = self.events[number] = Event(number, kind, position, severity)
        event.times["detected"] = event.pending_since = now
        return event

    def move(self, event: Event, state: State, now: float) -> None:
        """Change the state of an event by the rules.

        Raises:
            ValueError: that step does not exist.
        """
        if state not in NEXT.get(event.state, ()):
            raise ValueError(f"event {event.number} cannot go from {event.state} to {state}")
        event.state = state
        if state is State.PENDING:
            event.pending_since = now
            event.responder = event.operator = None
            for step in STEPS[1:4]:
                event.times.pop(step, None)
        elif state is State.ASSIGNED:
            event.times["assigned"] = now
            event.attempts += 1
        elif state is State.CONFIRMED:
            event.times["confirmed"] = now
        if state in FINAL:
            event.times["closed"] = now

    def in_state(self, *states: State) -> Iterator[Event]:
        """Events in one of these states, oldest first."""
        return (e for e in self.events.values() if e.state in states)

    def counts(self) -> dict[State, int]:
        """How many events stand in each state; they add up to all events (S6)."""
        counts = dict.fromkeys(State, 0)
        for event in self.events.values():
            counts[event.state] += 1
        return counts

    def _near(self, a: Position, b: Position) -> bool:
        north, east = a.latitude - b.latitude, (a.longitude - b.longitude) * 0.78
        return north * north + east * east < self.merge_distance_deg**2
