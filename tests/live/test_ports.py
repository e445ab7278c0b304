"""Which ports the devices of a live run listen on, if the first is given."""

from itertools import islice

from dva_sim.live.supervisor import _ports
from dva_sim.simulation import scenario as scenarios


def test_each_device_has_two_ports_in_a_row_and_no_two_share_one():
    """The DVA has 7000; the drill's world has 2 robots, 2 guards and 2 detectors."""
    drill = scenarios.build(scenarios.load("fire-drill"))
    assert (drill.robot.count, drill.guard.count, len(drill.events)) == (2, 2, 2)
    assert list(islice(_ports(7000, drill), 3)) == [7002, 7014, 7016]


def test_without_a_first_port_all_are_free_ones():
    drill = scenarios.build(scenarios.load("fire-drill"))
    assert list(islice(_ports(0, drill), 3)) == [0, 0, 0]
