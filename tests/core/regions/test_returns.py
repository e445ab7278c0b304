"""Regions that a supervisor gives back to their own DVA, and when not."""

import pytest
from helpers.dva.dispatch_office import DETECTOR, GUARD, OPERATOR, ROBOT, ROOM, east
from helpers.dva.two_offices import EAST, WEST, Street

from dva_sim.core.regions.division import Claim
from dva_sim.core.regions.takeover import Deputy
from dva_sim.protocol import messages as m

ASKED = m.GiveBack("west")


def back(epoch=2):
    """A street whose western DVA is there again, and whose region the eastern one serves."""
    street = Street()
    street.tick(2)
    street.dead.add(WEST)
    street.tick(12)
    for device, kind in ((OPERATOR, "TeleOp"), (ROOM, "ControlRoom")):
        street.register(EAST, device, kind)
    street.guard(EAST, GUARD, 5)
    street.tick(1, GUARD, OPERATOR, ROOM)
    street.dead.clear()
    street.tick(3, GUARD, OPERATOR, ROOM)
    street.cores[EAST].roles.appoint(ROOM, "supervise")
    assert street.cores[WEST].division.claims["west"] == Claim(epoch, EAST)
    return street


def claims(street, region="west"):
    return [core.division.claims[region] for core in street.cores.values()]


def test_a_region_goes_back_to_its_own_dva_when_a_supervisor_says_so():
    street = back()
    assert street.say(EAST, ROOM, ASKED).code == m.OK
    assert claims(street) == [Claim(3, WEST)] * 2
    assert [core.counters["region taken back"] for core in street.cores.values()] == [1, 0]
    street.tick(30, GUARD, OPERATOR, ROOM)
    assert claims(street) == [Claim(3, WEST)] * 2


def test_who_came_to_the_deputy_goes_back_and_a_guard_by_his_place():
    street = back()
    street.say(EAST, ROOM, ASKED)
    street.tick(11, GUARD, OPERATOR, ROOM)
    over = [m.HandOver(WEST, street.cores[EAST].registry.entries[WEST].device.address)]
    assert {device: street.told(device, m.HandOver) for device in (OPERATOR, ROOM, GUARD)} == {
        OPERATOR: over,
        ROOM: over,
        GUARD: over,
    }
    assert not street.cores[EAST].borders.returning


def test_an_event_that_waits_is_passed_on_and_booked_once():
    street = back()
    street.register(EAST, DETECTOR, "Sensor")
    street.cores[EAST].dismiss(GUARD, street.now)
    street.fire(EAST, DETECTOR, 10)
    assert street.cores[WEST].deputy.copies == {}
    status = street.cores[EAST].replica_of(street.cores[EAST].events.open[1_000_001], 1, street.now)
    assert street.say(WEST, EAST, status[1]).code == m.OK
    street.say(EAST, ROOM, ASKED)
    street.tick(5, OPERATOR, ROOM, DETECTOR)
    assert list(street.cores[WEST].events.open) == [1]
    assert not street.cores[EAST].events.open


def test_no_copy_of_a_region_that_was_given_back_is_gone_on_with():
    street = back()
    street.say(EAST, ROOM, ASKED)
    street.register(WEST, DETECTOR, "Sensor")
    street.fire(WEST, DETECTOR, 10)
    (event,) = street.cores[WEST].events.open.values()
    status = street.cores[WEST].replica_of(event, 1, street.now)
    assert street.say(EAST, WEST, status[1]).code == m.OK
    street.tick(4, ROOM, DETECTOR)
    assert street.cores[EAST].counters["event taken over"] == 0


def test_a_deputy_that_forgets_no_take_over_goes_on_with_copies(monkeypatch):
    monkeypatch.setattr(Deputy, "yielded", lambda *_: [])
    with pytest.raises(AssertionError):
        test_no_copy_of_a_region_that_was_given_back_is_gone_on_with()


def test_a_region_in_which_somebody_acts_is_not_given_back():
    street = back()
    street.register(EAST, DETECTOR, "Sensor")
    street.fire(EAST, DETECTOR, 10)
    reply = street.say(EAST, ROOM, ASKED)
    assert (reply.code, reply.text) == (m.BUSY, "event 1000001 is assigned")
    assert claims(street) == [Claim(2, EAST)] * 2


