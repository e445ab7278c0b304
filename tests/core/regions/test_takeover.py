"""Deputies: what they keep, when they take over, and what becomes of the events."""

import pytest
from helpers.dva.dispatch_office import (
    DETECTOR,
    GUARD,
    OPERATOR,
    OTHER_GUARD,
    OTHER_OPERATOR,
    ROBOT,
    east,
)
from helpers.dva.two_offices import EAST, WEST, Street

from dva_sim.core.events import State
from dva_sim.core.regions.division import Claim
from dva_sim.protocol import messages as m


def copied(street, state, **more):
    """A status of event 7 in the west, as its DVA tells its deputy."""
    usual = {"age": 20.0, "state_for": 5.0, "decisions": 1, **more}
    status = m.EventStatus(7, "fire", east(10), 0.8, 0.9, state, **usual)
    return street.say(EAST, WEST, m.Replicate("west", 1, 1, status))


def dead_west(state="pending", **more):
    """A street whose western DVA has died after one event was copied, and whose guard comes."""
    street = Street()
    street.tick(2)
    assert copied(street, state, **more).code == m.OK
    street.dead.add(WEST)
    street.tick(12)
    street.guard(EAST, GUARD, 5)
    return street


def test_a_deputy_takes_a_region_over_when_a_device_has_come_and_its_dva_is_silent():
    street = dead_west()
    assert street.cores[EAST].division.claims["west"] == Claim(1, WEST)
    street.tick(1, GUARD)
    assert street.cores[EAST].division.claims["west"] == Claim(2, EAST)


def test_no_deputy_takes_over_while_no_device_of_the_region_has_come():
    street = Street()
    street.tick(2)
    street.dead.add(WEST)
    street.tick(12)
    street.guard(EAST, GUARD, 90)
    street.register(EAST, DETECTOR, "Sensor")
    street.tick(20, GUARD, DETECTOR)
    assert street.cores[EAST].division.claims["west"] == Claim(1, WEST)


def test_no_deputy_takes_over_while_it_hears_the_dva():
    street = Street()
    street.guard(EAST, GUARD, 5)
    street.tick(9, GUARD)
    assert street.cores[EAST].division.claims["west"] == Claim(1, WEST)


def test_an_event_that_waited_is_given_to_somebody_with_its_age_and_number():
    street = dead_west()
    street.tick(1, GUARD)
    assert street.told(GUARD, m.Order) == [m.Order(7, "fire", east(10), None)]
    event = street.cores[EAST].events.open[7]
    assert event.times["detected"] == pytest.approx(2.0 - 20.0)
    assert event.waiting_since == pytest.approx(2.0 - 5.0)
    assert event.severity == 0.8


def test_who_is_on_the_way_goes_on_and_gets_no_second_order():
    street = dead_west("assigned", responder=GUARD)
    street.tick(6, GUARD)
    event = street.cores[EAST].events.open[7]
    assert (event.state, event.responder) == (State.ASSIGNED, GUARD)
    assert street.told(GUARD, m.Order) == []
    assert street.say(EAST, GUARD, m.OrderProgress(7, "arrived")).code == m.OK
    finding = m.EventReport(7, "fire", east(10), 0.5, 0.9, "confirmed")
    assert street.say(EAST, GUARD, finding).code == m.OK
    assert street.cores[EAST].events.closed[7].state is State.CONFIRMED


def test_an_event_whose_responder_does_not_come_within_four_seconds_is_anothers():
    street = dead_west("on_scene", responder=OTHER_GUARD)
    street.tick(4, GUARD)
    assert street.told(GUARD, m.Order) == []
    street.tick(1, GUARD)
    assert street.told(GUARD, m.Order) == [m.Order(7, "fire", east(10), None)]


def test_an_event_that_is_over_is_not_taken_over():
    street = Street()
    street.tick(2)
    copied(street, "pending")
    copied(street, "refuted", closed_for=0.0)
    street.dead.add(WEST)
    street.tick(12)
    street.guard(EAST, GUARD, 5)
    street.tick(6, GUARD)
    assert not street.cores[EAST].events.open


def test_a_deputy_refuses_copies_of_an_older_epoch():
    street = dead_west()
    street.tick(1, GUARD)
    refused = copied(street, "assigned")
    assert (refused.code, refused.text) == (m.STALE, "epoch 1 of west is over: it is 2")


