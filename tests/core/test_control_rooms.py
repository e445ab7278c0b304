"""Control rooms: who may decide what, who wins, and what the rules hold whatever is decided."""

import numpy as np
import pytest
from helpers.dva.dispatch_office import (
    DVA,
    GUARD,
    OPERATOR,
    OTHER_GUARD,
    OTHER_OPERATOR,
    OTHER_ROOM,
    ROBOT,
    ROOM,
    Office,
    east,
)
from helpers.wording import unnamed

from dva_sim.core.assignments import Rules
from dva_sim.core.event_status import status_of
from dva_sim.core.events import Choice, Event, Handling, State
from dva_sim.core.questions import Questions
from dva_sim.core.sessions import Send
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import decode, encode
from dva_sim.protocol.facts import Fact

LEVELS = ("look", "drive", "dispatch", "supervise")
RULES = Rules(escalate_after=120.0, decide_within=60.0)
CONTAINING = Rules(escalate_after=120.0, containment=True)


def staffed(role: str = "dispatch", ask_first: bool = False, rules: Rules = RULES) -> Office:
    """Two control rooms are there: the first of this role, the other of role dispatch."""
    roles = {ROOM: role, OTHER_ROOM: "dispatch"}
    office = Office(rules=rules, roles=roles, ask_first=ask_first)
    office.core.sessions.permissions.own = DVA
    for room in (ROOM, OTHER_ROOM):
        office.register(room, "ControlRoom")
    office.register(OTHER_GUARD, "Guard", at=40.0)
    return office


def decide(
    office: Office, body: m.Body, now: float = 0.0, room: str = ROOM
) -> tuple[m.Reply, list[Send]]:
    """Say it as a control room; what is answered can be sent."""
    reply, sends = office.say(room, body, now)
    sent = m.Message(room, 1, DVA, "12:00:00", 0, reply)
    assert decode(encode(sent)) == sent
    return reply, sends


def facts(office: Office) -> list[Fact]:
    """Decisions since the last call; each can be sent."""
    taken = office.core.trail.take()
    for fact in taken:
        record = m.Message(DVA, 1, DVA, "12:00:00", 0, fact.record())
        assert decode(encode(record)) == record
    return taken


def order(event: int, device: str | None = None, task: str = "confirm") -> m.Order:
    return m.Order(event, "fire", east(12), device, task)


OVER = m.OrderProgress(1, "done")


# --- who may what ------------------------------------------------------------------------------

NEEDED = [
    (m.GetEventList(), "look"),
    (m.GetDispatch(), "look"),
    (m.GetProposal(1), "look"),
    (m.EventReport(None, "flood", east(70), 0.5, 0.9, "detected"), "drive"),
    (m.PermissionRequest(ROBOT, "missions"), "drive"),
    (m.GetRequestLog(), "drive"),
    (m.Acknowledge(1), "dispatch"),
    (m.Assign(1, OTHER_GUARD, decisions=1), "dispatch"),
    (m.TakeOff(1, ROBOT), "dispatch"),
    (m.FalseAlarm(1, "toast"), "dispatch"),
    (m.Escalate(1), "dispatch"),
    (m.AddNote(1, "door B is locked"), "dispatch"),
    (m.ReleaseEmergency(ROBOT), "dispatch"),
    (m.SetDispatch("ask_first"), "supervise"),
    (m.Revoke(ROBOT), "supervise"),
]


@pytest.fixture
def office() -> Office:
    return staffed()


@pytest.mark.parametrize("role", LEVELS)
@pytest.mark.parametrize(
    ("body", "needs"), NEEDED, ids=lambda x: getattr(x, "__name__", str(x)[:20])
)
def test_a_role_allows_what_it_includes_and_nothing_else(role, body, needs):
    office = staffed(role)
    office.fire(12)
    reply, sends = decide(office, body, 1.0)
    if LEVELS.index(role) >= LEVELS.index(needs):
        assert reply.code in (m.OK, m.BUSY, m.WRONG_MODE)  # at the event already; not stopped
    else:
        assert (reply.code, sends) == (m.NOT_PERMITTED, [])
        assert f"needs {needs}" in reply.text


