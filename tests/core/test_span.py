"""Limit on the robots of one operator, which holds for any policy."""

import pytest
from helpers.dva.dispatch_office import (
    GUARD,
    OPERATOR,
    OTHER_OPERATOR,
    OTHER_ROBOT,
    ROBOT,
    ROOM,
    Office,
)

from dva_sim.core.assignments import Rules
from dva_sim.core.events import State
from dva_sim.protocol import messages as m
from dva_sim.protocol.devices import ControlRoomRole

THIRD_ROBOT = "02:00:00:01:00:03"


def office_of(span: int, operators: int = 1) -> Office:
    """Three robots at 10 m, 11 m and 12 m, and no guard who could go."""
    office = Office(rules=Rules(escalate_after=1000.0, merge_distance=0.0, operator_span=span))
    office.register(OTHER_ROBOT, "Robot", 11)
    office.register(THIRD_ROBOT, "Robot", 12)
    if operators == 2:
        office.register(OTHER_OPERATOR, "TeleOp")
    office.busy(GUARD)
    return office


def three_fires(office: Office) -> list[str | None]:
    """Responders sent to look at each of three fires at 10 m."""
    return [next((send.to for send in office.fire(10)), None) for _ in range(3)]


@pytest.mark.parametrize(("span", "sent"), [(1, 1), (2, 2), (3, 3), (9, 3)])
def test_one_operator_is_given_as_many_robots_as_the_span(span, sent):
    office = office_of(span)
    assert three_fires(office) == [OPERATOR] * sent + [None] * (3 - sent)
    assert office.core.orders.engaged.count(OPERATOR) == sent


def test_of_two_operators_the_one_with_less_in_hand_is_given_the_next_robot():
    assert three_fires(office_of(span=2, operators=2)) == [OPERATOR, OTHER_OPERATOR, OPERATOR]


def test_an_operator_says_of_each_of_its_orders_how_it_stands():
    office = office_of(span=2)
    three_fires(office)
    assert office.progress(OPERATOR, "arrived", 5.0, event=2)[0].code == m.OK
    assert [office.event(n).state for n in (1, 2, 3)] == [
        State.ASSIGNED,
        State.ON_SCENE,
        State.PENDING,
    ]
    assert office.progress(OPERATOR, "arrived", 5.0, event=3)[0].code == m.UNKNOWN_EVENT


def test_a_hand_that_is_free_again_is_given_what_waits():
    office = office_of(span=2)
    three_fires(office)
    office.finds(OPERATOR, "confirmed", 9.0, event=1)
    _, sends = office.progress(OPERATOR, "done", 9.0, event=1)
    assert [(send.to, getattr(send.body, "event_id", None)) for send in sends] == [(OPERATOR, 3)]
    assert office.working[OPERATOR] == 3
    assert office.core.orders.engaged.count(OPERATOR) == 2


def test_an_operator_gets_the_robots_of_all_its_orders_and_no_other():
    office = office_of(span=2)
    three_fires(office)
    codes = [
        office.say(OPERATOR, m.PermissionRequest(robot, "missions"))[0].code
        for robot in (ROBOT, OTHER_ROBOT)
    ]
    assert codes == [m.OK, m.OK]
    office.register(OTHER_OPERATOR, "TeleOp")
    asked = m.PermissionRequest(OTHER_ROBOT, "missions")
    assert office.say(OTHER_OPERATOR, asked)[0].code == m.BUSY


def test_a_control_room_sends_as_many_robots_by_itself_as_it_likes():
    office = office_of(span=1)
    office.core.roles.appoint(ROOM, ControlRoomRole.DISPATCH)
    office.register(ROOM, "ControlRoom")
    office.busy(OPERATOR)
    three_fires(office)
    for event, robot in ((1, ROBOT), (2, OTHER_ROBOT)):
        reply, sends = office.say(ROOM, m.Assign(event, robot, ROOM))
        assert reply.code == m.OK
        assert [send.to for send in sends] == [ROOM]
    assert office.core.orders.engaged.count(ROOM) == 2


def test_all_that_a_lost_operator_had_in_hand_is_open_to_others():
    office = office_of(span=3)
    three_fires(office)
    office.silence(OPERATOR, 20.0)
    assert [office.event(n).state for n in (1, 2, 3)] == [State.PENDING] * 3
    assert office.working == {GUARD: 99}


def test_each_order_of_an_operator_has_its_own_time_limit():
    office = office_of(span=2)
    office.core.orders.rules = Rules(escalate_after=1000.0, order_limit=100.0, operator_span=2)
    office.fire(10, now=0.0)
    office.fire(30, now=50.0)
    office.beat(now=101.0)
    office.core.orders.take_back(101.0)
    assert [office.event(n).state for n in (1, 2)] == [State.PENDING, State.ASSIGNED]
