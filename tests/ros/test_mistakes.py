"""Mistakes in profiles of robots of ROS, and in calls of the program that joins one."""

from pathlib import Path

from helpers.mistakes import check_mistake, each_mistake, mistakes
from helpers.ros.ros_machine import write_profile

from dva_sim.live.ros_robot import run_ros_robot
from dva_sim.options.runs import RobotOptions
from dva_sim.ros.profile import load_ros_profile

WORDS = {"ros": "ws://127.0.0.1:9090", "dva": "127.0.0.1:5600"}


def profile(changed):
    load_ros_profile(str(write_profile(Path(), **changed)))


def robot(given):
    run_ros_robot(RobotOptions(**(WORDS | given)), print)


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


@each_mistake(MISTAKES)
def test_a_mistake_ends_in_one_line_with_its_names(tmp_path, act, error, names):
    check_mistake(tmp_path, act, error, names)
