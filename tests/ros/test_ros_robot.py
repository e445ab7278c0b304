"""A robot of ROS as a device: driven by permission, and safe whatever its bridge or it does."""

import json
import math
import threading
import urllib.request

import pytest
from helpers.ros.bridged_robot import BridgedRobot
from helpers.ros.ros_machine import JPEG, fixture
from helpers.wording import counted, unnamed

from dva_sim.cameras.service import PictureService
from dva_sim.protocol import messages as m
from dva_sim.ros.client import SILENT_AFTER
from dva_sim.ros.profile import RosLimits, RosProfile, RosTopics
from dva_sim.serving.listening import listen

pytestmark = pytest.mark.system

SHORT = RosLimits(watchdog_s=0.5, stands_within_s=0.5)


@pytest.fixture
def robot(machine):
    robot = BridgedRobot(machine, RosProfile(limits=SHORT))
    yield robot
    robot.close()


def driven(robot):
    robot.ready()
    robot.start()
    assert robot.drive(0.3, 0.1).code == m.OK
    robot.until(lambda: robot.machine.speed == 0.3)
    return robot


def test_topics_are_advertised_and_subscribed_to_as_the_protocol_has_it(robot):
    robot.ready()
    assert robot.machine.ops("advertise") == [
        {"op": "advertise", "topic": "/robot_1/cmd_vel", "type": "geometry_msgs/msg/Twist"}
    ]
    subscribed = {each["topic"]: each for each in robot.machine.ops("subscribe")}
    assert {topic: each["type"] for topic, each in subscribed.items()} == {
        "/robot_1/odom": "nav_msgs/msg/Odometry",
        "/robot_1/battery_state": "sensor_msgs/msg/BatteryState",
        "/robot_1/image_raw/compressed": "sensor_msgs/msg/CompressedImage",
        "/robot_1/scan": "sensor_msgs/msg/LaserScan",
    }
    assert {each["queue_length"] for each in subscribed.values()} == {1}


def test_a_permitted_driver_drives_it_and_its_status_is_what_odometry_says(robot):
    driven(robot)
    assert robot.machine.commands[-1] == (0.3, 0.1)
    x = robot.agent.body.x
    robot.statuses.clear()

    def drives():
        assert robot.drive(0.3, 0.0).code == m.OK
        return robot.agent.body.x > x + 0.05 and robot.statuses

    robot.until(drives)
    assert robot.statuses[-1].speed == pytest.approx(0.3)
    frame, where = robot.agent.device.frame, robot.statuses[-1].position
    assert frame.to_xy(where.latitude, where.longitude)[0] == pytest.approx(x, abs=2.0)
    assert robot.ask(m.StopTeleOp()).code == m.OK
    robot.until(lambda: robot.machine.speed == 0.0)


def test_nobody_drives_without_the_permission_of_the_dva(robot):
    robot.until(lambda: not robot.agent.unfit)
    assert robot.ask(m.StartTeleOp()).code == m.NOT_PERMITTED
    assert robot.ask(m.GoTo((m.Position(0.0, 0.0),))).code == m.NOT_SUPPORTED
    assert all(command == (0.0, 0.0) for command in robot.machine.commands)


def test_commands_are_clamped_and_never_in_reverse(robot):
    driven(robot)
    robot.agent.body.drive(9.0, -9.0, robot.clock.now + 0.3)
    robot.until(lambda: (0.5, -SHORT.max_turn_rate_rad_s) in robot.machine.commands)
    robot.agent.body.drive(-9.0, math.nan, robot.clock.now + 0.3)
    robot.until(lambda: robot.machine.speed == 0.0)
    assert all(0.0 <= speed <= 0.5 for speed, _ in robot.machine.commands)


def test_a_driver_who_falls_silent_is_stopped_by_the_watchdog(robot):
    driven(robot)
    began = robot.clock.now
    robot.until(lambda: robot.machine.speed == 0.0)
    assert robot.clock.now - began < SHORT.watchdog_s + 1.0
    moving = [command for command in robot.machine.commands if command != (0.0, 0.0)]
    assert len(moving) >= 3  # it was repeated meanwhile


def test_an_emergency_of_anybody_stops_it(robot):
    driven(robot)
    assert robot.ask(m.Emergency(), source="02:00:00:00:00:99").code == m.OK
    robot.until(lambda: robot.machine.speed == 0.0)
    assert robot.agent.controller.mode == "Idle"


