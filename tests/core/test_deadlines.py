"""Nothing hangs: waits that are too long, orders that come to nothing, last words that are lost."""

import math

import pytest
from helpers.dva.dispatch_office import (
    DETECTOR,
    GUARD,
    OPERATOR,
    OTHER_GUARD,
    ROBOT,
    TEAM,
    Office,
)

from dva_sim.core.assignments import Rules
from dva_sim.core.events import State
from dva_sim.core.sessions import Send
from dva_sim.protocol import messages as m

MAX_ATTEMPTS = 4


@pytest.fixture
def office() -> Office:
    return Office()


def state(office: Office, event: int = 1) -> State:
    return office.event(event).state


# --- waiting -------------------------------------------------------------------------------


@pytest.mark.invariant("S6")
def test_pending_beyond_its_deadline_means_escalated(office):
    office.busy(*TEAM)
    office.fire(12, now=0.0)
    office.tick(59.9)
    assert state(office) is State.PENDING
    office.tick(60.0)
    assert state(office) is State.ESCALATED


def test_with_no_patience_an_event_is_escalated_at_once_if_nobody_is_free():
    office = Office(rules=Rules(escalate_after=0.0))
    office.fire(12)
    assert state(office) is State.ASSIGNED
    office.busy(GUARD)
    office.fire(90)
    assert state(office, 2) is State.ESCALATED


def test_with_endless_patience_an_event_waits_for_somebody_for_ever():
    office = Office(rules=Rules(escalate_after=math.inf))
    office.busy(GUARD, ROBOT, OPERATOR)
    office.fire(12)
    office.tick(1e7)
    assert state(office) is State.PENDING
    office.idle(GUARD)
    assert [send.to for send in office.tick(1e7 + 1)] == [GUARD]


def test_of_more_events_than_may_wait_the_newest_is_escalated():
    office = Office(rules=Rules(most_waiting=2))
    office.busy(GUARD, ROBOT, OPERATOR)
    for metres in (10, 40, 70, 90):
        office.fire(metres)
    assert [state(office, n) for n in (1, 2, 3, 4)] == [State.PENDING] * 2 + [State.ESCALATED] * 2


def test_the_newest_is_the_one_detected_last_even_if_an_older_one_waits_again():
    office = Office(rules=Rules(most_waiting=1))
    office.ok(office.fire(12))
    office.busy(GUARD)
    office.fire(40)
    office.busy(OPERATOR)  # it is kept from taking anything else
    office.idle(OPERATOR)
    office.core.orders.engaged.begin(OPERATOR, office.event(1))
    office.core.registry.entries[OPERATOR].free_from = 100.0
    office.progress(OPERATOR, "failed", 5.0)
    assert (state(office, 1), state(office, 2)) == (State.PENDING, State.ESCALATED)


def test_where_nothing_may_wait_an_event_for_which_nobody_is_free_is_lost():
    office = Office(rules=Rules(most_waiting=0))
    office.fire(12)
    office.busy(GUARD)
    office.fire(40)
    assert (state(office, 1), state(office, 2)) == (State.ASSIGNED, State.ESCALATED)


# --- orders that nobody takes up -----------------------------------------------------------


def test_a_declined_order_does_not_count_as_an_attempt(office):
    for _ in range(3 * MAX_ATTEMPTS):
        office.no(office.tick(1.0) or office.fire(12), 1.0)
    assert state(office) is State.PENDING
    assert office.event().attempts == 0


def test_who_declines_an_order_is_not_asked_again_for_10_s(office):
    office.busy(GUARD)
    order = office.fire(12)[0]
    office.no([order], 1.0)
    assert office.tick(10.9) == []
    assert office.core.next_deadline() == pytest.approx(11.0)
    assert [send.to for send in office.tick(11.0)] == [OPERATOR]


def test_who_takes_an_order_up_and_then_declines_it_is_not_asked_again_at_once(office):
    office.busy(GUARD)
    office.ok(office.fire(12))
    assert office.progress(OPERATOR, "declined", 1.0)[1] == []
    assert state(office) is State.PENDING
    assert office.tick(10.9) == []
    assert len(office.tick(11.0)) == 1