UNLISTED = "02:00:00:07:00:09"
TYPES = ("ControlRoom", "TeleOp", "Teleoperation", "Remote Control", "Guard", "Sensor", "Robot")


@pytest.mark.parametrize("kind", TYPES)
def test_a_device_of_which_the_dva_was_told_nothing_may_look_and_no_more(office, kind):
    office.fire(12)
    office.register(UNLISTED, kind)
    reply, _ = decide(office, m.GetDispatch(), room=UNLISTED)
    assert reply.content == m.DispatchStatus("automatic", 60.0, None, "look")
    reply, _ = decide(office, m.GetEventList(), room=UNLISTED)
    assert [status.event_id for status in reply.content.events] == [1]
    reply, _ = decide(office, m.FalseAlarm(1, "toast"), room=UNLISTED)
    assert (reply.code, "needs dispatch" in reply.text) == (m.NOT_PERMITTED, True)
    assert office.event().open


@pytest.mark.parametrize("kind", ["TeleOp", "Remote Control"])
def test_a_phone_decides_as_its_role_allows_and_is_asked_first(kind):
    office = Office(roles={UNLISTED: "dispatch"}, ask_first=True)
    office.register(UNLISTED, kind)
    office.fire(12)
    assert office.event().state is State.PENDING
    assert decide(office, m.FalseAlarm(1, "toast"), room=UNLISTED)[0].code == m.OK
    assert office.event().state is State.REFUTED


@pytest.mark.parametrize(
    ("kind", "follows"),
    [("TeleOp", True), ("Remote Control", True), ("Sensor", False), ("Robot", False)],
)
def test_people_who_report_an_event_get_its_number_and_state(office, kind, follows):
    office.register(UNLISTED, kind)
    report = m.EventReport(None, "flood", east(30), 0.5, 0.9, "detected")
    reply, _ = decide(office, report, room=UNLISTED)
    if follows:
        assert (reply.content.event_id, reply.content.kind) == (1, "flood")
        assert reply.content.event_state == office.event().state
    else:
        assert (reply.code, reply.content) == (m.OK, None)


def test_where_reports_are_not_merged_who_raises_a_second_event_gets_its_number_and_a_row():
    office = staffed(rules=Rules(merge_distance=0.0))
    report = m.EventReport(None, "flood", east(30), 0.5, 0.9, "detected")
    replies = [decide(office, report, now)[0] for now in (1.0, 2.0)]
    assert [reply.content.event_id for reply in replies] == [1, 2]
    assert [fact.event for fact in facts(office) if fact.action == "raise"] == [1, 2]


@pytest.mark.parametrize(("role", "code"), [("dispatch", m.NOT_PERMITTED), ("supervise", m.BUSY)])
def test_only_who_supervises_takes_a_robot_without_asking(role, code):
    office = staffed(role)
    office.say(OPERATOR, m.PermissionRequest(ROBOT, "teleoperation"))
    reply, _ = decide(office, m.PermissionRequest(ROBOT, "missions", (), "force"), 1.0)
    assert reply.code == code
    (fact,) = facts(office)
    assert (fact.action, fact.author, fact.code, fact.device) == ("take_over", ROOM, code, ROBOT)


@pytest.mark.invariant("S5")
def test_a_revoked_permission_ends_for_robot_and_holder_and_frees_the_event():
    office = staffed("supervise", ask_first=True)
    office.fire(12)
    decide(office, m.Assign(1, ROBOT), 1.0)
    office.say(OPERATOR, m.PermissionRequest(ROBOT, "teleoperation"), 2.0)
    reply, sends = decide(office, m.Revoke(ROBOT, "nobody answers there"), 3.0)
    revoked = [send for send in sends if isinstance(send.body, m.PermissionRevocation)]
    assert reply.code == m.OK
    assert {send.to for send in revoked} == {ROBOT, OPERATOR}
    assert Send(OPERATOR, OVER) in sends
    assert office.event().state is State.PENDING
    assert decide(office, m.Revoke(ROBOT), 4.0)[0].text == "nobody holds it"


