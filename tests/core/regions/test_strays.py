"""Strays: events that are passed on to the DVA of their place."""

from helpers.dva.dispatch_office import DETECTOR, GUARD, east
from helpers.dva.two_offices import EAST, WEST, Street

from dva_sim.core.events import State
from dva_sim.core.regions.division import Claim
from dva_sim.protocol import messages as m


def parted_street():
    """A street that was parted while the west heard of a fire in the east."""
    street = Street()
    street.register(WEST, DETECTOR, "Sensor")
    street.guard(WEST, GUARD, 10)
    street.tick(2, GUARD, DETECTOR)
    street.parted = True
    street.tick(12, GUARD, DETECTOR)
    street.fire(WEST, DETECTOR, 70)
    street.tick(1, GUARD, DETECTOR)
    return street


def test_a_report_about_another_region_is_for_its_dva_while_that_one_is_heard():
    street = Street()
    street.register(WEST, DETECTOR, "Sensor")
    body = m.EventReport(None, "fire", east(70), 0.5, 0.9, "detected")
    message = m.Message(WEST, 9, DETECTOR, "12:00:00", 0, body)
    assert street.cores[WEST].passes_on(message) == EAST
    street.parted = True
    street.tick(12, DETECTOR)
    assert street.cores[WEST].passes_on(message) is None


def test_a_report_is_for_no_dva_that_has_forgotten_its_region_until_it_is_claimed_again():
    street = Street()
    street.register(WEST, DETECTOR, "Sensor")
    body = m.EventReport(None, "fire", east(70), 0.5, 0.9, "detected")
    message = m.Message(WEST, 9, DETECTOR, "12:00:00", 0, body)
    core = street.cores[WEST]
    core.division.forgotten.add("east")
    assert core.passes_on(message) is None
    core.division.learn("east", Claim(2, EAST))
    assert core.passes_on(message) == EAST


def test_a_report_about_the_own_region_is_not_passed_on_nor_is_what_was_passed_on():
    street = Street()
    street.register(WEST, DETECTOR, "Sensor")
    body = m.EventReport(None, "fire", east(20), 0.5, 0.9, "detected")
    assert street.cores[WEST].passes_on(m.Message(WEST, 9, DETECTOR, "12:00:00", 0, body)) is None
    from_peer = m.EventReport(None, "fire", east(70), 0.5, 0.9, "detected", DETECTOR)
    assert street.cores[WEST].passes_on(m.Message(WEST, 9, EAST, "12:00:00", 0, from_peer)) is None


def test_the_reporter_counts_as_the_source_of_what_was_passed_on():
    street = Street()
    for origin in (DETECTOR, GUARD, DETECTOR):
        report = m.EventReport(None, "fire", east(70), 0.5, 0.5, "detected", origin)
        assert street.say(EAST, WEST, report).code == m.OK
    assert street.cores[EAST].events.open[1_000_001].confidence == 0.75


def test_a_stray_is_closed_once_the_dva_of_its_place_has_it_and_its_responder_is_free():
    street = parted_street()
    assert street.cores[WEST].events.open[1].state is State.ASSIGNED
    street.parted = False
    street.register(WEST, EAST, "DVA")
    street.tick(3, GUARD, DETECTOR)
    assert street.cores[WEST].events.closed[1].state is State.EXPIRED
    assert [e.position for e in street.cores[EAST].events.open.values()] == [east(70)]
    assert street.told(GUARD, m.OrderProgress) == [m.OrderProgress(1, "done")]
    assert street.cores[WEST].counters["event looked at twice"] == 1


def test_a_stray_that_nobody_takes_stays():
    street = parted_street()
    street.tick(30, GUARD, DETECTOR)
    assert street.cores[WEST].events.open[1].state is State.ASSIGNED