def test_a_dva_that_comes_back_serves_the_region_no_longer_and_passes_its_events_on():
    street = dead_west()
    street.tick(1, GUARD)
    street.dead.clear()
    street.cores[WEST].division.claims["west"] = Claim(1, WEST)
    street.register(WEST, DETECTOR, "Sensor")
    street.fire(WEST, DETECTOR, 30)
    street.tick(3, GUARD, DETECTOR)
    assert street.cores[WEST].division.claims["west"] == Claim(2, EAST)
    assert not street.cores[WEST].events.open
    assert [e.position for e in street.cores[EAST].events.open.values()] == [east(10), east(30)]


def test_a_robot_that_is_driven_under_a_session_of_the_dead_is_nobody_elses():
    street = dead_west()
    for device, kind in ((ROBOT, "Robot"), (OPERATOR, "TeleOp")):
        street.register(EAST, device, kind)
    driven = m.RobotStatus("Teleoperation", east(12), 0.0, 0.3, 0.0, 1)
    street.publish(EAST, ROBOT, driven)
    wish = m.PermissionRequest(ROBOT, "teleoperation")
    assert street.say(EAST, OPERATOR, wish).code == m.BUSY
    street.cores[EAST].dismiss(GUARD, street.now)
    street.tick(8, ROBOT, OPERATOR)
    assert street.told(OPERATOR, m.Order) == []
    street.publish(EAST, ROBOT, m.RobotStatus("Idle", east(12), 0.0, 0.0, 0.0, 2))
    street.tick(1, ROBOT, OPERATOR)
    assert street.told(OPERATOR, m.Order) == [m.Order(7, "fire", east(10), ROBOT)]


def test_a_dva_that_was_started_again_gets_its_events_back_with_their_ages():
    street = Street()
    street.tick(2)
    copied(street, "assigned", responder=GUARD)
    street.tick(3)
    street.cores[WEST] = street.new_core(WEST, life=1)
    street.register(WEST, EAST, "DVA")
    street.number = 0
    street.register(EAST, WEST, "DVA")
    (returned,) = street.told(WEST, m.Replicate)
    assert returned.event.age == 23.0
    street.tick(2)
    street.say(WEST, EAST, returned)  # the reply to the first was lost
    street.tick(3)
    event = street.cores[WEST].events.open[7]
    assert event.times["detected"] == pytest.approx(2.0 - 20.0)


@pytest.mark.parametrize(
    ("said", "state"),
    [
        (m.EventReport(7, "fire", east(10), 0.5, 0.9, "confirmed"), State.CONFIRMED),
        (m.EventReport(7, "fire", east(10), 0.5, 0.9, "refuted"), State.REFUTED),
        (m.OrderProgress(7, "done"), State.ASSIGNED),
        (m.OrderProgress(7, "failed"), State.ASSIGNED),
    ],
)
def test_what_a_responder_says_before_the_takeover_is_busy_and_counts_after_it(said, state):
    street = dead_west("on_scene", responder=GUARD)
    assert street.say(EAST, GUARD, said).code == m.BUSY
    street.tick(5, GUARD)
    assert street.cores[EAST].events.get(7).state is State.ON_SCENE
    assert street.say(EAST, GUARD, said).code == m.OK
    street.tick(1, GUARD)
    assert street.cores[EAST].events.get(7).state is state
    is_sent_again = state is State.ASSIGNED
    assert street.told(GUARD, m.Order) == [m.Order(7, "fire", east(10), None)] * is_sent_again


@pytest.mark.parametrize(
    ("device", "said"),
    [
        (GUARD, m.OrderProgress(7, "arrived")),
        (OTHER_GUARD, m.OrderProgress(7, "done")),
    ],
)
def test_an_event_is_its_responders_while_that_one_does_not_say_that_it_has_ended(device, said):
    street = dead_west("on_scene", responder=GUARD)
    street.guard(EAST, OTHER_GUARD, 80)
    street.say(EAST, device, said)
    street.tick(2, GUARD, OTHER_GUARD)
    event = street.cores[EAST].events.open[7]
    assert (event.state, event.responder) == (State.ON_SCENE, GUARD)


def test_no_two_lives_of_a_dva_give_an_event_the_same_number():
    street = Street()
    street.cores[EAST] = street.new_core(EAST, life=2)
    street.guard(EAST, GUARD, 90)
    street.fire(EAST, GUARD, 80)
    assert list(street.cores[EAST].events.open) == [1_020_001]