# --- sending -----------------------------------------------------------------------------------


def test_who_is_sent_gets_the_order_and_the_policy_is_overruled(office):
    office.fire(12)  # the robot is sent
    facts(office)
    reply, sends = decide(office, m.Assign(1, GUARD, reason="it is locked", decisions=1), 2.0)
    assert sends == [Send(OPERATOR, OVER), Send(GUARD, order(1))]
    assert isinstance(reply.content, m.EventStatus)
    assert (reply.content.event_state, reply.content.responder) == ("assigned", GUARD)
    (fact,) = facts(office)
    assert (fact.action, fact.device, fact.advised) == ("assign", GUARD, ROBOT)
    assert fact.overrides
    assert fact.cause == "it is locked"
    assert fact.arrival_in == pytest.approx(20 + 12 / 1.3, abs=0.1)
    assert fact.advised_in == pytest.approx(4 + 2 / 0.35 - 2.0, abs=0.1)


def test_a_robot_is_driven_by_whom_the_control_room_names():
    office = staffed(ask_first=True)
    office.register(OTHER_OPERATOR, "Remote Control")
    office.fire(12)
    _, sends = decide(office, m.Assign(1, ROBOT, OTHER_OPERATOR), 1.0)
    assert sends == [Send(OTHER_OPERATOR, order(1, ROBOT))]
    office.finds(OTHER_OPERATOR, "confirmed", 9.0)
    assert office.event().state is State.CONFIRMED


def test_a_control_room_may_drive_itself_and_names_no_other():
    office = staffed(ask_first=True)
    office.fire(12)
    reply, _ = decide(office, m.Assign(1, ROBOT, OTHER_ROOM), 1.0)
    assert reply.code == m.NOT_PERMITTED
    assert decide(office, m.Assign(1, ROBOT, ROOM), 1.0)[1] == [Send(ROOM, order(1, ROBOT))]


def test_who_is_at_an_event_is_not_called_away_by_being_sent_to_another(office):
    office.fire(12)
    office.fire(60, now=1.0)
    reply, sends = decide(office, m.Assign(2, ROBOT, decisions=1), 2.0)
    assert (reply.code, sends) == (m.BUSY, [])
    assert unnamed(reply.text, "robot ", "event 1") == []


@pytest.mark.invariant("S5")
def test_a_robot_in_somebody_elses_hands_is_not_sent():
    office = staffed(ask_first=True)
    office.register(OTHER_OPERATOR, "Remote Control")
    office.say(OTHER_OPERATOR, m.PermissionRequest(ROBOT, "teleoperation"))
    office.fire(12)
    reply, sends = decide(office, m.Assign(1, ROBOT), 5.0)
    assert (reply.code, sends) == (m.BUSY, [])
    assert "remote control" in reply.text


def test_nobody_is_called_from_a_scene_but_by_being_taken_off(office):
    office.fire(12)
    office.progress(OPERATOR, "arrived", 5.0)
    status = decide(office, m.GetEventList(), 6.0)[0].content
    assert isinstance(status, m.EventList)
    now = status.events[0].decisions
    assert decide(office, m.Assign(1, GUARD, decisions=now), 6.0)[0].code == m.BUSY
    assert decide(office, m.TakeOff(1, ROBOT, decisions=now), 7.0)[0].code == m.OK


def test_who_was_taken_off_is_not_sent_there_again_by_the_policy(office):
    office.fire(12)
    _, sends = decide(office, m.TakeOff(1, ROBOT, "its battery is low"), 1.0)
    assert sends == [Send(OPERATOR, OVER), Send(GUARD, order(1))]
    _, sends = decide(office, m.TakeOff(1, GUARD), 2.0)
    assert sends == [Send(GUARD, OVER), Send(OTHER_GUARD, order(1))]
    decide(office, m.TakeOff(1, OTHER_GUARD), 3.0)
    assert office.event().state is State.PENDING
    assert office.event().attempts == 0


