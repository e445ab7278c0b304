"""Messages about the events of a recording in which no control room was told of them."""

import pytest

from dva_sim.core.events import Event, State
from dva_sim.protocol.facts import Fact
from dva_sim.protocol.messages import AuditRecord, EventStatus, Position
from dva_sim.recordings.event_moments import news_of

TIMES = {"detected": 10.0, "assigned": 12.0, "departed": 13.0, "arrived": 20.0}
TIMES |= {"confirmed": 25.0, "act_assigned": 25.0, "contained": 40.0, "closed": 40.0}
FIRE = Event(1, "fire", Position(0.0, 0.0), 0.5, state=State.CONTAINED, times=TIMES)


def status_at(now, facts=()):
    """Return the newest status at a time."""
    told = sorted(news_of([FIRE], facts), key=lambda news: news[0])
    statuses = [body for time, body in told if time <= now and isinstance(body, EventStatus)]
    return statuses[-1] if statuses else None


@pytest.mark.parametrize(
    ("now", "state"),
    [
        (9.9, None),
        (10.0, "pending"),
        (12.0, "assigned"),
        (20.0, "on_scene"),
        (25.0, "confirmed"),
        (40.0, "contained"),
    ],
)
def test_an_event_stood_as_its_times_say(now, state):
    then = status_at(now)
    assert (then.event_state if then else None) == state
    if then is not None:
        assert (then.closed_for is not None) == (state == "contained")


def test_what_was_decided_is_told_from_when_it_was():
    facts = [
        Fact(time=15.0, author="a", label="min_eta", action="assign", event=1),
        Fact(time=19.0, author="b", label="Ana", role="dispatch", action="acknowledge", event=1),
        Fact(time=22.0, author="b", label="Ana", role="dispatch", action="note", event=1, text="x"),
        Fact(time=23.0, author="c", label="Bo", action="escalate", event=1, code=3),
        Fact(time=24.0, author="c", label="Bo", action="escalate", event=2),
    ]
    assert status_at(14.0, facts).last_decision is None
    assert status_at(16.0, facts).last_decision.label == "min_eta"
    seen = status_at(21.0, facts).acknowledged
    assert (seen.label, seen.ago) == ("Ana", 1.0), "as of its arrival at 20 s"
    last = status_at(30.0, facts)
    assert (last.note, last.decisions) == ("x", 3)
    assert last.last_decision.action == "note", "a refusal decides nothing"
    told = [(time, body) for time, body in news_of([FIRE], facts) if isinstance(body, AuditRecord)]
    assert [(time, body.action, body.code) for time, body in told] == [
        (15.0, "assign", 0),
        (19.0, "acknowledge", 0),
        (22.0, "note", 0),
        (23.0, "escalate", 3),
    ]
