"""Responders who accept an order must make progress, or are replaced."""

from dataclasses import replace

import pytest
from helpers.dva.dispatch_office import (
    GUARD,
    OPERATOR,
    OTHER_GUARD,
    OTHER_ROBOT,
    ROBOT,
    Office,
    east,
)
from helpers.wording import counted

from dva_sim.core.assignments import Rules
from dva_sim.core.events import State
from dva_sim.protocol import messages as m

RULES = Rules(escalate_after=1000.0, depart_within=100.0, still_within=30.0, containment=True)


@pytest.fixture
def office() -> Office:
    """Two guards at 0 and 90 m, and a robot; events are at 12 m."""
    office = Office(rules=RULES)
    office.register(OTHER_GUARD, "Guard", at=90)
    return office


def sent_to(sends: list) -> list[str]:  # type: ignore[type-arg]
    return [send.to for send in sends if isinstance(send.body, m.Order)]


def send_a_guard(office: Office) -> None:
    office.busy(ROBOT, OPERATOR)
    assert sent_to(office.ok(office.fire(12)) or office.sent) == [GUARD]


@pytest.mark.invariant("S6")
def test_who_says_ok_and_does_nothing_but_live_loses_the_order_after_the_stated_time(office):
    send_a_guard(office)
    for now in range(1, 101):
        assert office.tick(float(now)) == []  # with all heartbeats
    reported = office.tick(101.0)
    assert [(s.to, type(s.body).__name__) for s in reported] == [
        (GUARD, "OrderProgress"),
        (OTHER_GUARD, "Order"),
    ]
    assert office.core.counters["did not set out"] == 1
    assert office.event().state is State.ASSIGNED


def test_who_set_out_and_stands_still_loses_it_too(office):
    send_a_guard(office)
    office.tick(1.0)
    office.progress(GUARD, "departed", 5.0)
    for now, metres in ((6.0, 0.0), (20.0, 1.0), (40.0, 2.0), (60.0, 2.2), (69.0, 2.4)):
        office.report_place(GUARD, metres, now)
        assert sent_to(office.tick(now)) == []
    assert sent_to(office.tick(70.0)) == [OTHER_GUARD]
    assert office.core.counters["did not move"] == 1


def test_who_keeps_on_moving_keeps_the_order_and_nothing_more_is_owed_on_scene(office):
    send_a_guard(office)
    office.progress(GUARD, "departed", 1.0)
    for now in range(2, 200):
        office.report_place(GUARD, 0.05 * now, float(now))
        assert sent_to(office.tick(float(now))) == []
    office.progress(GUARD, "arrived", 200.0)
    for now in range(201, 800, 20):
        assert office.tick(float(now)) == []


def test_a_robot_gets_on_if_it_moves_whatever_its_operator_does(office):
    office.busy(GUARD, OTHER_GUARD)
    office.ok(office.fire(12))
    office.progress(OPERATOR, "departed", 1.0)
    for now in range(2, 100):
        office.status(ROBOT, 10 + 0.05 * now, float(now))
        assert office.tick(float(now)) == []
    stopped = [t for t in range(100, 129) if OPERATOR in [s.to for s in office.tick(float(t))]]
    assert stopped[0] == pytest.approx(121, abs=2)
    assert office.core.counters["did not move"] == 1


def test_of_several_orders_only_the_first_is_owed_and_the_next_from_when_it_is_first():
    office = Office(rules=Rules(operator_span=2, depart_within=100.0, merge_distance=0.0))
    office.register(OTHER_ROBOT, "Robot", at=30)
    office.busy(GUARD)
    office.ok(office.fire(12))
    office.ok(office.fire(32))
    office.tick(1.0)
    office.progress(OPERATOR, "departed", 50.0, event=1)
    for now in range(51, 400):
        assert office.tick(float(now)) == []
    office.finds(OPERATOR, "confirmed", 400.0, event=1)
    office.progress(OPERATOR, "done", 400.0, event=1)
    office.tick(401.0)
    assert office.tick(500.0) == []
    office.tick(501.0)
    assert office.core.counters["did not set out"] == 1