@pytest.mark.invariant("S6")
def test_an_event_nobody_is_left_for_is_escalated_at_its_deadline_all_the_same(office):
    office.fire(12)
    for device in (ROBOT, GUARD, OTHER_GUARD):
        decide(office, m.TakeOff(1, device), 1.0)
    office.tick(119.0)
    assert office.event().state is State.PENDING
    office.tick(121.0)
    assert office.event().state is State.ESCALATED
    assert [f.action for f in facts(office)][-1] == "escalate"


def test_a_guard_stands_by_and_deals_with_it_as_a_control_room_wants():
    office = staffed(ask_first=True, rules=CONTAINING)
    office.fire(12)
    assert decide(office, m.Assign(1, GUARD, None, "contain"), 1.0)[0].code == m.WRONG_MODE
    assert decide(office, m.Assign(1, ROBOT, None, "stand_by"), 1.0)[0].code == m.NOT_SUPPORTED
    assert decide(office, m.Assign(1, GUARD, None, "stand_by"), 1.0)[0].code == m.WRONG_MODE
    decide(office, m.Assign(1, ROBOT), 2.0)
    _, sends = decide(office, m.Assign(1, GUARD, None, "stand_by"), 2.0)
    assert sends == [Send(GUARD, order(1, task="stand_by"))]
    _, sends = office.finds(OPERATOR, "confirmed", 9.0)
    assert Send(GUARD, order(1, task="contain")) in sends
    office.finds(GUARD, "contained", 60.0)
    assert office.event().state is State.CONTAINED


def test_who_sends_another_to_deal_with_an_event_does_not_close_it_however_long_it_has_waited():
    office = staffed(ask_first=True, rules=CONTAINING)
    office.fire(12)
    decide(office, m.Assign(1, ROBOT), 1.0)
    office.finds(OPERATOR, "confirmed", 9.0)
    decide(office, m.Assign(1, GUARD, None, "contain"), 10.0)  # who does not answer
    seen = office.event().handling.decisions
    late = 10.0 + CONTAINING.escalate_after + 1.0
    reply, sends = decide(office, m.Assign(1, OTHER_GUARD, None, "contain", decisions=seen), late)
    assert (reply.code, office.event().state) == (m.OK, State.CONFIRMED)
    assert sends == [Send(GUARD, OVER), Send(OTHER_GUARD, order(1, task="contain"))]


def test_where_nothing_is_contained_nobody_is_sent_to():
    office = staffed(ask_first=True)
    office.fire(12)
    assert decide(office, m.Assign(1, GUARD, None, "contain"), 1.0)[0].code == m.NOT_SUPPORTED


# --- ending it ---------------------------------------------------------------------------------


@pytest.mark.invariant("S6")
@pytest.mark.parametrize(
    ("body", "state"),
    [(m.FalseAlarm(1, "toast"), State.REFUTED), (m.Escalate(1, "call them"), State.ESCALATED)],
)
@pytest.mark.parametrize("stage", ["pending", "assigned", "on scene", "confirmed"])
def test_from_each_stage_an_event_is_ended_once_and_who_was_sent_hears_it(body, state, stage):
    office = staffed(ask_first=stage == "pending", rules=CONTAINING)
    office.fire(12)
    if stage == "on scene":
        office.progress(OPERATOR, "arrived", 5.0)
    if stage == "confirmed":
        office.finds(OPERATOR, "confirmed", 5.0)
    assert office.event().state == stage
    _, sends = decide(office, body, 6.0)
    assert office.event().state is state
    assert sum(office.core.events.counts.values()) == office.core.events.total == 1
    kinds = {send.to for send in sends if send.body == OVER}
    assert kinds == {"pending": set(), "confirmed": {GUARD}}.get(stage, {OPERATOR})
    reply, sends = decide(office, m.Assign(1, GUARD), 8.0, OTHER_ROOM)
    assert (reply.code, sends) == (m.OUT_OF_ORDER, [])
    assert unnamed(reply.text, "controlroom", "2.0 s") == []