def test_an_order_that_is_not_delivered_leaves_the_event_open_to_others(office):
    orders = office.fire(12)
    office.no(orders, 5.0)
    assert (state(office), office.event().responder, office.working) == (State.PENDING, None, {})


def test_an_order_that_nobody_took_up_does_not_end_the_wait(office):
    office.busy(GUARD)
    office.no(office.fire(12, now=0.0), 27.0)
    office.busy(OPERATOR)
    office.tick(59.9)
    assert state(office) is State.PENDING
    office.tick(60.0)
    assert state(office) is State.ESCALATED


def test_fakes_that_never_answer_cannot_keep_an_event_from_its_deadline(office):
    """Two guards by turns get the order, fall silent before their time is up, and come back."""
    office.busy(ROBOT, OPERATOR)
    office.register(OTHER_GUARD, "Guard", 5)
    office.fire(12, now=0.0)
    now = 0.0
    while office.event().open:
        now += 11.0
        fake = office.event().responder
        office.beat(*({GUARD, OTHER_GUARD, ROBOT, OPERATOR} - {fake}), now=now)
        office.core.tick(now)
        assert fake is not None
        office.register(fake, TEAM.get(fake, "Guard"), 5, now)
        assert now < 80
    assert state(office) is State.ESCALATED
    assert office.event().attempts == 0


def test_a_fake_that_says_it_declines_cannot_keep_an_event_from_its_deadline(office):
    office.busy(ROBOT, OPERATOR)
    office.fire(12, now=0.0)
    for now in range(1, 80):
        office.beat(now=now)
        office.progress(GUARD, "declined", now)
        office.core.tick(now)
    assert state(office) is State.ESCALATED


def test_fakes_that_take_every_order_up_and_vanish_end_at_the_fourth_attempt(office):
    office.busy(ROBOT, OPERATOR)
    orders, now = office.fire(12), 0.0
    for _ in range(MAX_ATTEMPTS):
        assert state(office) is State.ASSIGNED
        office.ok(orders, now)
        now += 11.0
        office.beat(ROBOT, OPERATOR, now=now)
        office.core.tick(now)
        office.register(GUARD, "Guard", 0, now)
        orders = office.tick(now)
    assert (state(office), office.event().attempts) == (State.ESCALATED, 4)


def test_only_the_answer_to_an_order_was_lost_if_its_holder_has_set_out(office):
    orders = office.fire(12)
    office.progress(OPERATOR, "departed", 20.0)
    office.no(orders, 27.0)
    assert (state(office), office.working) == (State.ASSIGNED, {OPERATOR: 1, ROBOT: 1})


def test_an_order_declined_after_its_event_was_settled_frees_who_declined(office):
    office.fire(12)
    orders = office.progress(OPERATOR, "failed", 5.0)[1]
    office.finds(OPERATOR, "confirmed", 6.0)
    assert office.working == {GUARD: 1}
    office.no(orders, 7.0)
    assert office.working == {}


def test_news_of_an_order_that_is_another_responders_by_now_takes_nothing_from_it(office):
    """The first one fell silent and was replaced; its request fails only after three attempts."""
    late = office.fire(12)
    assert late[0].to == OPERATOR
    office.beat(GUARD, ROBOT, now=10.5)
    orders = [send for send in office.core.tick(11.0) if isinstance(send.body, m.Order)]
    assert [order.to for order in orders] == [GUARD]
    office.no(late, 27.0)
    assert state(office) is State.ASSIGNED
    assert office.working == {GUARD: 1}
    assert office.progress(GUARD, "arrived", 30.0)[0].code == m.OK


# --- orders that come to nothing -----------------------------------------------------------


def test_a_responder_that_failed_goes_again_if_nobody_else_can(office):
    office.busy(GUARD)
    office.fire(12)
    sends = office.progress(OPERATOR, "failed", 5.0)[1]
    assert [send.to for send in sends] == [OPERATOR]


def test_who_says_done_without_a_finding_has_failed(office):
    office.fire(12)
    sends = office.progress(OPERATOR, "done", 5.0)[1]
    assert [send.to for send in sends] == [GUARD]
    assert office.event().failed == {ROBOT}
    assert office.event().attempts == 1


