"""Profiles of robots of ROS: what ships, and what is refused at the start."""

from helpers.paths import ROOT

from dva_sim.kernel.resources import available
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


def test_an_address_without_a_port_has_that_of_rosbridge():
    assert WebSocketUrl("ws://robot", "--ros").port == PORT
    assert WebSocketUrl("ws://robot:80/path", "--ros").port == 80