def test_a_lost_bridge_stops_the_drive_is_told_and_comes_back(robot):
    driven(robot)
    robot.machine.obeys = False  # its motors keep what they had, so that the order to stand shows
    robot.machine.stop()
    robot.until(lambda: robot.agent.unfit)
    assert "bridge" in robot.agent.unfit
    assert robot.agent.controller.mode == "Idle"
    robot.until(lambda: robot.statuses[-1].mode == "Idle")
    refused = robot.ask(m.StartTeleOp())
    assert (refused.code, unnamed(refused.text, "bridge")) == (m.BUSY, [])
    # An emergency cannot reach the motors, and says so.
    refused = robot.ask(m.Emergency())
    assert (refused.code, unnamed(refused.text, "bridge")) == (m.BUSY, [])
    assert len([line for line in robot.story if "the bridge is lost" in line]) == 1
    reported = len(robot.statuses)
    robot.pause(1.5)
    assert len(robot.statuses) == reported  # silent, so that the DVA counts it as gone
    robot.machine.heard.clear()
    robot.machine.obeys = True
    robot.machine.start()
    robot.until(lambda: not robot.agent.unfit)
    first = robot.machine.ops("publish")[0]["msg"]
    assert (first["linear"]["x"], first["angular"]["z"]) == (0.0, 0.0)
    robot.until(lambda: robot.machine.speed == 0.0)
    robot.until(lambda: robot.ask(m.StartTeleOp()).code == m.OK)


def test_late_odometry_stops_the_drive_and_another_one_may_begin_afterwards(robot):
    driven(robot)
    robot.machine.tells = False
    robot.until(lambda: robot.agent.unfit)
    assert unnamed(robot.agent.unfit, "odometry", "0.5 s") == []
    robot.until(lambda: robot.machine.speed == 0.0)
    assert robot.ask(m.StartTeleOp()).code == m.BUSY
    robot.machine.tells = True
    robot.until(lambda: not robot.agent.unfit)
    robot.start()


def test_odometry_that_arrives_steadily_but_is_old_stops_the_drive_and_renews_the_bridge(robot):
    driven(robot)
    robot.machine.lag = 2.0
    robot.until(lambda: "late" in robot.agent.unfit)
    robot.until(lambda: robot.machine.connections == 2)
    robot.until(lambda: not robot.agent.unfit)  # of the new connection it is the freshest


def test_a_robot_that_does_not_stop_is_told_of_and_told_to_stand_on_and_on(robot):
    driven(robot)
    robot.machine.obeys = False
    assert robot.ask(m.StopTeleOp()).code == m.OK
    robot.until(lambda: robot.agent.unfit)
    assert unnamed(robot.agent.unfit, "stop", "0.5 s") == []
    assert robot.ask(m.StartTeleOp()).code == m.BUSY
    reported = len(robot.machine.commands)
    robot.until(lambda: len(robot.machine.commands) > reported + 20)
    assert set(robot.machine.commands[reported:]) == {(0.0, 0.0)}
    robot.machine.obeys = True
    robot.until(lambda: not robot.agent.unfit)


def test_a_bridge_that_says_nothing_is_kept_as_long_as_it_lives(machine):
    machine.tells = False
    robot = BridgedRobot(machine)
    try:
        robot.until(lambda: machine.connections == 1)
        robot.pause(SILENT_AFTER + 1.5)
        assert machine.connections == 1
        assert robot.robot.bridge.is_connected
    finally:
        robot.close()


def test_a_bridge_that_has_gone_without_a_word_is_given_up():
    with listen("127.0.0.1", 0) as mute:
        mute.setblocking(True)
        url = f"ws://127.0.0.1:{mute.getsockname()[1]}"
        robot = BridgedRobot(type("Mute", (), {"url": url}))
        try:
            robot.until(lambda: "does not speak WebSocket" in robot.agent.unfit)
        finally:
            robot.close()


def test_odometry_in_another_frame_keeps_the_robot_from_registering(machine):
    machine.frame = "map"
    robot = BridgedRobot(machine)
    try:
        robot.until(lambda: "refused" in robot.agent.unfit)
        assert unnamed(robot.agent.unfit, "frame_id", "'map'", "frames.odometry") == []
        assert not any(isinstance(each, m.Registration) for each in robot.heard)
        machine.frame = "odom"
        robot.ready()
    finally:
        robot.close()


def test_a_robot_beside_the_site_is_told_of_by_its_place(machine):
    machine.x = 5000.0
    robot = BridgedRobot(machine)
    try:
        robot.ready()
        assert any(not unnamed(line, "5000.0", "origin") for line in robot.story)
    finally:
        robot.close()


