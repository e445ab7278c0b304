"""The event table: reports become events, each in one state, its times in order."""

import operator

import pytest
from helpers.dva.dispatch_office import (
    DETECTOR,
    GUARD,
    HERE,
    OPERATOR,
    OTHER_DETECTOR,
    ROBOT,
    Office,
    east,
)
from helpers.paths import ROOT

from dva_sim.core import events
from dva_sim.core.assignments import Rules
from dva_sim.core.event_status import status_of
from dva_sim.core.events import (
    KEPT_CLOSED,
    LOOKING,
    MAX_SOURCES,
    TRANSITIONS,
    Cause,
    Event,
    EventTable,
    OrderEnd,
    State,
)
from dva_sim.protocol import messages as m


@pytest.fixture
def office() -> Office:
    office = Office()
    office.register(OTHER_DETECTOR, "Sensor")
    return office


def waiting_office() -> Office:
    """Office in which nobody is free."""
    office = Office()
    office.register(OTHER_DETECTOR, "Sensor")
    office.busy(GUARD, ROBOT, OPERATOR)
    return office


# --- reports -------------------------------------------------------------------------------


def test_reports_of_one_kind_within_8_metres_are_one_event(office):
    office.fire(12)
    office.fire(19.9)
    office.fire(20.1)
    office.fire(12, kind="gas_leak")
    assert {e.number: e.reports for e in office.core.events.open.values()} == {1: 2, 2: 1, 3: 1}


def test_where_reports_are_not_merged_each_is_an_event():
    office = Office(rules=Rules(merge_distance=0.0))
    office.fire(12)
    office.fire(12)
    assert office.core.events.total == 2


def test_an_event_that_is_over_takes_no_more_reports(office):
    office.fire(12)
    office.finds(OPERATOR, "refuted", 3.0)
    office.fire(12, now=4.0)
    assert (office.event(1).reports, office.event(2).reports) == (1, 1)


def test_a_report_said_twice_by_one_source_is_not_more_certain(office):
    office.fire(12, confidence=0.6)
    office.fire(12, confidence=0.6)
    assert office.event().confidence == pytest.approx(0.6)
    office.fire(12, confidence=0.7)
    assert office.event().confidence == pytest.approx(0.7)


def test_two_sources_of_06_and_05_that_err_independently_make_08(office):
    office.fire(12, confidence=0.6)
    office.fire(12, confidence=0.5, source=OTHER_DETECTOR)
    assert office.event().confidence == pytest.approx(0.8)


def test_a_status_rounds_its_confidence(office):
    office.fire(12, confidence=0.7)
    office.fire(12, confidence=0.7, source=OTHER_DETECTOR)
    assert office.event().confidence != 0.91
    assert status_of(office.event(), None, 0.0).confidence == 0.91


def test_an_event_is_as_severe_as_the_worst_report(office):
    for severity in (0.3, 0.9, 0.5):
        office.fire(12, severity=severity)
    assert office.event().severity == 0.9


def test_of_one_event_at_most_64_sources_are_told_apart():
    events = EventTable()
    event = events.add("fire", HERE, 0.5, 0.0)
    for number in range(MAX_SOURCES + 10):
        events.note_source(event, str(number), 0.5)
    assert len(event.sources) == 64


@pytest.mark.invariant("S10")
def test_when_the_event_table_is_full_a_report_is_answered_busy_and_one_of_a_known_event_is_not(
    office, monkeypatch
):
    monkeypatch.setattr(events, "MAX_OPEN", 1)
    office.fire(12)
    new = m.EventReport(None, "fire", east(90), 0.5, 0.9, "detected")
    assert office.say(DETECTOR, new)[0].code == m.BUSY
    known = m.EventReport(None, "fire", east(12), 0.5, 0.9, "detected")
    assert office.say(DETECTOR, known)[0].code == m.OK
    assert office.core.events.total == 1


# --- withdrawal ----------------------------------------------------------------------------


def test_what_its_only_source_withdraws_before_anybody_was_sent_has_expired():
    office = waiting_office()
    office.fire(12, now=1.0)
    office.withdraw(12, now=5.0)
    assert office.event().state is State.EXPIRED
    assert office.event().times == {"detected": 1.0, "closed": 5.0}
    assert office.core.events.waiting == {}