def test_who_fails_is_replaced_until_the_event_is_escalated_after_its_attempts(office):
    orders, asked = office.fire(12), []
    for _ in range(MAX_ATTEMPTS):
        assert state(office) is State.ASSIGNED
        asked.append(orders[0].to)
        orders = office.progress(asked[-1], "failed", 1.0)[1]
    assert asked[:2] == [OPERATOR, GUARD]
    assert (orders, office.event().attempts, state(office)) == ([], 4, State.ESCALATED)


def test_who_has_not_settled_an_event_after_900_s_gives_it_back_and_is_told(office):
    office.busy(GUARD)
    office.ok(office.fire(12, now=0.0))
    office.tick(899.9)
    assert state(office) is State.ASSIGNED
    office.idle(GUARD)
    sends = office.tick(900.0)
    assert sends[0] == Send(OPERATOR, m.OrderProgress(1, "done"))
    assert [send.to for send in sends] == [OPERATOR, GUARD]
    assert office.core.counters["order took too long"] == 1


@pytest.mark.parametrize("finding", ["confirmed", "refuted"])
def test_who_found_something_and_whose_last_word_was_lost_is_free_900_s_later(office, finding):
    office.fire(12)
    office.finds(OPERATOR, finding, 30.0)
    office.tick(929.9)
    assert office.working == {OPERATOR: 1, ROBOT: 1}
    assert office.tick(930.0) == []
    assert office.working == {}


def test_that_holds_too_while_somebody_else_has_still_to_deal_with_the_event():
    """Else the only guard would be thought at work for ever, and nobody would ever come."""
    office = Office(rules=Rules(containment=True, escalate_after=math.inf))
    office.busy(ROBOT, OPERATOR)
    office.ok(office.fire(12))
    office.finds(GUARD, "confirmed", 30.0)  # and its `done` is lost
    office.tick(929.9)
    assert office.working[GUARD] == 1
    sends = office.tick(930.0)
    assert [(send.to, send.body.task) for send in sends] == [(GUARD, "contain")]


def test_without_a_limit_an_order_stands_for_ever_and_pauses_are_forgotten_all_the_same():
    office = Office(rules=Rules(order_limit=math.inf, escalate_after=math.inf))
    office.busy(GUARD)
    office.no(office.fire(12), 1.0)
    orders = office.tick(11.0)
    office.ok(orders, 11.0)
    office.tick(1e6)
    assert state(office) is State.ASSIGNED
    assert office.core.orders._pauses == []


def test_a_robot_cannot_give_back_what_its_operator_was_ordered(office):
    office.fire(12)
    for word in ("departed", "failed", "done"):
        assert office.progress(ROBOT, word, 1.0)[0].code == m.UNKNOWN_EVENT
    assert office.working == {OPERATOR: 1, ROBOT: 1}


def test_who_has_no_order_or_another_cannot_say_how_one_stands(office):
    office.fire(12)
    for who, event in ((GUARD, 1), (DETECTOR, 1), (OPERATOR, 2)):
        assert office.progress(who, "done", 1.0, event)[0].code == m.UNKNOWN_EVENT
    assert state(office) is State.ASSIGNED


# --- when the next tick is due -------------------------------------------------------------


def test_a_core_that_knows_nobody_has_no_deadline():
    assert Office().new_core().next_deadline() == math.inf


def test_the_next_deadline_is_that_of_silence_of_a_wait_or_of_an_order(office):
    core = office.core
    assert core.next_deadline() == pytest.approx(10.0)
    core.registry.silent_after = 1e9
    assert core.next_deadline() == pytest.approx(1e9)
    office.fire(12, now=5.0)
    assert core.next_deadline() == 905.0
    office.busy(GUARD)
    office.fire(90, now=7.0)
    assert core.next_deadline() == 67.0


def test_after_each_tick_the_next_deadline_lies_ahead(office):
    office.busy(GUARD)
    office.no(office.fire(12), 1.0)
    office.fire(90, now=2.0)
    ticks = 0
    while (due := office.core.next_deadline()) < math.inf:
        office.core.tick(due)
        assert office.core.next_deadline() > due
        ticks += 1
    assert ticks < 10