def test_who_stands_by_may_stand_but_has_to_go_once_it_is_confirmed(office):
    office.ok(office.fire(12))
    office.ok([office.core.orders.act(office.event(), GUARD, 0.0)])
    office.tick(1.0)
    for who, state in ((OPERATOR, "departed"), (OPERATOR, "arrived"), (GUARD, "departed")):
        office.progress(who, state, 1.0)
    for now in range(2, 200, 10):
        office.tick(float(now))
    assert office.event().actor == GUARD
    office.ok(office.finds(OPERATOR, "confirmed", 200.0)[1])
    for now in (201.0, 230.0, 231.0):
        office.tick(now)
    assert office.event().actor == OTHER_GUARD
    assert office.core.counters["did not move"] == 1


def test_nothing_is_owed_of_an_order_that_was_not_answered_yet(office):
    office.busy(ROBOT, OPERATOR)
    office.fire(12)
    for now in range(1, 400, 10):
        office.tick(float(now))
    assert office.event().responder == GUARD


def test_a_robot_may_stand_while_its_operator_has_another_in_hand():
    rules = Rules(operator_span=2, still_within=30.0, merge_distance=0.0)
    office = Office(rules=rules)
    office.register(OTHER_ROBOT, "Robot", at=30)
    office.busy(GUARD)
    office.ok(office.fire(12))
    office.ok(office.fire(32))
    for event in (1, 2):
        office.progress(OPERATOR, "departed", 1.0, event=event)
    for now in range(2, 300, 10):
        assert office.tick(float(now)) == []


def test_who_says_from_afar_that_it_has_arrived_loses_the_order_as_if_it_stood_still():
    office = Office(rules=replace(RULES, arrived_within=10.0))  # the guard stands at 0 m
    office.register(OTHER_GUARD, "Guard", at=90)
    send_a_guard(office)
    for state in ("departed", "arrived"):
        office.progress(GUARD, state, 1.0)
    for now in range(2, 33):
        assert office.event().state is State.ASSIGNED
        office.report_place(GUARD, 0.0, float(now))
        given = office.tick(float(now))
    assert sent_to(given) == [OTHER_GUARD]
    assert counted(office.core.counters, "from afar") == 1


def test_who_is_nearly_there_when_it_says_so_has_arrived_with_its_next_position():
    office = Office(rules=replace(RULES, arrived_within=10.0))
    office.register(OTHER_GUARD, "Guard", at=90)
    send_a_guard(office)
    office.progress(GUARD, "arrived", 10.0)
    assert office.event().state is State.ASSIGNED
    office.report_place(GUARD, 2.5, 12.0)
    assert (office.event().state, office.event().times["arrived"]) == (State.ON_SCENE, 12.0)
    office.report_place(GUARD, 4.0, 12.5)  # from then on it is where it says
    assert office.core.registry.entries[GUARD].position == east(4.0)
    for now in range(13, 200):
        assert office.tick(float(now)) == []


def test_who_deals_with_it_has_to_be_there_too():
    office = Office(rules=replace(RULES, arrived_within=10.0))
    office.register(OTHER_GUARD, "Guard", at=90)
    office.ok(office.fire(12))
    office.ok([office.core.orders.act(office.event(), GUARD, 0.0)])
    office.progress(OPERATOR, "arrived", 1.0)  # its robot stands at 10 m
    office.ok(office.finds(OPERATOR, "confirmed", 2.0)[1])
    office.progress(GUARD, "arrived", 2.0)
    for now in range(3, 34):
        office.tick(float(now))
    assert office.event().actor == OTHER_GUARD


@pytest.mark.parametrize(("robot_at", "arrived"), [(10, 2.0), (90, None)])
def test_a_finding_of_an_order_that_the_dva_has_forgotten_is_no_arrival_of_another(
    robot_at, arrived
):
    """Back from a crash, it has given the operator another robot, which stands far away."""
    office = Office(rules=replace(RULES, arrived_within=10.0))
    office.busy(GUARD)
    office.status(ROBOT, robot_at)
    office.ok(office.fire(12))
    office.finds(OPERATOR, "confirmed", 2.0)
    assert (office.event().state, office.event().times.get("arrived")) == (
        State.CONFIRMED,
        arrived,
    )
    at = office.core.registry.entries[ROBOT].position
    assert at == office.event().position if arrived else at != office.event().position