def test_an_event_expires_only_when_the_last_of_its_sources_has_withdrawn_it():
    office = waiting_office()
    office.fire(12, source=DETECTOR)
    office.fire(14, source=OTHER_DETECTOR)
    office.withdraw(12, source=DETECTOR)
    office.withdraw(12, source=DETECTOR)
    assert office.event().state is State.PENDING
    assert list(office.event().sources) == [OTHER_DETECTOR]
    office.withdraw(14, source=OTHER_DETECTOR)
    assert office.event().state is State.EXPIRED


def test_nobody_can_withdraw_what_another_has_reported():
    office = waiting_office()
    office.fire(12)
    office.withdraw(12, source=OTHER_DETECTOR)
    assert office.event().state is State.PENDING


def test_once_somebody_is_on_the_way_a_withdrawal_ends_nothing(office):
    office.fire(12)
    office.withdraw(12, now=1.0)
    assert office.event().state is State.ASSIGNED
    assert office.event().confidence == 0.0


def test_a_withdrawal_elsewhere_or_of_another_kind_ends_nothing():
    office = waiting_office()
    office.fire(12, kind="flood")
    office.fire(90)
    office.withdraw(12)
    assert office.core.events.counts[State.PENDING] == 2


# --- states and times ----------------------------------------------------------------------


@pytest.mark.invariant("S7")
def test_an_event_runs_its_course_with_its_times_in_order(office):
    office.fire(12, now=1.0)
    office.progress(OPERATOR, "departed", 3.0)
    office.progress(OPERATOR, "arrived", 9.0)
    assert office.event().state is State.ON_SCENE
    office.finds(OPERATOR, "confirmed", 12.0)
    assert office.event().state is State.CONFIRMED
    office.progress(OPERATOR, "done", 13.0)
    assert office.event().times == {
        "detected": 1.0,
        "assigned": 1.0,
        "departed": 3.0,
        "arrived": 9.0,
        "confirmed": 12.0,
        "closed": 12.0,
    }
    assert office.working == {}


def test_every_step_is_a_change_that_the_memory_hears_of(office):
    office.fire(12)
    events = office.core.events
    for state in ("departed", "arrived"):
        events.changes()
        office.progress(OPERATOR, state, 3.0)
        assert [event.number for event in events.changes()] == [1]


def test_who_finds_something_was_there_even_if_its_arrival_was_lost(office):
    office.fire(12, now=1.0)
    office.finds(OPERATOR, "confirmed", 12.0)
    times = office.event().times
    assert [times[step] for step in ("departed", "arrived", "confirmed")] == [12.0, 12.0, 12.0]


def test_an_event_that_waits_again_has_not_been_departed_for(office):
    office.fire(12, now=1.0)
    office.progress(OPERATOR, "arrived", 9.0)
    office.busy(GUARD)
    office.busy(OPERATOR, ROBOT)
    office.idle(OPERATOR, ROBOT)
    for name in (OPERATOR, ROBOT):
        office.core.orders.engaged.begin(name, office.event())
    office.progress(OPERATOR, "failed", 10.0)
    assert set(office.event().times) == {"detected", "assigned"}  # to the same again


@pytest.mark.invariant("S6")
def test_each_event_is_in_one_state_and_the_counts_add_up_to_all():
    events = EventTable()
    for number in range(6):
        events.add("fire", east(100 * number), 0.5, 0.0)
    events.move(events.open[2], Cause.ORDERED, 1.0)
    events.move(events.open[3], Cause.WITHDRAWN, 1.0)
    events.move(events.open[4], Cause.CONFIRMED, 1.0)
    assert {s.value: n for s, n in events.counts.items() if n} == {
        "pending": 3,
        "assigned": 1,
        "expired": 1,
        "confirmed": 1,
    }
    assert sum(events.counts.values()) == events.total == 6