def test_stamped_commands_and_tf_are_read_and_written_if_the_profile_says_so(machine):
    profile = RosProfile(command="TwistStamped", ros=1, topics=RosTopics(odometry=None))
    robot = BridgedRobot(machine, profile)
    try:
        robot.until(lambda: machine.connections == 1)
        tf = fixture("tf")

        def say_again():
            stamp = tf["msg"]["transforms"][1]["header"]["stamp"]
            stamp["nanosec"] += 1000
            machine.say(tf)
            return any(isinstance(each, m.Registration) for each in robot.heard)

        robot.until(say_again)
        assert machine.ops("subscribe")[-1]["type"] == "tf2_msgs/TFMessage"
        assert machine.ops("publish")[0]["msg"]["header"]["stamp"] == {"secs": 0, "nsecs": 0}
        assert machine.ops("publish")[0]["msg"]["header"]["frame_id"] == "base_link"
    finally:
        robot.close()


def test_battery_and_scan_are_sensors_of_the_robot(robot):
    robot.ready()
    robot.machine.say(fixture("battery"))
    robot.machine.say(fixture_text := json.dumps(fixture("scan")))
    assert "NaN" in fixture_text
    sensors = robot.agent.sensors
    robot.until(lambda: sensors["battery"].read(0.0) == (0.625,) and sensors["lidar"].read(0.0))
    assert sensors["lidar"].read(0.0)[0] == 0.5


BAD = {
    "no JSON": b"\xff\xfe{",
    "no object": "[1, 2]",
    "no operation": "{}",
    "NaN": json.dumps(fixture("battery")).replace("0.625", "NaN"),
    "wrong types": json.dumps(fixture("scan") | {"msg": {"ranges": "many"}}),
    "no message": json.dumps({"op": "publish", "topic": "/robot_1/odom"}),
    "deep": "[" * 100_000,
    "10 MB": json.dumps(fixture("picture") | {"msg": {"data": "A" * 10_000_000}}),
    "an unknown topic": json.dumps(
        {"op": "publish", "topic": "/other", "msg": {"x": "y" * 300_000}}
    ),
}


@pytest.mark.parametrize("bad", BAD, ids=str)
def test_bad_messages_are_dropped_in_one_line_and_the_drive_goes_on(robot, bad):
    driven(robot)
    before, lines = len(robot.recorder.timeline), 3
    # A server blocks while it sends what is large.
    saying = [threading.Thread(target=robot.machine.say, args=(BAD[bad],)) for _ in range(lines)]
    for thread in saying:
        thread.start()
    robot.until(lambda: counted(robot.recorder.counters, "refused from the robot") >= lines)
    story = [moment.what for moment in robot.recorder.timeline[before:]]
    assert len([line for line in story if "refused" in line]) == 1
    assert "\n" not in "".join(story)
    for thread in saying:
        thread.join()
    assert robot.machine.connections == 1
    robot.until(lambda: not robot.agent.unfit)


def test_a_flood_disturbs_nobody_and_the_robot_is_driven_on(robot):
    driven(robot)
    text = json.dumps(fixture("battery"))
    flood = threading.Thread(target=lambda: [robot.machine.say(text) for _ in range(5000)])
    flood.start()
    assert robot.drive(0.2).code == m.OK
    robot.until(lambda: robot.machine.speed == 0.2)
    robot.until(lambda: not flood.is_alive())


def test_pictures_are_served_as_they_are_and_late_ones_are_not_shown(machine):
    machine.pictures = True
    robot = BridgedRobot(machine)
    service = PictureService("127.0.0.1", 0, robot.clock, robot.story.append)
    try:
        service.serve("robot-1")
        robot.robot.on_picture = service.show
        robot.ready()
        got = []

        def look():
            with urllib.request.urlopen(f"{service.base}camera/robot-1.jpg", timeout=60) as page:
                got.append(page.read())

        looking = threading.Thread(target=look)
        looking.start()
        robot.until(lambda: got)
        looking.join()
        assert got[0] == JPEG
        robot.until(lambda: not robot.agent.blind)
        machine.pictures = False
        robot.until(lambda: robot.agent.blind)
        assert not robot.agent.unfit
    finally:
        service.close()
        robot.close()


def test_at_the_end_the_robot_is_told_to_stand_and_topics_are_given_back(machine):
    robot = driven(BridgedRobot(machine))
    robot.robot.close()
    robot.until(lambda: machine.ops("unadvertise"))
    assert machine.commands[-1] == (0.0, 0.0)
    assert len(machine.ops("unsubscribe")) == 4
    robot.close()