def test_a_look_that_was_asked_for_by_the_dead_goes_on_as_the_deputys_own():
    street = Street()
    street.register(WEST, DETECTOR, "Sensor")
    street.guard(EAST, GUARD, 90)
    street.fire(WEST, DETECTOR, 10)
    street.tick(6, GUARD, DETECTOR)
    status = street.cores[WEST].replica_of(street.cores[WEST].events.open[1], 1, street.now)
    street.say(EAST, WEST, status[1])
    street.dead.add(WEST)
    street.tick(12, GUARD)
    street.guard(EAST, OTHER_GUARD, 5)
    street.tick(6, GUARD, OTHER_GUARD)
    assert list(street.cores[EAST].events.open) == [1_000_001]
    assert not street.cores[EAST].help.copies


def test_a_region_whose_deputy_has_taken_over_and_forgotten_it_is_served_again():
    street = dead_west()
    street.tick(1, GUARD)
    street.dead.clear()
    street.tick(3, GUARD)
    assert street.cores[WEST].division.claims["west"] == Claim(2, EAST)
    street.register(WEST, EAST, "DVA")
    street.cores[EAST] = street.new_core(EAST, life=1)
    street.register(EAST, WEST, "DVA")
    street.number = 1
    street.register(WEST, EAST, "DVA")
    street.tick(3)
    assert street.cores[WEST].division.claims["west"] == Claim(3, WEST)
    assert street.cores[EAST].division.claims["west"] == Claim(3, WEST)


# --- permissions of the dead -----------------------------------------------------------------

SESSION = 1001 << 32


def brought(street, holder=OPERATOR, level="teleoperation", session=SESSION):
    """The reply to a robot that has come to the east, and says who holds it."""
    street.register(EAST, ROBOT, "Robot")
    return street.say(EAST, ROBOT, m.GetGrant(holder, level), session)


def test_a_permission_of_the_dead_holds_at_the_dva_that_the_robot_comes_to():
    street = dead_west()
    for operator in (OPERATOR, OTHER_OPERATOR):
        street.register(EAST, operator, "TeleOp")
    reply = brought(street)
    assert reply.content == m.Permission(OPERATOR, "teleoperation", SESSION)
    street.tick(20, ROBOT, OPERATOR, OTHER_OPERATOR)
    wish = m.PermissionRequest(ROBOT, "teleoperation")
    assert street.say(EAST, OTHER_OPERATOR, wish).text.startswith(f"held by {OPERATOR}")
    over = m.PermissionRevocation(ROBOT, OPERATOR, SESSION)
    assert street.say(EAST, OPERATOR, over).code == m.OK
    granted = street.say(EAST, OTHER_OPERATOR, wish)
    assert granted.code == m.OK
    assert granted.content.session > SESSION


def test_a_permission_of_the_dead_ends_ten_seconds_later_if_its_holder_does_not_come():
    street = dead_west()
    brought(street)
    street.tick(10, ROBOT)
    assert street.told(ROBOT, m.PermissionRevocation) == []
    street.tick(1, ROBOT)
    over = m.PermissionRevocation(ROBOT, OPERATOR, SESSION)
    assert street.told(ROBOT, m.PermissionRevocation) == [over]


def test_a_permission_of_the_dead_ends_with_a_silence_of_its_holder():
    street = dead_west()
    street.register(EAST, OPERATOR, "TeleOp")
    brought(street)
    street.tick(5, ROBOT, OPERATOR)
    street.tick(11, ROBOT)
    assert street.told(ROBOT, m.PermissionRevocation)


@pytest.mark.parametrize(
    "claim",
    [
        {"session": 0},
        {"session": 2**63},
        {"level": "sensors"},
        {"holder": None, "level": None},
    ],
)
def test_what_is_no_permission_to_drive_is_not_taken_over(claim):
    street = dead_west()
    assert brought(street, **claim).code == m.NOT_PERMITTED
    assert not street.cores[EAST].sessions.permissions.all()


def test_a_robot_brings_nothing_where_somebody_has_it_already():
    street = dead_west()
    for operator in (OPERATOR, OTHER_OPERATOR):
        street.register(EAST, operator, "TeleOp")
    street.register(EAST, ROBOT, "Robot")
    wish = m.PermissionRequest(ROBOT, "teleoperation")
    assert street.say(EAST, OTHER_OPERATOR, wish).code == m.OK
    assert brought(street).code == m.NOT_PERMITTED