def test_the_last_1000_closed_events_are_kept():
    events = EventTable()
    for _ in range(KEPT_CLOSED + 1):
        events.move(events.add("fire", HERE, 0.5, 0.0), Cause.WAITED, 1.0)
    assert events.get(1) is None
    assert events.get(2) is not None
    assert len(events.closed) == 1000


# --- the transition table ------------------------------------------------------------------

NAME = operator.attrgetter("name")
PATHS: dict[State, tuple[Cause, ...]] = {
    State.PENDING: (),
    State.ASSIGNED: (Cause.ORDERED,),
    State.ON_SCENE: (Cause.ORDERED, Cause.ARRIVED),
    State.CONFIRMED: (Cause.ORDERED, Cause.ARRIVED, Cause.CONFIRMED),
    State.CONTAINED: (Cause.CONFIRMED, Cause.CONTAINED),
    State.REFUTED: (Cause.REFUTED,),
    State.ESCALATED: (Cause.WAITED,),
    State.EXPIRED: (Cause.WITHDRAWN,),
}
"""Causes that bring a new event into each state."""


def event_in(state: State, contain: bool = True) -> tuple[Office, Event]:
    """An office with one event, brought into a state by the table."""
    office = Office(rules=Rules(containment=contain))
    event = office.core.events.add("fire", HERE, 0.5, 0.0, contain)
    for cause in PATHS[state]:
        if cause is Cause.ORDERED:
            office.core.orders.confirm(event, ROBOT, OPERATOR, 1.0)
        else:
            office.core.orders.transition(event, cause, 1.0)
    assert event.state is state
    return office, event


@pytest.mark.invariant("S6", "S7")
@pytest.mark.parametrize("state", State)
@pytest.mark.parametrize("cause", Cause, ids=NAME)
def test_each_cause_in_each_state_is_a_transition_of_the_table_or_refused(state, cause):
    office, event = event_in(state)
    events, transition = office.core.events, TRANSITIONS[cause]
    before = repr(event), dict(events.counts), office.working
    if state in transition.starts:
        office.core.orders.transition(event, cause, 2.0)
        assert event.state is transition.end
        assert (event.number in events.open) is event.open
        assert ("closed" in event.times) is not event.open
        assert list(event.times.values()) == sorted(event.times.values())
    else:
        with pytest.raises(ValueError, match=f"event 1 is {state}: no transition for: {cause}"):
            office.core.orders.transition(event, cause, 2.0)
        assert (repr(event), events.counts, office.working) == before
    assert sum(events.counts.values()) == events.counts[event.state] == 1


@pytest.mark.parametrize("cause", Cause, ids=NAME)
def test_without_containment_an_event_is_over_once_it_is_confirmed(cause):
    office, event = event_in(State.CONFIRMED, contain=False)
    with pytest.raises(ValueError, match="event 1 is confirmed"):
        office.core.orders.transition(event, cause, 2.0)


def test_every_state_is_reached_and_every_open_one_can_be_left():
    assert set(TRANSITIONS) == set(Cause)
    assert {row.end for row in TRANSITIONS.values()} == set(State)
    open_states = {State.PENDING, *LOOKING, State.CONFIRMED}
    assert {state for row in TRANSITIONS.values() for state in row.starts} == open_states


@pytest.mark.parametrize("state", LOOKING)
@pytest.mark.parametrize(
    "cause", [cause for cause, row in TRANSITIONS.items() if {*LOOKING} <= {*row.starts}], ids=NAME
)
def test_the_order_to_look_ends_and_its_device_and_session_with_it_as_the_table_says(cause, state):
    office, event = event_in(state)
    office.say(OPERATOR, m.PermissionRequest(ROBOT, "teleoperation"), 1.0)
    sends = office.core.orders.transition(event, cause, 2.0)
    end = TRANSITIONS[cause].order
    assert (ROBOT in office.working) is (end is OrderEnd.LEFT)
    recalled = [send.to for send in sends if isinstance(send.body, m.OrderProgress)]
    assert recalled == [OPERATOR] * (end is OrderEnd.RECALLED)
    holds = ROBOT in office.core.sessions.permissions.grants
    assert holds is (end in (OrderEnd.LEFT, OrderEnd.FREED))


