"""Our rosbridge server as roslibpy finds it, which nobody here wrote."""

import threading

import pytest
from helpers.processes.patience import PATIENCE_S
from helpers.ros.served_world import ServedWorld

roslibpy = pytest.importorskip("roslibpy", reason="needs roslibpy: pip install -e '.[ros]'")

pytestmark = pytest.mark.system


@pytest.fixture(scope="module")
def ros_and_world():
    """One connection for all tests: the reactor of roslibpy cannot be started twice."""
    world = ServedWorld()
    ros = roslibpy.Ros(world.url)
    running = threading.Thread(target=ros.run, args=(PATIENCE_S,), daemon=True)
    running.start()
    world.until(lambda: ros.is_connected)
    yield ros, world
    ros.close()
    world.until(lambda: not ros.is_connected)
    world.close()


def ask(world, call):
    """Result of a blocking call, while the world keeps running."""
    got = []
    thread = threading.Thread(target=lambda: got.append(call()), daemon=True)
    thread.start()
    world.until(lambda: got)
    return got[0]


def test_it_lists_topics_types_and_services(ros_and_world):
    ros, world = ros_and_world
    assert "/robot_1/odom" in ask(world, ros.get_topics)
    assert ask(world, lambda: ros.get_topic_type("/robot_1/scan")) == "sensor_msgs/LaserScan"
    assert "/robot_2/take_control" in ask(world, ros.get_services)
    reported = ask(world, lambda: ros.get_service_type("/robot_2/take_control"))
    assert reported == "std_srvs/Trigger"
    assert "/dva_sim" in ask(world, ros.get_nodes)


def test_it_takes_control_drives_reads_odometry_and_gives_back(ros_and_world):
    ros, world = ros_and_world
    places = []
    odom = roslibpy.Topic(ros, "/robot_2/odom", "nav_msgs/Odometry", throttle_rate=50)
    odom.subscribe(lambda message: places.append(message["pose"]["pose"]["position"]["x"]))
    control = roslibpy.Service(ros, "/robot_2/take_control", "std_srvs/Trigger")
    assert ask(world, lambda: control.call(roslibpy.ServiceRequest()))["success"]
    command = roslibpy.Topic(ros, "/robot_2/cmd_vel", "geometry_msgs/Twist")
    twist = {"linear": {"x": 0.3, "y": 0.0, "z": 0.0}, "angular": {"x": 0.0, "y": 0.0, "z": 0.1}}
    robot = world.robot("robot-2")
    start = robot.body.x, robot.body.y

    def has_moved():
        command.publish(roslibpy.Message(twist))
        world.pause(0.1)
        return abs(robot.body.x - start[0]) + abs(robot.body.y - start[1]) > 0.2

    world.until(has_moved)
    world.until(lambda: places and places[-1] != places[0])
    stop = roslibpy.Service(ros, "/robot_2/emergency_stop", "std_srvs/Trigger")
    assert ask(world, lambda: stop.call(roslibpy.ServiceRequest()))["success"]
    world.until(lambda: not robot.is_moving)
    back = roslibpy.Service(ros, "/robot_2/release_control", "std_srvs/Trigger")
    assert ask(world, lambda: back.call(roslibpy.ServiceRequest()))["success"]