# --- who wins ----------------------------------------------------------------------------------


def test_of_two_who_act_at_once_one_wins_and_the_other_is_told_by_whom_and_why():
    office = staffed(ask_first=True)
    office.fire(12)
    assert decide(office, m.Assign(1, GUARD, reason="nearest", decisions=0), 1.0)[0].code == m.OK
    reply, sends = decide(office, m.FalseAlarm(1, "toast", decisions=0), 1.5, OTHER_ROOM)
    assert (reply.code, sends) == (m.OUT_OF_ORDER, [])
    assert not unnamed(reply.text, "event 1", "assign of guard", "0.5 s", "nearest")
    assert isinstance(reply.content, m.EventStatus)
    last = reply.content.last_decision
    assert last == m.LastDecision(ROOM, "controlroom", "assign", 0.5, "nearest")
    assert office.event().state is State.ASSIGNED


def test_without_having_seen_it_nobody_takes_an_event_out_of_anothers_hands():
    office = staffed(ask_first=True)
    office.fire(12)
    decide(office, m.Assign(1, GUARD), 1.0)
    reply, sends = decide(office, m.Assign(1, OTHER_GUARD), 1.5, OTHER_ROOM)
    assert (reply.code, sends) == (m.BUSY, [])


def test_the_first_to_acknowledge_has(office):
    office.fire(12)
    assert decide(office, m.Acknowledge(1), 3.0)[0].code == m.OK
    reply, _ = decide(office, m.Acknowledge(1), 5.0, OTHER_ROOM)
    assert (reply.code, unnamed(reply.text, "controlroom", "2.0 s")) == (m.OUT_OF_ORDER, [])
    assert decide(office, m.Acknowledge(1), 6.0)[0].code == m.OK
    assert [f.code for f in facts(office) if f.action == "acknowledge"] == [m.OK, m.OUT_OF_ORDER]


@pytest.mark.parametrize(
    "body",
    [
        m.Acknowledge(1),
        m.Assign(1, GUARD, decisions=0),
        m.FalseAlarm(1, "toast", decisions=0),
        m.Escalate(1, decisions=0),
    ],
)
def test_the_same_decision_once_more_changes_nothing(body):
    office = staffed(ask_first=True)
    office.fire(12)
    decide(office, body, 1.0)
    before = repr(office.event())
    facts(office)
    reply, sends = decide(office, body, 2.0)
    assert (reply.code, sends, repr(office.event()), facts(office)) == (m.OK, [], before, [])


def test_what_is_not_there_is_refused_by_name(office):
    office.fire(12)
    assert decide(office, m.Acknowledge(7))[0].code == m.UNKNOWN_EVENT
    assert decide(office, m.Assign(1, OPERATOR, decisions=1))[0].code == m.UNKNOWN_DEVICE
    assert decide(office, m.TakeOff(1, OTHER_GUARD))[0].code == m.WRONG_MODE
    assert decide(office, m.EventStatus(1, "fire", east(1), 0, 0, "pending", 0, 0, 0))[0].code == (
        m.NOT_SUPPORTED
    )


# --- asked first -------------------------------------------------------------------------------


def test_asked_first_the_policy_proposes_and_sends_nobody():
    office = staffed(ask_first=True)
    assert office.fire(12, now=1.0) == []
    content = decide(office, m.GetEventList(), 3.0)[0].content
    assert isinstance(content, m.EventList)
    (status,) = content.events
    assert status.waits_for == "confirm"
    assert status.proposed is not None
    assert (status.proposed.device, status.proposed.task) == (ROBOT, "confirm")
    assert status.proposed.decide_within == 58.0
    _, sends = decide(office, m.Assign(1, ROBOT), 4.0)
    assert sends == [Send(OPERATOR, order(1, ROBOT))]
    assert [(f.device, f.advised, f.overrides) for f in facts(office)] == [(ROBOT, ROBOT, False)]


