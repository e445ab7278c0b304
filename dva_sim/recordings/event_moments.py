"""Events of a recording at a moment, as the DVA's messages reported them at that time."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import Final

from dva_sim.core.event_status import status_of
from dva_sim.core.events import Choice, Event, Handling, State
from dva_sim.protocol import messages as m
from dva_sim.protocol.facts import Fact

ROUNDED: Final = 0.0005  # rounding error of times on pages, in milliseconds [s]
_STEPS: Final = (
    ("detected", State.PENDING),
    ("assigned", State.ASSIGNED),
    ("arrived", State.ON_SCENE),
    ("confirmed", State.CONFIRMED),
)


def statuses_at(
    events: Iterable[Event], facts: Sequence[Fact], now: float
) -> Iterator[m.EventStatus]:
    """Yield the status of each event that was known at a moment [s].

    Args:
        events: Events as the DVA knew them in the end.
        facts: Decisions, in order.
        now: The moment [s].
    """
    for event in events:
        if (then := _event_at(event, now)) is not None:
            then.handling = _handling(facts, event.number, now)
            yield status_of(then, None, now)


def _event_at(event: Event, now: float) -> Event | None:
    """Return an event as it stood at a moment; None if it was not known yet."""
    times = {step: time for step, time in event.times.items() if time <= now + ROUNDED}
    if "detected" not in times:
        return None
    if "closed" in times:
        state = event.state
    else:
        state = [state for step, state in _STEPS if step in times][-1]
    sent = state is not State.PENDING
    then = replace(
        event,
        state=state,
        needs_containment="contained" in event.times or "act_assigned" in event.times,
        responder=event.responder if sent else None,
        operator=event.operator if sent else None,
        actor=event.actor if "act_assigned" in times else None,
        times=times,
    )
    if not then.open:  # live runs do not keep when
        times.setdefault("closed", max(times.values()))
    return then


def _handling(facts: Sequence[Fact], number: int, now: float) -> Handling:
    """Return the decisions on an event up to a moment, if they were recorded."""
    handling = Handling()
    for fact in facts:
        if fact.event != number or fact.time > now + ROUNDED or fact.code != m.OK:
            continue
        choice = Choice(fact.author, fact.label, fact.action, fact.time, fact.cause)
        handling.decide(choice)
        if fact.action == "acknowledge":
            handling.acknowledged = handling.acknowledged or choice
        elif fact.action == "note":
            handling.note = fact.text or ""
    return handling
