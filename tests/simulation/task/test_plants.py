import math

import pytest

from dva_sim.simulation.task.plants import Cursor, Unicycle


def test_a_cursor_without_lag_goes_as_it_is_told():
    cursor = Cursor()
    for _ in range(100):
        cursor.step(0.2, -0.1, 0.01)
    assert (cursor.x, cursor.y) == pytest.approx((0.2, -0.1))


def test_a_cursor_with_lag_has_63_percent_of_its_speed_after_one_time_constant():
    cursor = Cursor(lag=0.5)
    for _ in range(50):
        cursor.step(1.0, 0.0, 0.01)
    assert cursor.vx == pytest.approx(1.0 - math.exp(-1.0))


def test_an_arm_is_no_faster_than_its_top_speed_along_each_axis():
    arm = Cursor(top=0.8)
    arm.step(3.0, -3.0, 1.0)
    assert (arm.x, arm.y) == (0.8, -0.8)


def test_a_vehicle_at_half_a_metre_and_half_a_radian_a_second_drives_a_circle_of_one_metre():
    vehicle = Unicycle(lag=0.0, top_speed=0.5, top_turn=0.6)
    for _ in range(628):
        vehicle.step(0.5, 0.5, 0.01)
        assert math.hypot(vehicle.x, vehicle.y - 1.0) == pytest.approx(1.0, abs=1e-4)
    assert vehicle.heading == pytest.approx(3.14)


def test_a_vehicle_never_reverses_and_keeps_its_limits():
    vehicle = Unicycle(lag=0.0, top_speed=0.5, top_turn=0.6)
    vehicle.step(-1.0, 5.0, 1.0)
    assert (vehicle.speed, vehicle.turn_rate) == (0.0, 0.6)
