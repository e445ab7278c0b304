"""Messages of ROS as values: both versions, units, frames, the site's origin, and bad ones."""

import base64
import math

import pytest
from helpers.ros.ros_machine import JPEG, fixture
from helpers.wording import unnamed

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


def test_a_picture_is_jpeg_and_nothing_else():
    message = fixture("picture")["msg"]
    assert reader().picture(message) == JPEG
    png = base64.b64encode(b"\x89PNG\r\n").decode()
    for bad in (png, "no base64!", [255, 216], None):
        with pytest.raises(BadReading):
            reader().picture(message | {"data": bad})


def test_a_picture_larger_than_the_profile_allows_is_refused_with_both_sizes():
    large = base64.b64encode(JPEG + bytes(10_000_000)).decode()
    with pytest.raises(BadReading) as refused:
        reader().picture({"format": "jpeg", "data": large})
    assert unnamed(refused.value, "1000000") == []


@pytest.mark.parametrize(
    ("path", "value", "named"),
    [
        (("header", "frame_id"), "map", "frames.odometry"),
        (("child_frame_id",), "base_footprint", "frames.base"),
        (("pose", "pose", "position", "x"), float("nan"), "position.x"),
        (("pose", "pose", "position", "x"), None, "position.x"),
        (("pose", "pose", "position", "x"), 1e9, "origin"),
        (("pose", "pose", "orientation", "w"), "1.0", "orientation.w"),
        (("pose", "pose", "orientation", "w"), 5.0, "quaternion"),
        (("twist", "twist", "linear", "x"), True, "linear.x"),
        (("twist", "twist", "linear", "x"), 900.0, "900"),
        (("twist", "twist"), 3, "linear"),
    ],
)
def test_odometry_that_is_not_as_it_should_be_is_refused_by_name(path, value, named):
    message = fixture("odometry-ros2")["msg"]
    place = message
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    with pytest.raises(BadReading) as refused:
        reader().odometry(message)
    assert unnamed(refused.value, named) == []


@pytest.mark.parametrize("expected", [None, [], 7, "odometry", {}, {"transforms": 4}])
def test_what_is_no_message_at_all_is_refused(expected):
    read = reader()
    for take in (read.odometry, read.charge, read.picture, read.scan):
        with pytest.raises(BadReading):
            take(expected)
    with pytest.raises(BadReading):
        read.transform(expected, None)
