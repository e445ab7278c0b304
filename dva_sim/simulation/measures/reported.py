"""Events as the DVA knew them, with the decisions of people: for runs in which people take part.

The table `events` has those of the scenario; this one has events that people raised, too.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from dva_sim.core.events import Event
from dva_sim.kernel.measure import Measure, text
from dva_sim.protocol import messages as m
from dva_sim.protocol.facts import Fact
from dva_sim.simulation.full.recording import Recording
from dva_sim.simulation.measures.commands import NAN, Row

REPORTED_COLUMNS = (
    Measure("event_id", "the DVA's number of the event"),
    text("kind", "kind of the event"),
    text("room", "the room it was reported in; empty: outdoors, or none"),
    text("raised_by", "who raised it at a page, without a name; empty: it was reported"),
    Measure("severity", "how grave it was known to be in the end, from 0 to 1"),
    text("ended", "how it ended: a state of the DVA, such as contained; or open"),
    text("acknowledged_by", "who acknowledged it first, without a name; empty: nobody"),
    text("decided_by", "who first decided on it, without a name; empty: no person did"),
    text("sent_by", "who sent somebody first: a person, the policy, or nobody (empty)"),
    text("sent", "the guard or robot that was sent first; empty: nobody"),
    Measure("t_reported_s", "when it was reported first"),
    Measure("t_arrived_s", "when the responder was there"),
    Measure("t_confirmed_s", "when it was confirmed"),
    Measure("t_closed_s", "when it was over"),
    Measure("acknowledge_s", "from its report until it was acknowledged"),
    Measure("decide_s", "from its report until a person decided"),
    Measure("send_s", "from its report until somebody was sent"),
)
_DECISIONS: Final = frozenset({"assign", "take_off", "false_alarm", "escalate"})


def reported_rows(recording: Recording) -> list[Row]:
    """Return a row for each event that the DVA knew, in the order of their reports."""
    facts: dict[int | None, list[Fact]] = {}
    for fact in recording.facts:
        if fact.code == m.OK:
            facts.setdefault(fact.event, []).append(fact)
    return [_row(recording, event, facts.get(event.number, [])) for event in recording.events]


def _row(recording: Recording, event: Event, facts: list[Fact]) -> Row:
    times = event.times
    reported = times["detected"]
    x, y = recording.site.frame.to_xy(event.position.latitude, event.position.longitude)
    acknowledgement = event.handling.acknowledged
    raised = _first(facts, {"raise"})
    decided = _first((fact for fact in facts if fact.role is not None), _DECISIONS)
    sent = _first(facts, {"assign"})
    return {
        "event_id": event.number,
        "kind": event.kind,
        "room": recording.site.room_at(x, y) or "",
        "raised_by": raised.label if raised else "",
        "severity": event.severity,
        "ended": "open" if event.open else event.state.value,
        "acknowledged_by": acknowledgement.label if acknowledgement else "",
        "decided_by": decided.label if decided else "",
        "sent_by": sent.label if sent else "",
        "sent": recording.label_of(sent.device) if sent and sent.device else "",
        "t_reported_s": reported,
        **{f"t_{step}_s": times.get(step, NAN) for step in ("arrived", "confirmed", "closed")},
        "acknowledge_s": acknowledgement.time - reported if acknowledgement else NAN,
        "decide_s": decided.time - reported if decided else NAN,
        "send_s": sent.time - reported if sent else NAN,
    }


def _first(facts: Iterable[Fact], actions: set[str] | frozenset[str]) -> Fact | None:
    """Return the first decision of a kind."""
    return next((fact for fact in facts if fact.action in actions), None)
