"""Ports of the devices of a live run."""

from itertools import islice

import pytest

from dva_sim.live import supervisor
from dva_sim.simulation import scenario as scenarios


@pytest.mark.parametrize(("first", "ports"), [(7000, [7002, 7014, 7016]), (0, [0, 0, 0])])
def test_each_device_has_two_ports_in_a_row_from_the_first_or_free_ones(first, ports):
    """The DVA has the first two; the drill's world has 2 robots, 2 guards and 2 detectors."""
    drill = scenarios.build(scenarios.load("fire-drill"))
    assert (drill.robot.count, drill.guard.count, len(drill.events)) == (2, 2, 2)
    assert list(islice(supervisor._ports(first, drill), 3)) == ports
