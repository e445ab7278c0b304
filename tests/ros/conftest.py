"""A machine with ROS that a robot is joined to."""

from collections.abc import Iterator

import pytest
from helpers.ros.ros_machine import RosMachine


@pytest.fixture
def machine() -> Iterator[RosMachine]:
    machine = RosMachine()
    yield machine
    machine.stop()