def test_a_region_in_which_a_robot_is_driven_is_not_given_back():
    street = back()
    street.register(EAST, ROBOT, "Robot")
    street.publish(EAST, ROBOT, m.RobotStatus("Idle", east(12), 0.0, 0.0, 0.0, 1))
    wish = m.PermissionRequest(ROBOT, "teleoperation")
    assert street.say(EAST, OPERATOR, wish).code == m.OK
    reply = street.say(EAST, ROOM, ASKED)
    assert (reply.code, ROBOT in reply.text) == (m.BUSY, True)


def test_a_region_whose_dva_is_away_is_not_given_back():
    street = back()
    street.dead.add(WEST)
    street.tick(12, GUARD, OPERATOR, ROOM)
    reply = street.say(EAST, ROOM, ASKED)
    assert (reply.code, WEST in reply.text) == (m.BUSY, True)


@pytest.mark.parametrize(
    ("to", "source", "region", "code"),
    [
        (EAST, OPERATOR, "west", m.NOT_PERMITTED),
        (WEST, ROOM, "west", m.NOT_PERMITTED),
        (EAST, ROOM, "north", m.NOT_SUPPORTED),
        (EAST, ROOM, "east", m.OK),
    ],
)
def test_only_a_supervisor_at_the_serving_dva_gives_a_region_back(to, source, region, code):
    street = back()
    street.cores[WEST].roles.appoint(ROOM, "supervise")
    street.register(WEST, ROOM, "ControlRoom")
    assert street.say(to, source, m.GiveBack(region)).code == code
    assert claims(street) == [Claim(2, EAST)] * 2
    assert claims(street, "east") == [Claim(1, EAST)] * 2


@pytest.mark.parametrize(
    ("body", "code"),
    [
        (m.GiveBack("west", 2), m.STALE),
        (m.GiveBack("west", 1), m.STALE),
        (m.GiveBack("west"), m.NOT_SUPPORTED),
        (m.GiveBack("east", 2), m.NOT_SUPPORTED),
        (m.GiveBack("west", 3), m.OK),
        (m.GiveBack("west", 5), m.OK),  # who was just started has not heard of the others' claims
    ],
)
def test_a_dva_takes_its_region_only_in_a_higher_epoch_than_it_knows(body, code):
    street = back()
    assert street.say(WEST, EAST, body).code == code


def test_an_answer_that_is_lost_is_made_up_for_by_the_next_status():
    street = back()
    street.say(WEST, EAST, m.GiveBack("west", 3))
    street.tick(12, GUARD, OPERATOR, ROOM)
    assert claims(street) == [Claim(3, WEST)] * 2
    assert street.told(OPERATOR, m.HandOver)


def test_a_dva_that_was_given_its_region_back_and_is_started_again_hears_its_epoch_first():
    street = back()
    street.say(EAST, ROOM, ASKED)
    status = m.EventStatus(7, "fire", east(10), 0.8, 0.9, "pending", 20.0, 5.0, 1)
    assert street.say(EAST, WEST, m.Replicate("west", 3, 1, status)).code == m.OK
    street.cores[WEST] = street.new_core(WEST, life=1)
    street.register(WEST, EAST, "DVA")
    street.number = 0
    street.register(EAST, WEST, "DVA")
    assert street.cores[WEST].division.claims["west"] == Claim(3, WEST)
    assert [copy.epoch for copy in street.told(WEST, m.Replicate)] == [3]
    street.tick(5)
    assert list(street.cores[WEST].events.open) == [7]
    assert claims(street) == [Claim(3, WEST)] * 2


def test_a_dva_that_says_an_epoch_that_is_over_is_told_the_present_one():
    street = back()
    street.say(EAST, ROOM, ASKED)
    street.cores[WEST].division.claims["west"] = Claim(1, WEST)
    street.tick(3, GUARD, OPERATOR, ROOM)
    assert claims(street) == [Claim(3, WEST)] * 2
    assert street.cores[WEST].counters["region taken back"] == 1
