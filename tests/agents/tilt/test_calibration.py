"""Calibration: what a tilt is read as."""

import math

import pytest

from dva_sim.agents.tilt.accelerometer import GRAVITY
from dva_sim.agents.tilt.calibration import Calibration


def gravity(pitch: float, roll: float) -> tuple[float, float, float]:
    flat = GRAVITY * math.cos(pitch)
    return GRAVITY * math.sin(pitch), flat * math.sin(roll), flat * math.cos(roll)


def test_a_reading_counts_steps_from_the_reference():
    app = Calibration((1.0, -0.5, 9.7), speed_step=0.35, turn_step=0.12)
    assert app.reading(1.0, -0.5, 9.7) == (0.0, 0.0)
    assert app.reading(1.0 + 3.5, -0.5 - 3.6, 8.0) == pytest.approx((10.0, -30.0))


def test_ten_levels_of_the_shipped_steps_are_21_degrees():
    pitch, roll = Calibration().pose(10.0, 0.0)
    assert math.degrees(pitch) == pytest.approx(20.9, abs=0.1)
    assert roll == 0.0


@pytest.mark.parametrize("reference", [(0.0, 0.0, GRAVITY), (4.0, 0.5, 8.94)])
def test_the_pose_of_a_reading_reads_so(reference):
    app = Calibration(reference)
    for wanted in [(0.0, 0.0), (5.0, -20.0), (-1.0, 30.0), (10.0, 30.0)]:
        assert app.reading(*gravity(*app.pose(*wanted))) == pytest.approx(wanted)


def test_beyond_what_gravity_gives_the_pose_is_the_nearest_there_is():
    pitch, _ = Calibration().pose(1000.0, 0.0)
    assert pitch == pytest.approx(math.pi / 2)


def test_a_phone_upside_down_steers_nothing():
    assert Calibration().reading(3.0, 3.0, -8.0) == (0.0, 0.0)


def test_a_phone_that_is_held_upright_has_no_side_that_must_be_up():
    steep = Calibration((9.6, 0.0, 2.0))
    assert steep.reading(9.6, 1.2, -0.5) == pytest.approx((0.0, 10.0))
    flat = Calibration((6.0, 0.0, 7.7))
    assert flat.reading(6.0, 1.2, -0.5) == (0.0, 0.0)
