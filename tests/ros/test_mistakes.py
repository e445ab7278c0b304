"""Mistakes in profiles of robots of ROS, and in calls of the program that joins one."""

import base64
from functools import reduce
from operator import getitem
from pathlib import Path

from helpers.mistakes import check_mistake, each_mistake, mistakes
from helpers.ros.ros_machine import JPEG, fixture, write_profile

from dva_sim.kernel.config import validate
from dva_sim.live.ros_robot import run_ros_robot
from dva_sim.options.runs import RobotOptions
from dva_sim.ros.profile import RosProfile, load_ros_profile
from dva_sim.ros.readings import BadReading, RosReader

WORDS = {"ros": "ws://127.0.0.1:9090", "dva": "127.0.0.1:5600"}


def profile(changed):
    load_ros_profile(str(write_profile(Path(), **changed)))


def robot(given):
    run_ros_robot(RobotOptions(**(WORDS | given)), print)


def odometry(place, value):
    message = fixture("odometry-ros2")["msg"]
    *path, last = place.split("/")
    reduce(getitem, path, message)[last] = value
    READER.odometry(message)


def picture(data):
    READER.picture({"format": "jpeg", "data": data})


READER = RosReader(validate(RosProfile, {}))
POSE = "pose/pose/position/x"
TURNED = "pose/pose/orientation/w"
SPEED = "twist/twist/linear/x"
NO_MESSAGES = (None, [], 7, "odometry", {}, {"transforms": 4})
READERS = (READER.odometry, READER.charge, READER.picture, READER.scan)
READINGS = [
    *mistakes(
        odometry,
        ("header/frame_id", "map", "frames.odometry"),
        ("child_frame_id", "base_footprint", "frames.base"),
        (POSE, float("nan"), "position.x"),
        (POSE, None, "position.x"),
        (POSE, 1e9, "origin"),
        (TURNED, "1.0", "orientation.w"),
        (TURNED, 5.0, "quaternion"),
        (SPEED, True, "linear.x"),
        (SPEED, 900.0, "900"),
        ("twist/twist", 3, "linear"),
        error=BadReading,
    ),
    *mistakes(
        picture,
        (base64.b64encode(b"\x89PNG\r\n").decode(), "JPEG"),
        ("no base64!", "data"),
        ([255, 216], "data"),
        (None, "data"),
        (base64.b64encode(JPEG + bytes(10_000_000)).decode(), "1000000"),
        error=BadReading,
    ),
    *(
        case
        for read in (*READERS, lambda message: READER.transform(message, None))
        for case in mistakes(read, *((each, "") for each in NO_MESSAGES), error=BadReading)
    ),
]
MISTAKES = [
    *mistakes(
        profile,
        ({"max_speed_mps": "-1"}, "robot.yaml limits.max_speed_mps"),
        ({"odometry": "2 words"}, "robot.yaml topics.odometry"),
        ({"ros": "3"}, "robot.yaml ros"),
        ({"command": "Ackermann"}, "robot.yaml Twist"),
        ({"watchdog_s": "0.05"}, "robot.yaml command_hz"),
        ({"length": "ft"}, "robot.yaml units.length"),
    ),
    *mistakes(
        robot,
        ({"ros": "http://here:9090"}, "ws://"),
        ({"ros": "wss://here:9090"}, "wss://"),
        ({"dva": ""}, "--dva"),
        ({"dva": "nowhere"}, "--dva"),
        ({"namespace": "/"}, "--namespace"),
        ({"namespace": "robot 1"}, "--namespace"),
        ({"host": "0.0.0.0"}, "--host"),
        ({"profile": "differentia"}, "differential"),
    ),
]


@each_mistake([*READINGS, *MISTAKES])
def test_a_mistake_ends_in_one_line_with_its_names(tmp_path, act, error, names):
    check_mistake(tmp_path, act, error, names)
