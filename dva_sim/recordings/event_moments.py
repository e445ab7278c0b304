"""Events of a recording as messages: what a control room would have been told of them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import Final

from dva_sim.core.event_status import status_of
from dva_sim.core.events import Choice, Event, Handling, State
from dva_sim.protocol import messages as m
from dva_sim.protocol.facts import Fact

_STEPS: Final = (
    ("detected", State.PENDING),
    ("assigned", State.ASSIGNED),
    ("arrived", State.ON_SCENE),
    ("confirmed", State.CONFIRMED),
)


News = tuple[float, object]
"""Body of a message that a control room hears, behind its time [s]."""


def news_of(events: Iterable[Event], facts: Sequence[Fact]) -> Iterator[News]:
    """Yield what a control room would have been told, event by event.

    Args:
        events: Events as the DVA knew them in the end.
        facts: Decisions, in order.
    """
    for event in events:
        about = [fact for fact in facts if fact.event == event.number]
        for now in sorted({*event.times.values(), *(fact.time for fact in about)}):
            if (then := _event_at(event, about, now)) is not None:
                yield now, status_of(then, None, now)
            yield from ((now, fact.record()) for fact in about if fact.time == now)


def _event_at(event: Event, facts: Sequence[Fact], now: float) -> Event | None:
    """Return an event as it stood at a moment; None if it was not known yet."""
    times = {step: time for step, time in event.times.items() if time <= now}
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
        handling=_handling(facts, now),
    )
    if not then.open:  # live runs do not keep when
        times.setdefault("closed", max(times.values()))
    return then


def _handling(facts: Sequence[Fact], now: float) -> Handling:
    """Return those of the decisions on an event that were made up to a moment."""
    handling = Handling()
    for fact in facts:
        if fact.time > now or fact.code != m.OK:
            continue
        choice = Choice(fact.author, fact.label, fact.action, fact.time, fact.cause)
        handling.decide(choice)
        if fact.action == "acknowledge":
            handling.acknowledged = handling.acknowledged or choice
        elif fact.action == "note":
            handling.note = fact.text or ""
    return handling
