"""History of an event: steps in their order, each once, with who took it."""

from dataclasses import replace
from typing import Any

from dva_sim.agents.control_room.history import MAX_STEPS, EventHistory
from dva_sim.protocol import messages as m

PLACE = m.Position(38.0, -9.0)
NEW = m.EventStatus(1, "fire", PLACE, 0.2, 0.9, "pending", age=2.0, state_for=2.0, decisions=0)
ANA, BEN = "02:00:00:07:00:01", "02:00:00:07:00:02"
ROBOT = "02:00:00:01:00:01"


def record(action: str, code: int = m.OK, **more: Any) -> m.AuditRecord:
    given: dict[str, Any] = {"reason": "", "text": ""}
    return m.AuditRecord(author=ANA, label="ana", action=action, code=code, **given | more)


def steps(history: EventHistory) -> list[tuple[float, str, str, str]]:
    return [(step.time, step.what, step.who, step.device) for step in history.steps]


def test_an_event_is_reported_acknowledged_sent_to_reached_and_confirmed():
    history = EventHistory()
    history.hear_status(NEW, 10.0)
    seen = replace(NEW, acknowledged=m.ByWhom(ANA, "ana", 1.0))
    history.hear_status(seen, 12.0)
    sent = replace(seen, event_state="assigned", responder=ROBOT, state_for=0.0)
    history.hear_status(sent, 14.0)
    history.hear_record(record("assign", device=ROBOT), 14.1)
    history.hear_status(replace(sent, event_state="on_scene"), 30.0)
    history.hear_status(replace(seen, event_state="confirmed", state_for=1.0), 41.0)

    assert steps(history) == [
        (8.0, "reported", "", ""),
        (11.0, "acknowledge", "ana", ""),
        (14.1, "assign", "ana", ROBOT),
        (30.0, "on_scene", "", ROBOT),
        (40.0, "confirmed", "", ROBOT),
    ]


def test_what_is_told_twice_is_one_step():
    history = EventHistory()
    for at in (10.0, 20.0):
        history.hear_status(replace(NEW, acknowledged=m.ByWhom(ANA, "ana", at)), at)
    assert [what for _, what, _, _ in steps(history)] == ["acknowledge", "reported"]


def test_who_comes_late_knows_how_the_event_stands():
    history = EventHistory()
    state = {"event_state": "on_scene", "responder": ROBOT, "age": 60.0, "state_for": 5.0}
    history.hear_status(replace(NEW, **state), 100.0)
    assert steps(history) == [(40.0, "reported", "", ""), (95.0, "on_scene", "", ROBOT)]


def test_another_responder_is_a_step_though_the_state_is_the_same():
    history = EventHistory()
    history.hear_status(replace(NEW, event_state="assigned", responder=ROBOT), 10.0)
    history.hear_status(replace(NEW, event_state="assigned", responder=BEN, state_for=0.0), 20.0)
    assert steps(history)[-1] == (20.0, "assigned", "", BEN)


def test_a_refusal_is_no_step_and_the_reason_of_a_decision_is_kept():
    history = EventHistory()
    history.hear_status(NEW, 10.0)
    history.hear_record(record("escalate", m.OUT_OF_ORDER), 11.0)
    history.hear_record(record("severity", reason="3 devices report it", text="high"), 12.0)
    history.hear_record(record("assign", device=ROBOT, task="stand_by", reason="near"), 13.0)
    assert [(step.what, step.reason) for step in history.steps[1:]] == [
        ("severity", "high: 3 devices report it"),
        ("assign", "to stand by: near"),
    ]


def test_a_note_is_kept_with_its_text():
    history = EventHistory()
    history.hear_status(replace(NEW, note="ring the bell"), 10.0)
    history.hear_record(record("note"), 10.1)
    assert history.steps[-1] == (10.1, "note", "ana", "", "ring the bell")


def test_a_long_history_forgets_its_middle_and_keeps_the_report():
    history = EventHistory()
    history.hear_status(NEW, 10.0)
    for number in range(2 * MAX_STEPS):
        history.hear_record(record("note", reason=str(number)), 11.0 + number)
    assert len(history.steps) == MAX_STEPS
    assert history.steps[0].what == "reported"
    assert history.steps[-1].reason == str(2 * MAX_STEPS - 1)