@pytest.mark.invariant("S6")
def test_what_nobody_has_decided_in_time_is_done_as_proposed():
    office = staffed(ask_first=True)
    office.fire(12, now=1.0)
    assert office.tick(60.0) == []
    assert office.core.next_deadline() <= 61.0
    assert office.tick(61.0) == [Send(OPERATOR, order(1, ROBOT))]
    (fact,) = facts(office)
    assert (fact.author, fact.role, unnamed(fact.cause, "60 s")) == (DVA, None, [])


def test_a_question_does_not_wait_longer_because_another_is_proposed():
    office = staffed(ask_first=True)
    office.fire(12, now=1.0)
    office.silence(ROBOT, 30.0)
    office.beat(*(d for d in office.core.registry.entries if d != ROBOT), now=60.9)
    assert office.tick(61.0, alive=False) == [Send(GUARD, order(1))]


def test_a_question_is_news_when_its_proposal_changes_or_when_it_is_gone():
    event, questions = Event(1, "fire", east(12), 0.5), Questions(60.0)
    rounds = [(ROBOT, True), (ROBOT, False), (GUARD, True), (None, True), (None, False)]
    for now, (device, is_news) in enumerate(rounds):
        if device is not None:
            assert questions.ask(event, "confirm", device, 10.0, float(now))
        assert questions.settle() == [event] * is_news, now


def test_where_nobody_is_there_who_may_decide_nobody_is_asked():
    office = Office(rules=RULES, roles={ROOM: "drive"}, ask_first=True)
    office.register(ROOM, "ControlRoom")
    assert office.fire(12) == [Send(OPERATOR, order(1, ROBOT))]


def test_switched_to_automatic_what_was_asked_is_done():
    office = staffed("supervise", ask_first=True)
    office.fire(12, now=1.0)
    reply, sends = decide(office, m.SetDispatch("automatic", "too much to do"), 2.0)
    assert sends == [Send(OPERATOR, order(1, ROBOT))]
    assert reply.content == m.DispatchStatus(
        "automatic", 60.0, m.ByWhom(ROOM, "controlroom", 0.0), "supervise"
    )
    assert decide(office, m.SetDispatch("ask_first"), 3.0)[1] == []
    assert office.fire(60, now=4.0) == []


# --- the proposal and its reasons ----------------------------------------------------------------


def test_a_proposal_names_everybody_with_a_time_and_a_reason():
    office = staffed(ask_first=True)
    office.fire(60, now=0.0)
    decide(office, m.Assign(1, OTHER_GUARD), 1.0)
    office.fire(12, now=2.0)
    content = decide(office, m.GetProposal(2), 2.0)[0].content
    assert isinstance(content, m.Proposal)
    assert (content.device, content.task, content.decide_within) == (ROBOT, "confirm", 60.0)
    assert not unnamed(content.reason, "first", " 2 ")
    reasons = {c.device: c.reason for c in content.candidates}
    assert reasons == {ROBOT: "free", GUARD: "free", OTHER_GUARD: "is at event 1"}
    times = {c.device: c.arrival_in for c in content.candidates}
    assert times[GUARD] == pytest.approx(20 + 12 / 1.3, abs=0.1)
    assert content.candidates[0].device == ROBOT


