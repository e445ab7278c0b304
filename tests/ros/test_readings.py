"""Messages of ROS as values: both versions, units, frames, the site's origin, and bad ones."""

import math

import pytest
from helpers.ros.ros_machine import JPEG, fixture

from dva_sim.kernel.config import validate
from dva_sim.ros.profile import RosProfile
from dva_sim.ros.readings import BadReading, RosReader

STAMP = 1764250000.25


def reader(**changed):
    return RosReader(validate(RosProfile, changed))


@pytest.mark.parametrize("version", [1, 2])
def test_odometry_of_both_versions_is_a_pose_and_a_speed(version):
    moved = reader().odometry(fixture(f"odometry-ros{version}")["msg"])
    assert moved == pytest.approx((2.0, 1.0, math.pi / 2, 0.25, -0.1, STAMP))


def test_the_origin_turns_and_shifts_what_odometry_says():
    moved = reader(origin={"x_m": 10.0, "y_m": 20.0, "heading_deg": 90.0}).odometry(
        fixture("odometry-ros2")["msg"]
    )
    assert moved[:3] == pytest.approx((10.0 - 1.0, 20.0 + 2.0, math.pi))


def test_millimetres_and_degrees_become_metres_and_radians():
    moved = reader(units={"length": "mm", "angle": "deg"}).odometry(fixture("odometry-ros2")["msg"])
    assert (moved.x, moved.speed) == pytest.approx((0.002, 0.00025))
    assert moved.turn_rate == pytest.approx(math.radians(-0.1))


def test_tf_gives_the_pose_and_speeds_follow_from_two_of_them():
    tf, read = fixture("tf")["msg"], reader()
    first = read.transform(tf, None)
    assert first == pytest.approx((2.0, 1.0, math.pi / 2, 0.0, 0.0, STAMP))
    later = tf["transforms"][1]
    later["header"]["stamp"] = {"sec": 1764250000, "nanosec": 750000000}
    later["transform"]["translation"]["y"] = 1.2
    assert read.transform(tf, first).speed == pytest.approx(0.4)
    assert read.transform({"transforms": tf["transforms"][:1]}, first) is None
    with pytest.raises(BadReading):
        read.transform(tf, read.transform(tf, None))  # the same moment twice


def test_a_battery_says_its_share_and_percent_only_where_the_profile_says_so():
    message = fixture("battery")["msg"]
    assert reader().charge(message) == 0.625
    with pytest.raises(BadReading):
        reader().charge(message | {"percentage": 62.5})
    assert reader(units={"charge": "percent"}).charge(message | {"percentage": 62.5}) == 0.625
    with pytest.raises(BadReading):
        reader().charge(message | {"percentage": None})  # as NaN comes, where it is not measured


def test_a_scan_is_the_nearest_range_of_each_sector_and_none_where_nothing_answered():
    ranges = reader().scan(fixture("scan")["msg"])
    assert len(ranges) == 36
    # null and NaN say nothing, infinity is nothing in reach, minus infinity is too close.
    assert ranges[:7] == (0.5, 3.5, 3.5, 3.5, 0.0, 0.0, 1.25)
    assert ranges[35] == 3.25


def test_a_picture_is_jpeg():
    assert reader().picture(fixture("picture")["msg"]) == JPEG
