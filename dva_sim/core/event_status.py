"""Status of events as control rooms see it."""

from __future__ import annotations

from collections.abc import Iterable

from dva_sim.core.events import LOOKING, Choice, Event, State
from dva_sim.core.questions import Question, Questions
from dva_sim.protocol import messages as m
from dva_sim.protocol.wire_size import LIST_BYTES, sent_time, xml_size

MAX_LISTED = 16  # maximum events in a list
EVENT_BYTES = 950  # maximum size of an event without people's texts [B]
_BEGINS = {State.ASSIGNED: "assigned", State.ON_SCENE: "arrived", State.CONFIRMED: "confirmed"}


def state_since(event: Event) -> float:
    """Return when an event entered its state [s]."""
    times = event.times
    detected = times.get("detected", 0.0)
    if not event.open:
        return times.get("closed", detected)
    if event.state is State.PENDING:
        return max(detected, event.waiting_since)
    return times.get(_BEGINS[event.state], detected)


def status_of(event: Event, question: Question | None, now: float) -> m.EventStatus:
    """Return the status of an event."""
    handling = event.handling
    times = event.times
    looks = event.state in LOOKING
    acts = event.open and event.actor is not None
    return m.EventStatus(
        event_id=event.number,
        kind=event.kind,
        position=event.position,
        severity=event.severity,
        confidence=round(max(0.0, min(event.confidence, 1.0)), 6),
        event_state=event.state.value.replace(" ", "_"),
        age=sent_time(now - times.get("detected", now)),
        state_for=sent_time(now - state_since(event)),
        decisions=handling.decisions,
        closed_for=None if event.open else sent_time(now - times.get("closed", now)),
        waits_for=event.waits_for if event.open else None,
        responder=event.responder if looks else None,
        operator=event.operator if looks else None,
        actor=event.actor if acts else None,
        acknowledged=by_whom(handling.acknowledged, now),
        last_decision=_last(handling.last, now),
        proposed=_proposed(question, now),
        note=handling.note[:256] or None,
    )


def event_list(events: Iterable[Event], questions: Questions, now: float) -> m.EventList:
    """Return as many of these events as fit into a message."""
    listed: list[m.EventStatus] = []
    room = LIST_BYTES
    for event in events:
        status = status_of(event, questions.of(event.number), now)
        room -= EVENT_BYTES + _written(status)
        if listed and (room < 0 or len(listed) == MAX_LISTED):
            break
        listed.append(status)
    return m.EventList(tuple(listed))


def by_whom(choice: Choice | None, now: float) -> m.ByWhom | None:
    """Return the author of a choice; None if nobody chose."""
    if choice is None:
        return None
    return m.ByWhom(choice.author, choice.label[:64], sent_time(now - choice.time))


def _last(choice: Choice | None, now: float) -> m.LastDecision | None:
    if choice is None:
        return None
    ago = sent_time(now - choice.time)
    return m.LastDecision(
        choice.author, choice.label[:64], choice.action, ago, choice.reason[:256] or None
    )


def _proposed(question: Question | None, now: float) -> m.Proposed | None:
    if question is None:
        return None
    arrival = sent_time(question.expected - now)
    return m.Proposed(question.device, question.task, arrival, sent_time(question.until - now))


def _written(status: m.EventStatus) -> int:
    """Return the room for what people have written [B]."""
    last = status.last_decision
    acknowledgement = status.acknowledged
    texts = [status.note or "", acknowledgement.label if acknowledgement else ""]
    texts += [last.label, last.reason or ""] if last else []
    return sum(map(xml_size, texts))
