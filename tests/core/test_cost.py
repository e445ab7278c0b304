"""A message costs as much among many devices as among few: counted in calls, not in time."""

from __future__ import annotations

import sys
from collections.abc import Callable
from types import FrameType
from typing import Any

import pytest
from helpers.dva.dispatch_desk import ADDRESS, DETECTOR, GUARD, OPERATOR, ROBOT, Office

from dva_sim.protocol import messages as m

FEW, MANY = 100, 2_000


def calls(work: Callable[[], Any]) -> int:
    """How many functions are called, Python's own included."""
    count = 0

    def note(frame: FrameType, what: str, _: Any) -> None:
        nonlocal count
        count += what in ("call", "c_call")

    sys.setprofile(note)
    try:
        work()
    finally:
        sys.setprofile(None)
    return count


def crowded(devices: int) -> Office:
    """The office with so many detectors and operators besides its team."""
    office = Office()
    for number in range(devices):
        kind = "Sensor" if number % 2 else "TeleOp"
        device = "02:00:00:05:{:02X}:{:02X}".format(*divmod(number, 256))
        office.say(device, m.Registration("one of many", kind, ADDRESS))
    office.say(OPERATOR, m.GetDeviceList())
    return office


WORK: dict[str, Callable[[Office], Any]] = {
    "a heartbeat": lambda office: office.beat(DETECTOR, now=1.0),
    "a status": lambda office: office.status(ROBOT, 10, now=1.0),
    "a renewal": lambda office: office.say(GUARD, m.Registration("guard", "Guard", ADDRESS)),
    "a device list": lambda office: office.say(OPERATOR, m.GetDeviceList()),
    "an order's progress": lambda office: office.progress(OPERATOR, "departed", 1.0),
    "a finding": lambda office: office.finds(OPERATOR, "confirmed", 1.0),
    "a tick": lambda office: office.desk.tick(1.0),
    "a look at deadlines": lambda office: office.desk.next_deadline(),
}


@pytest.mark.parametrize("what", WORK)
def test_among_2000_devices_a_message_takes_as_many_calls_as_among_100(what: str) -> None:
    counted = []
    for devices in (FEW, MANY):
        office = crowded(devices)
        office.fire(12)
        counted.append(calls(lambda office=office: WORK[what](office)))  # type: ignore[misc]
    assert counted[0] == counted[1]
