"""Events: the states of an event, the table of its transitions, and all events that are known.

An event is in exactly one state, its times are in order, and none is ever lost (S6, S7). What ends
a state is a `Cause`; `TRANSITIONS` says what follows, and `Orders.transition` carries it out.
"""

from __future__ import annotations

import math
from collections import OrderedDict
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Literal, NamedTuple

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
# CONFIRMED is final, too, unless the event needs containment: see `Event.open`.
FINAL = frozenset({S.CONTAINED, S.REFUTED, S.ESCALATED, S.EXPIRED})
LOOKING = (S.ASSIGNED, S.ON_SCENE)
"""States with an active order to look."""

MAX_OPEN = 10_000  # maximum open events; reports of further ones are refused
KEPT_CLOSED = 1000  # closed events that are kept, so that late reports about them are accepted
MAX_SOURCES = 64  # maximum reporters of one event that are told apart
DEGREE = 111_000.0  # length of a degree of latitude [m]
SAME_SPOT = 0.001  # without merging, a report is withdrawn only from where it was made [m]


class Choice(NamedTuple):
    """Decision, its author, and when it was made.

    Attributes:
        author: Id of the device; the DVA's for its policy and its rules.
        label: Label of the author.
        action: Kind of decision, as in `Fact`.
        time: Time [s].
        reason: Reason in words; may be empty.
        device: Device that it concerns; may be empty.
    """

    author: str
    label: str
    action: str
    time: float
    reason: str = ""
    device: str = ""

    def described(self, now: float) -> str:
        """Describe the choice in words, as of now."""
        about = self.device and f" of {self.device}"
        why = self.reason and f": {self.reason}"
        did = self.action.replace("_", " ")
        ago = now - self.time
        return f"{did}{about} by {self.label}, {ago:.1f} s ago{why}"


@dataclass(slots=True)
class Handling:
    """Decisions on one event.

    Attributes:
        decisions: Number of decisions; a decision made on an older number is too late.
        last: Latest decision.
        acknowledged: First acknowledgement.
        note: Latest note.
        taken_off: Devices that the policy may no longer send there.
        expected: Time of the order [s] and expected travel time [s], by device.
        advised: Id of the device that the policy last sent, or would have sent; may be empty.
    """

    decisions: int = 0
    last: Choice | None = None
    acknowledged: Choice | None = None
    note: str = ""
    taken_off: set[str] = field(default_factory=set)
    expected: dict[str, tuple[float, float]] = field(default_factory=dict)
    advised: str = ""

    def decide(self, choice: Choice) -> None:
        """Count a decision, and keep it as the last one."""
        self.decisions += 1
        self.last = choice

    def is_already(self, author: str, action: str, device: str = "") -> bool:
        """Return True if the last decision was exactly this, by the same author."""
        return self.last is not None and (author, action, device) == (
            self.last.author,
            self.last.action,
            self.last.device,
        )

    def arrival_in(self, device: str, now: float) -> float | None:
        """Return when a device that was sent is expected to arrive [s from now]."""
        if device not in self.expected:
            return None
        sent, eta = self.expected[device]
        return max(0.0, sent + eta - now)


