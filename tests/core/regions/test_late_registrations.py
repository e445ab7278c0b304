"""Registrations between DVAs that were repeated for a minute, and those of a DVA that restarted."""

import pytest
from helpers.dva.dispatch_office import DETECTOR, GUARD
from helpers.dva.two_offices import ADDRESS, EAST, WEST, Street

from dva_sim.core.registry import DeviceEntry
from dva_sim.protocol import messages as m

AGAIN = m.Registration("dva-east", "DVA", ADDRESS)


def registered(street, message_id, timestamp):
    street.cores[WEST].handle(m.Message(WEST, message_id, EAST, timestamp, 0, AGAIN), street.now)


@pytest.fixture
def helped():
    """A street whose eastern DVA looks at an event of the western one."""
    street = Street()
    registered(street, 40, "12:00:01")
    street.register(WEST, DETECTOR, "Sensor")
    street.guard(EAST, GUARD, 90)
    street.fire(WEST, DETECTOR, 10)
    street.tick(6, GUARD, DETECTOR)
    assert street.cores[WEST].events.open[1].responder == EAST
    registered(street, 90, "12:01:10")
    return street


def test_a_registration_that_comes_a_minute_late_ends_no_help(helped):
    registered(helped, 60, "12:00:20")
    assert helped.cores[WEST].events.open[1].responder == EAST


def test_a_dva_that_has_restarted_has_forgotten_whom_it_helps(helped):
    registered(helped, 1, "12:01:20")
    assert helped.cores[WEST].events.open[1].responder is None


@pytest.mark.parametrize(
    ("sent", "is_new"),
    [("23:59:50", False), ("00:00:09.5", False), ("00:00:10", True), ("00:00:30", True)],
)
def test_midnight_makes_no_registration_late_or_new(sent, is_new):
    entry = DeviceEntry(m.Device(EAST, "dva-east", "DVA", ADDRESS), 0.0)
    entry.registrations.append((90, "00:00:10"))
    assert entry.is_new_life(60, sent) is is_new
