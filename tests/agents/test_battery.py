import math

import pytest

from dva_sim.agents.robot.battery import Battery, BatteryProfile
from dva_sim.agents.robot.profile import load_robot
from dva_sim.worlds.geo import Pose
from dva_sim.worlds.physics import World, hall

PROFILE = BatteryProfile(
    capacity_wh=100.0, idle_w=50.0, rolling_resistance=0.02, efficiency=0.5, charging_w=200.0
)
FULL = 100.0 * 3600.0  # [J]


def battery(share=1.0):
    return Battery(PROFILE, mass=60.0, share=share)


def test_waiting_takes_the_idle_draw():
    cell = battery()
    cell.advance(3600.0, 0.0, 0.0, at_base=False)
    assert cell.share == pytest.approx(0.5)


def test_driving_takes_rolling_resistance_and_the_work_of_the_motors_by_efficiency():
    cell = battery()
    cell.advance(0.0, 100.0, 75.0, at_base=False)
    rolling = 0.02 * 60.0 * 9.81 * 100.0
    assert FULL - cell.energy == pytest.approx((rolling + 75.0) / 0.5)


def test_how_often_it_is_asked_changes_nothing():
    often, seldom = battery(), battery()
    for second in range(1, 1001):
        often.advance(second, 0.4 * second, 0.1 * second, at_base=False)
    seldom.advance(1000, 400, 100, at_base=False)
    assert often.energy == pytest.approx(seldom.energy)


def test_an_empty_battery_draws_nothing_more_and_charges_again():
    cell = battery(share=0.01)
    cell.advance(3600.0, 0.0, 0.0, at_base=False)
    assert cell.empty
    assert cell.share == 0.0
    cell.advance(3600.0 + 900.0, 0.0, 0.0, at_base=True)
    assert cell.share == pytest.approx(200.0 * 900.0 / FULL)
    assert not cell.empty


def test_a_battery_does_not_become_fuller_than_full():
    cell = battery(share=0.9)
    cell.advance(36_000.0, 0.0, 0.0, at_base=True)
    assert cell.share == 1.0


@pytest.mark.parametrize(("name", "hours"), [("servrobot", 8.0), ("pibot", 6.17)])
def test_the_shipped_robots_wait_for_hours(name, hours):
    profile = load_robot(name)
    cell = Battery(profile.battery, profile.mass_kg)
    cell.advance(hours * 3600.0 - 60.0, 0.0, 0.0, at_base=False)
    assert not cell.empty
    cell.advance(hours * 3600.0 + 60.0, 0.0, 0.0, at_base=False)
    assert cell.empty


def test_a_robot_that_drives_up_and_down_pays_for_every_start():
    """Each start is worth half m v^2 = 7.5 J, and each metre 0.02 m g = 11.8 J."""
    world = World(hall(40.0, 4.0), 0.02)
    robot = world.add_robot("robot-1", load_robot("servrobot").drive_spec(), Pose(1.0, 2.0, 0.0))
    for start in range(0, 100, 5):
        world.advance_to(start)
        robot.drive(0.5, 0.0, start + 2.5)
    world.advance_to(100.0)
    assert robot.work == pytest.approx(20 * 7.5, rel=0.01)
    cell = battery()
    cell.advance(0.0, robot.distance, robot.work, at_base=False)
    spent = (0.02 * 60.0 * 9.81 * robot.distance + robot.work) / 0.5
    assert FULL - cell.energy == pytest.approx(spent)
    assert math.isclose(robot.distance, robot.x - 1.0, rel_tol=1e-6)
