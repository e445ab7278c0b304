"""Borders: who has crossed one is handed over while it is free."""

import pytest
from helpers.dva.dispatch_office import DETECTOR, GUARD, ROBOT, east
from helpers.dva.two_offices import ADDRESS, EAST, WEST, Street

from dva_sim.protocol import messages as m

HANDED = [m.HandOver(EAST, ADDRESS)]


def walked(*places):
    """A street whose western guard was for eleven seconds at each of these places [m]."""
    street = Street()
    street.guard(WEST, GUARD, 10)
    for place in places:
        street.guard(WEST, GUARD, place)
        street.tick(11, GUARD)
    return street


def test_a_guard_who_has_crossed_the_border_is_handed_over():
    street = walked(60)
    assert street.told(GUARD, m.HandOver) == HANDED
    assert GUARD not in street.cores[WEST].registry.entries


@pytest.mark.parametrize("places", [[20, 40], [51.5], [40, 51.9, 49]])
def test_nobody_is_handed_over_within_two_metres_of_the_border(places):
    assert walked(*places).told(GUARD, m.HandOver) == []


def test_nobody_is_handed_over_who_is_back_within_ten_seconds():
    street = Street()
    street.guard(WEST, GUARD, 10)
    for place in (60, 40, 60, 40):
        street.guard(WEST, GUARD, place)
        street.tick(9, GUARD)
    assert street.told(GUARD, m.HandOver) == []


def test_whoever_has_an_order_keeps_its_dva():
    street = Street()
    street.register(WEST, DETECTOR, "Sensor")
    street.guard(WEST, GUARD, 10)
    street.fire(WEST, DETECTOR, 45)
    street.guard(WEST, GUARD, 60)
    street.tick(20, GUARD, DETECTOR)
    assert street.told(GUARD, m.HandOver) == []


@pytest.mark.parametrize("mode", ["Teleoperation", "Mission"])
def test_no_border_ends_a_drive_or_a_mission(mode):
    street = Street()
    street.register(WEST, ROBOT, "Robot")
    street.publish(WEST, ROBOT, m.RobotStatus(mode, east(60), 0.0, 0.0, 0.0, 1))
    street.tick(20, ROBOT)
    assert street.told(ROBOT, m.HandOver) == []
    street.publish(WEST, ROBOT, m.RobotStatus("Idle", east(60), 0.0, 0.0, 0.0, 1))
    street.tick(11, ROBOT)
    assert street.told(ROBOT, m.HandOver) == HANDED


def test_a_robot_that_somebody_holds_keeps_its_dva():
    street = Street()
    street.register(WEST, ROBOT, "Robot")
    street.register(WEST, "02:00:00:03:00:01", "TeleOp")
    wish = m.PermissionRequest(ROBOT, "teleoperation")
    assert street.say(WEST, "02:00:00:03:00:01", wish).code == m.OK
    street.publish(WEST, ROBOT, m.RobotStatus("Idle", east(60), 0.0, 0.0, 0.0, 1))
    street.tick(20, ROBOT, "02:00:00:03:00:01")
    assert street.told(ROBOT, m.HandOver) == []


def test_nobody_is_handed_over_to_a_dva_that_is_silent():
    street = Street()
    street.guard(WEST, GUARD, 60)
    street.parted = True
    street.tick(30, GUARD)
    assert [h for h in street.told(GUARD, m.HandOver) if street.now > 10][1:] == []


def test_a_guard_who_was_lent_is_sent_back_and_not_handed_over():
    street = Street()
    street.register(WEST, DETECTOR, "Sensor")
    street.guard(EAST, GUARD, 90)
    street.tick(1, GUARD, DETECTOR)
    street.fire(WEST, DETECTOR, 10)
    street.tick(6, GUARD, DETECTOR)
    street.guard(EAST, GUARD, 10)
    street.say(EAST, GUARD, m.OrderProgress(1_000_001, "arrived"))
    street.say(EAST, GUARD, m.EventReport(1_000_001, "fire", east(10), 0.5, 0.9, "refuted"))
    street.say(EAST, GUARD, m.OrderProgress(1_000_001, "done"))
    street.tick(20, GUARD, DETECTOR)
    assert street.told(GUARD, m.HandOver) == []
    assert street.told(GUARD, m.Relocation) == [m.Relocation(east(90))]