@pytest.mark.parametrize("last", [False, True])
@pytest.mark.parametrize(
    "cause", [cause for cause, row in TRANSITIONS.items() if row.retries], ids=NAME
)
def test_an_order_that_failed_is_followed_by_another_unless_it_was_the_last(cause, last):
    office, event = event_in(State.ASSIGNED)
    event.attempts = office.core.orders.rules.max_attempts if last else 1
    office.core.orders.transition(event, cause, 2.0)
    assert event.state is (State.ESCALATED if last else State.PENDING)


@pytest.mark.parametrize("cause", Cause, ids=NAME)
def test_the_audit_log_has_an_entry_of_each_decision_of_a_rule(cause):
    row = TRANSITIONS[cause]
    office, event = event_in(row.starts[0])
    office.core.orders.transition(event, cause, 2.0)
    logged = [(fact.label, fact.cause) for fact in office.core.trail.take()]
    assert logged == [("rule", row.log)] * bool(row.log)


def test_the_page_about_runs_shows_the_table():
    rows = [
        (
            cause.value,
            ", ".join(row.starts),
            row.end.value + ", or escalated if it was the last order" * row.retries,
            row.order.value if set(LOOKING) & set(row.starts) else "",
            row.log,
        )
        for cause, row in TRANSITIONS.items()
    ]
    table = "\n".join(
        ["| --- | --- | --- | --- | --- |", *(f"| {' | '.join(row)} |" for row in rows)]
    )
    page = ROOT / "docs/explanation/how-a-run-works.md"
    assert f"\n{table}\n\n" in page.read_text(), f"write the table into {page.name}:\n{table}"


# --- findings ------------------------------------------------------------------------------


def test_only_who_was_sent_can_tell_what_was_found(office):
    office.fire(12)
    assert office.finds(DETECTOR, "confirmed", 2.0)[0].code == m.NOT_PERMITTED
    assert office.event().state is State.ASSIGNED
    assert office.finds(OPERATOR, "confirmed", 3.0)[0].code == m.OK
    assert office.event().state is State.CONFIRMED


def test_of_an_event_that_there_never_was_nobody_can_tell(office):
    assert office.finds(OPERATOR, "confirmed", event=5)[0].code == m.UNKNOWN_EVENT


@pytest.mark.parametrize(("kind", "metres"), [("gas_leak", 12), ("fire", 60)])
def test_a_finding_of_another_event_that_had_the_number_is_refused(office, kind, metres):
    """A DVA that could write nothing and was killed gives the same numbers again."""
    office.fire(12)
    found = m.EventReport(1, kind, east(metres), 0.5, 0.9, "confirmed")
    assert office.say(OPERATOR, found, 2.0)[0].code == m.UNKNOWN_EVENT
    assert office.event().state is State.ASSIGNED
    assert office.finds(OPERATOR, "confirmed", 3.0)[0].code == m.OK


def test_what_somebody_found_who_was_sent_earlier_counts_even_late(office):
    office.fire(12)
    office.progress(OPERATOR, "failed", 5.0)
    assert office.event().responder == GUARD
    assert office.finds(OPERATOR, "confirmed", 6.0)[0].code == m.OK
    assert office.event().state is State.CONFIRMED
    assert "arrived" not in office.event().times  # the guard is still under way
    assert office.working == {GUARD: 1}


def test_a_late_finding_closes_an_event_that_waits(office):
    office.busy(GUARD)
    office.ok(office.fire(12))
    office.beat(GUARD, now=11.0)
    office.core.tick(11.0)
    assert office.event().state is State.PENDING
    office.finds(OPERATOR, "confirmed", 12.0)
    assert office.event().state is State.CONFIRMED


def test_a_finding_about_an_event_that_is_over_changes_nothing(office):
    office.fire(12)
    office.finds(OPERATOR, "refuted", 5.0)
    office.status(ROBOT, 80, now=6.0)
    assert office.finds(OPERATOR, "confirmed", 7.0)[0].code == m.OK
    assert office.event().state is State.REFUTED
    assert office.core.registry.entries[ROBOT].position == east(80)
