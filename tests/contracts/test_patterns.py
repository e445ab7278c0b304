"""Contract of every messaging pattern with a drive, over every transport."""

from typing import Any

import pytest
from helpers.network.transports import PHONE, ROBOT, VirtualWorld, World
from helpers.processes.patience import PATIENCE_S

from dva_sim.network.patterns import PATTERNS, Pattern, load_pattern
from dva_sim.testing.patterns import TriedDrive

pytestmark = pytest.mark.contract

EXAMPLE = "acknowledged_pub_sub.py:AcknowledgedPubSub"


def small_drive(world: World, pattern: Pattern, **of_drive: Any) -> TriedDrive:
    return TriedDrive(world.network, pattern, node=PHONE, robot=ROBOT, **of_drive)


@pytest.mark.parametrize("name", [*PATTERNS, EXAMPLE])
def test_commands_come_in_their_order_and_each_is_accounted_for(world, name):
    options = {"every": 5} if name == EXAMPLE else {}
    drive = small_drive(world, load_pattern(name, options)(), rate_hz=50.0, timeout=PATIENCE_S)
    drive.begin()
    world.run_until(lambda: len(drive.applied) >= 20)
    drive.end()
    numbers = [number for number, _ in drive.applied]
    assert numbers == sorted(set(numbers))
    assert (drive.wrong, drive.rejections) == ([], [])
    assert 0 <= drive.held <= 1


def test_who_asks_now_and_then_finds_out_that_the_robot_is_gone(world):
    brief = 1.0
    pattern = load_pattern(EXAMPLE, {"every": 3, "timeout_s": brief})()
    drive = small_drive(world, pattern, attempts=2)
    drive.begin()
    world.run_until(lambda: drive.applied)
    drive.listen(on=False)
    world.leave(ROBOT)
    gone = world.clock.now
    world.run_until(lambda: drive.rejections)
    drive.end()
    if isinstance(world, VirtualWorld):
        assert world.clock.now - gone < 2 * brief + 1.0


@pytest.mark.parametrize("name", ["req-rep", "pipelined", EXAMPLE])
def test_who_asks_finds_out_that_it_is_refused(world, name):
    pattern = load_pattern(name, {"every": 3} if name == EXAMPLE else {})()
    drive = small_drive(world, pattern, refuses=4, timeout=PATIENCE_S)
    drive.begin()
    world.run_until(lambda: drive.rejections)
    drive.end()
    assert drive.rejections[0][1].endswith(": bad session")
