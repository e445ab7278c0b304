"""Profiles of robots of ROS: what ships, and what is refused at the start."""

import pytest
from helpers.paths import ROOT
from helpers.ros.ros_machine import write_profile
from helpers.wording import unnamed

from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.resources import available
from dva_sim.live.ros_robot import run_ros_robot
from dva_sim.options.runs import RobotOptions
from dva_sim.ros.profile import DEFAULT, FOLDER, load_ros_profile
from dva_sim.ros.websocket import PORT, WebSocketUrl


def test_every_profile_that_ships_is_valid():
    names = sorted(path.stem for path in (ROOT / FOLDER).glob("*.yaml"))
    assert DEFAULT in names
    assert names == sorted(available(FOLDER))
    for name in names:
        assert load_ros_profile(name).description


def test_types_are_written_as_the_version_of_ros_has_them():
    new = load_ros_profile(DEFAULT)
    assert new.type_name("nav_msgs", "Odometry") == "nav_msgs/msg/Odometry"
    old = new.model_copy(update={"ros": 1})
    assert old.type_name("nav_msgs", "Odometry") == "nav_msgs/Odometry"
    assert new.topic("robot_1", "odom") == new.topic("/robot_1/", "odom") == "/robot_1/odom"
    assert new.topic("robot_1", "/tf") == "/tf"


@pytest.mark.parametrize(
    ("changed", "named"),
    [
        ({"max_speed_mps": "-1"}, "limits.max_speed_mps"),
        ({"odometry": "2 words"}, "topics.odometry"),
        ({"ros": "3"}, "ros"),
        ({"command": "Ackermann"}, "Twist"),
        ({"watchdog_s": "0.05"}, "command_hz"),
        ({"length": "ft"}, "units.length"),
    ],
)
def test_a_profile_that_makes_no_sense_is_refused_with_file_and_key(tmp_path, changed, named):
    path = write_profile(tmp_path, **changed)
    with pytest.raises(ConfigError) as refused:
        load_ros_profile(str(path))
    assert unnamed(refused.value, "robot.yaml", named) == []


@pytest.mark.parametrize(
    ("given", "named"),
    [
        ({"ros": "http://here:9090"}, "ws://"),
        ({"ros": "wss://here:9090"}, "wss://"),
        ({"dva": ""}, "--dva"),
        ({"dva": "nowhere"}, "--dva"),
        ({"namespace": "/"}, "--namespace"),
        ({"namespace": "robot 1"}, "--namespace"),
        ({"host": "0.0.0.0"}, "--host"),
        ({"profile": "differentia"}, "differential"),
    ],
)
def test_a_call_that_makes_no_sense_is_refused_before_anything_is_opened(given, named):
    words = {"ros": "ws://127.0.0.1:9090", "dva": "127.0.0.1:5600"} | given
    with pytest.raises(ConfigError) as refused:
        run_ros_robot(RobotOptions(**words), print)
    assert unnamed(refused.value, named) == []


def test_an_address_without_a_port_has_that_of_rosbridge():
    assert WebSocketUrl("ws://robot", "--ros").port == PORT
    assert WebSocketUrl("ws://robot:80/path", "--ros").port == 80