@pytest.mark.parametrize("progress", ["departed", "arrived"])
def test_a_robot_that_goes_by_itself_is_passed_on_to_a_colleague(progress):
    office = staffed()
    office.silence(OPERATOR, 0.0)
    office.fire(12, now=1.0)
    decide(office, m.TakeOff(1, GUARD, decisions=office.event(1).handling.decisions), 1.0)
    body = m.Assign(1, ROBOT, ROOM, decisions=office.event(1).handling.decisions)
    assert decide(office, body, 2.0)[0].code == m.OK
    office.progress(ROOM, progress, 3.0)
    assert office.say(ROOM, m.PermissionRequest(ROBOT, "missions"), 3.0)[0].code == m.OK

    unseen = m.Assign(1, ROBOT, OTHER_ROOM)
    assert decide(office, unseen, 4.0, OTHER_ROOM)[0].code == m.BUSY
    body = m.Assign(1, ROBOT, OTHER_ROOM, decisions=office.event(1).handling.decisions)
    reply, sends = decide(office, body, 5.0, OTHER_ROOM)
    assert reply.code == m.OK
    assert (office.event(1).responder, office.event(1).operator) == (ROBOT, OTHER_ROOM)
    told = [(send.to, type(send.body)) for send in sends]
    assert (ROOM, m.OrderProgress) in told
    assert (OTHER_ROOM, m.Order) in told
    asked = m.PermissionRequest(ROBOT, "missions")
    assert office.say(OTHER_ROOM, asked, 6.0)[0].code == m.OK
    assert office.say(ROOM, asked, 6.0)[0].code == m.BUSY


def test_a_proposal_tells_that_no_way_leads_to_a_place(monkeypatch):
    office = staffed(ask_first=True)
    nowhere = np.full((1, 3), np.inf)
    monkeypatch.setattr(office.core.dispatcher.situations, "travel", lambda *_: (nowhere, nowhere))
    office.fire(12)
    content = decide(office, m.GetProposal(1), 1.0)[0].content
    assert isinstance(content, m.Proposal)
    assert (content.device, unnamed(content.reason, "no way")) == (None, [])


def test_a_proposal_tells_why_nobody_can_go():
    office = staffed(ask_first=True)
    office.fire(12)
    for device in (ROBOT, GUARD):
        decide(office, m.Assign(1, device), 1.0)
        decide(office, m.TakeOff(1, device), 2.0)
    office.silence(OTHER_GUARD, 30.0)
    content = decide(office, m.GetProposal(1), 30.0)[0].content
    assert isinstance(content, m.Proposal)
    assert (content.device, content.reason) == (None, "nobody can go")
    reasons = {c.device: c.reason for c in content.candidates}
    assert "taken off" in reasons[ROBOT]
    assert reasons[OTHER_GUARD].startswith("not heard of for")


def test_who_only_asks_consumes_no_random_numbers():
    def sent(asks: int) -> list[Send]:
        from dva_sim.core.dispatch import RandomChoice

        office = Office(RandomChoice(), RULES, roles={ROOM: "look"})
        for room, kind in ((ROOM, "ControlRoom"), (OTHER_GUARD, "Guard")):
            office.register(room, kind, 40.0 if kind == "Guard" else None)
        office.busy(GUARD, ROBOT, OTHER_GUARD)
        for number in range(1, 4):
            office.fire(60.0 * number)
        for _ in range(asks):
            decide(office, m.GetProposal(1), 1.0)
        office.idle(GUARD, ROBOT, OTHER_GUARD)
        return office.tick(2.0)

    assert sent(0) == sent(5)
    assert len(sent(0)) == 3


# --- lists ---------------------------------------------------------------------------------------


def test_whatever_people_are_called_and_write_the_status_of_an_event_is_a_message():
    event = Event(1, "fire", east(12), 0.5)
    choice = Choice(ROOM, "n" * 300, "assign", 1.0, "r" * 900)
    event.handling = Handling(last=choice, acknowledged=choice, note="n" * 900)
    content = m.EventList((status_of(event, None, 2.0),))
    message = m.Message(ROOM, 1, DVA, "12:00:00", 0, m.Reply(1, m.OK, "", content))
    assert decode(encode(message)) == message


def test_the_list_is_told_in_parts_and_none_is_missing():
    office = staffed(ask_first=True)
    for number in range(40):
        office.fire(30.0 * number, now=1.0, kind="flood")
    for number in range(1, 41):
        decide(office, m.AddNote(number, "&" * 256), 2.0)
    found: list[int] = []
    while True:
        content = decide(office, m.GetEventList(found[-1] if found else None), 3.0)[0].content
        assert isinstance(content, m.EventList)
        if not content.events:
            break
        found += [status.event_id for status in content.events]
    assert found == list(range(1, 41))