@dataclass(slots=True)
class Event:
    """One event as the DVA knows it.

    Attributes:
        number: The DVA's number for it.
        kind: `fire`, `gas_leak` or `flood`.
        position: Position in the first report.
        severity: 0 to 1, the highest reported, or more where the rules let it rise.
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


# --- the life of an event ------------------------------------------------------------------


class Cause(StrEnum):
    """Cause of a transition, in words."""

    ORDERED = "a responder is ordered to look"
    ARRIVED = "the responder is there"
    CONFIRMED = "a device that was sent there confirms it"
    SENSED = "a robot's sensor confirms it"
    REFUTED = "a device that was sent there finds nothing"
    CONTAINED = "a person who was sent there has contained it"
    DECLINED = "the order to look is declined, or not delivered"
    GIVEN_BACK = "the responder gives the order back"
    ABANDONED = "the responder or its operator is gone, or stopped by an emergency"
    OVERDUE = "the order to look is not carried out in time"
    TAKEN_AWAY = "the robot is taken from its driver"
    REDIRECTED = "the policy sends the responder to another event"
    RECALLED = "a control room recalls the responder"
    EXHAUSTED = "an order has failed and no other may follow"
    WAITED = "it has waited too long"
    WITHDRAWN = "its last reporter withdraws it"
    SUPERSEDED = "a person on site reports the same event elsewhere"
    DISMISSED = "a control room calls it a false alarm"
    ESCALATED = "a control room escalates it"


class OrderEnd(StrEnum):
    """Fate of the active order to look, in words."""

    LEFT = "stays"  # until its responder reports `done`
    FREED = "ends"  # no session to end: not taken up yet, or needed for the next order
    RELEASED = "ends with its session"
    RECALLED = "ends with its session; the responder is told"


class Transition(NamedTuple):
    """Row of the transition table.

    The changed event is always told to control rooms, recorders and the memory. An actor hears that
    a confirmed event is to be contained, and that one that is over or waits again needs nobody.

    Attributes:
        starts: States in which the cause applies; in all others it is refused.
        end: Next state.
        order: Fate of an active order to look, and who hears of it.
        retries: True if the event is `EXHAUSTED` instead when no further order may follow.
        log: Reason that the audit log states for a decision of the DVA's own rules; empty: somebody
            else has decided, and logs it, or nobody has.
    """

    starts: tuple[State, ...]
    end: State
    order: OrderEnd = OrderEnd.LEFT
    retries: bool = False
    log: str = ""


def _transition_pending_assigned(event: Event, now: float) -> None:
    event.times["assigned"] = now


def _transition_assigned_on_scene(event: Event, now: float) -> None:
    event.times["arrived"] = now


def _transition_looking_pending(event: Event, now: float) -> None:
    # The start of the wait stays: an order that nobody takes up must not prolong it.
    event.responder = None
    event.operator = None
    event.taken_up = False
    for step in ("assigned", "departed", "arrived"):
        event.times.pop(step, None)


def _transition_unconfirmed_confirmed(event: Event, now: float) -> None:
    # Responder and operator stay: they may not have reported `done` yet.
    event.times["confirmed"] = now
    event.waiting_since = now  # a new wait begins, for somebody to contain it
    if not event.open:
        event.times["closed"] = now


def _transition_confirmed_contained(event: Event, now: float) -> None:
    event.times["contained"] = now
    event.times["closed"] = now


def _transition_open_closed(event: Event, now: float) -> None:
    event.times["closed"] = now


_TRANSITION_TO: dict[State, Callable[[Event, float], None]] = {
    S.PENDING: _transition_looking_pending,
    S.ASSIGNED: _transition_pending_assigned,
    S.ON_SCENE: _transition_assigned_on_scene,
    S.CONFIRMED: _transition_unconfirmed_confirmed,
    S.CONTAINED: _transition_confirmed_contained,
    S.REFUTED: _transition_open_closed,
    S.ESCALATED: _transition_open_closed,
    S.EXPIRED: _transition_open_closed,
}
_UNCONFIRMED = (S.PENDING, *LOOKING)
_OPEN = (*_UNCONFIRMED, S.CONFIRMED)

TRANSITIONS: dict[Cause, Transition] = {
    Cause.ORDERED: Transition((S.PENDING,), S.ASSIGNED),
    Cause.ARRIVED: Transition((S.ASSIGNED,), S.ON_SCENE),
    # A finding may come late, from a device that is no longer sent: the event may be pending.
    Cause.CONFIRMED: Transition(_UNCONFIRMED, S.CONFIRMED),
    Cause.SENSED: Transition(_UNCONFIRMED, S.CONFIRMED, OrderEnd.RECALLED),
    Cause.REFUTED: Transition(_OPEN, S.REFUTED),
    Cause.CONTAINED: Transition((S.CONFIRMED,), S.CONTAINED),
    # An order has failed.
    Cause.DECLINED: Transition(LOOKING, S.PENDING, OrderEnd.FREED, retries=True),
    Cause.GIVEN_BACK: Transition(LOOKING, S.PENDING, OrderEnd.RELEASED, retries=True),
    Cause.ABANDONED: Transition(LOOKING, S.PENDING, OrderEnd.RELEASED, retries=True),
    Cause.OVERDUE: Transition(LOOKING, S.PENDING, OrderEnd.RECALLED, retries=True),
    Cause.TAKEN_AWAY: Transition(LOOKING, S.PENDING, OrderEnd.RECALLED, retries=True),
    # The responder is needed elsewhere: no failure. Policies call nobody away from a scene.
    Cause.REDIRECTED: Transition((S.ASSIGNED,), S.PENDING, OrderEnd.FREED),
    Cause.RECALLED: Transition(LOOKING, S.PENDING, OrderEnd.RECALLED),
    # The DVA gives up.
    Cause.EXHAUSTED: Transition(
        (*LOOKING, S.CONFIRMED), S.ESCALATED, OrderEnd.RELEASED, log="orders came to nothing"
    ),
    Cause.WAITED: Transition((S.PENDING, S.CONFIRMED), S.ESCALATED, log="it has waited too long"),
    Cause.WITHDRAWN: Transition((S.PENDING,), S.EXPIRED, log="nobody reports it any longer"),
    Cause.SUPERSEDED: Transition(
        LOOKING, S.EXPIRED, OrderEnd.RECALLED, log="nobody reports it any longer"
    ),
    # A control room decides.
    Cause.DISMISSED: Transition(_OPEN, S.REFUTED, OrderEnd.RECALLED),
    Cause.ESCALATED: Transition(_OPEN, S.ESCALATED, OrderEnd.RECALLED),
}
"""The life of an event: what each cause makes of it."""


def applies(cause: Cause, event: Event) -> bool:
    """Return True if the table has a transition of the event for a cause."""
    return event.open and event.state in TRANSITIONS[cause].starts


def transition_of(event: Event, cause: Cause) -> Transition:
    """Return the transition of an event for a cause.

    Raises:
        ValueError: there is none in its state.
    """
    if not applies(cause, event):
        raise ValueError(f"event {event.number} is {event.state}: no transition for: {cause}")
    return TRANSITIONS[cause]


# --- all events ----------------------------------------------------------------------------


@dataclass
class EventTable:
    """The open events, and the last that were closed.

    Attributes:
        merge_distance: Reports of one kind nearer than this are one event [m].
        open: Open events by number, oldest first.
        closed: The last that were closed.
        total: Number of events ever opened.
        first: Number before that of the first event, where several DVAs number events.
        counts: Number of events in each state; they add up to `total` (S6).
    """

    merge_distance: float = 8.0
    open: dict[int, Event] = field(default_factory=dict)
    closed: OrderedDict[int, Event] = field(default_factory=OrderedDict)
    total: int = 0
    first: int = 0
    counts: dict[State, int] = field(default_factory=lambda: dict.fromkeys(State, 0))
    waiting: dict[int, Event] = field(default_factory=dict)
    _changed: dict[int, Event] = field(default_factory=dict)

    def get(self, number: int) -> Event | None:
        """Return the event of that number, if it is open or was closed lately."""
        return self.open.get(number) or self.closed.get(number)

    @property
    def full(self) -> bool:
        """True if no further event fits."""
        return len(self.open) >= MAX_OPEN

    def near(self, kind: str, position: Position) -> Event | None:
        """Return the open event that a report is about, if it is known."""
        if self.merge_distance <= 0:
            return None
        limit = self.merge_distance
        # The oldest event within the limit, which need not be the nearest.
        every = (e for e in self.open.values() if e.kind == kind)
        return next((e for e in every if apart(e.position, position) < limit), None)

    def reported_by(self, source: str, kind: str, position: Position) -> list[Event]:
        """Return the open events that a device reported there and has not taken back."""
        near = max(self.merge_distance, SAME_SPOT)
        return [
            e
            for e in self.open.values()
            if e.kind == kind and source in e.sources and apart(e.position, position) < near
        ]

    def merge(self, event: Event, severity: float) -> None:
        """Merge one more report of an event."""
        event.reports += 1
        event.severity = max(event.severity, severity)
        self.touch(event)

    def note_source(self, event: Event, source: str, confidence: float) -> None:
        """Note which device has reported an event; repeating a report does not add confidence."""
        if source in event.sources or len(event.sources) < MAX_SOURCES:
            event.sources[source] = max(confidence, event.sources.get(source, 0.0))

    def take_back(self, event: Event, source: str) -> None:
        """Take back the report of a device that does not see it any longer."""
        event.sources.pop(source, None)
        self.touch(event)

    def add(
        self, kind: str, position: Position, severity: float, now: float, contain: bool = False
    ) -> Event:
        """Return a new event."""
        self.total += 1
        number = self.first + self.total
        event = Event(number, kind, position, severity, contain, waiting_since=now)
        event.times["detected"] = now
        self.counts[event.state] += 1
        self.open[event.number] = self.waiting[event.number] = event
        self.touch(event)
        return event

    def restore(self, event: Event) -> None:
        """Restore an event of an earlier life of the DVA; `counts` and `total` know it already."""
        (self.open if event.open else self.closed)[event.number] = event
        self.touch(event)

    def move(self, event: Event, cause: Cause, now: float) -> None:
        """Change the state of an event, and count it there.

        Raises:
            ValueError: the table has no such transition.
        """
        transition = transition_of(event, cause)
        self.counts[event.state] -= 1
        self.counts[transition.end] += 1
        event.state = transition.end
        _TRANSITION_TO[transition.end](event, now)
        if not event.open:
            del self.open[event.number]
            self.closed[event.number] = event
        if len(self.closed) > KEPT_CLOSED:
            self.closed.popitem(last=False)
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
        """Return the events that have changed since the last call."""
        changed = self._changed
        self._changed = {}
        return list(changed.values())

    def in_state(self, *states: State) -> Iterator[Event]:
        """Return the open events in one of these states, oldest first."""
        return (e for e in self.open.values() if e.state in states)


def apart(a: Position, b: Position) -> float:
    """Return the distance of two places that are near each other [m]."""
    north = (a.latitude - b.latitude) * DEGREE
    east = (a.longitude - b.longitude) * DEGREE * math.cos(math.radians(a.latitude))
    return math.hypot(north, east)
