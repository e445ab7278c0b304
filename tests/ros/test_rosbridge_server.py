"""Our robots for clients of ROS: what they see, what they may, and what they cannot disturb."""

import contextlib
import itertools
import json
import math
import socket
import threading

import pytest
from helpers.network.port_visitors import DeafClient, is_closed
from helpers.ros.served_world import ScriptedRosClient, ServedWorld
from helpers.wording import unnamed
from websockets.exceptions import ConnectionClosed

pytestmark = pytest.mark.system

CMD = "/robot_1/cmd_vel"
CRLF = "\r\n"


@pytest.fixture
def world():
    world = ServedWorld()
    yield world
    world.close()


def address_of(world):
    host, _, port = world.url.partition("?")[0].removeprefix("ws://").strip("/").partition(":")
    return host, int(port)


def driver(world, name="robot_1"):
    return driver_of(world, world.client(), name)


def driver_of(world, client, name="robot_1"):
    taken = client.call(world, f"/{name}/take_control")
    assert (taken["result"], taken["success"]) == (True, True)
    return client


def drive(world, client, speed=0.3, turn_rate=0.0, topic=CMD):
    """Command until the robot of the topic has the command."""
    robot = world.robot("robot-1" if "robot_1" in topic else "robot-2")

    def has_it():
        client.twist(topic, speed, turn_rate)
        world.pause(0.05)
        return robot.set_point[:2] == pytest.approx((speed, turn_rate))

    world.until(has_it)
    return robot


def test_topics_and_services_are_listed_with_the_types_of_ros(world):
    client = world.client()
    reported = client.call(world, "/rosapi/topics")
    types = dict(zip(reported["topics"], reported["types"], strict=True))
    assert types["/robot_2/odom"] == "nav_msgs/Odometry"
    assert types["/map"] == "nav_msgs/OccupancyGrid"
    assert client.call(world, "/rosapi/topic_type", topic=CMD)["type"] == "geometry_msgs/Twist"
    services = client.call(world, "/rosapi/services")["services"]
    assert {"/robot_1/take_control", "/robot_2/emergency_stop"} <= set(services)
    assert client.call(world, "/robot_3/take_control")["result"] is False
    assert client.call(world, "/rosapi/delete_param")["result"] is False


def test_odometry_tf_scan_clock_and_map_come_as_long_as_they_are_wanted(world):
    client, robot = world.client(), world.robot("robot-1")
    client.subscribe("/robot_1/odom", "nav_msgs/msg/Odometry")
    client.subscribe("/robot_1/scan", "sensor_msgs/LaserScan")
    client.subscribe("/tf")
    client.subscribe("/clock")
    client.subscribe("/map")
    topics = "/robot_1/odom", "/robot_1/scan", "/tf", "/clock", "/map"
    world.until(lambda: all(client.of(topic) for topic in topics))
    pose = client.of("/robot_1/odom")[0]["pose"]["pose"]["position"]
    assert (pose["x"], pose["y"]) == pytest.approx((robot.body.x, robot.body.y))
    assert all(0.0 <= value <= 8.0 for value in client.of("/robot_1/scan")[0]["ranges"])
    stage, reported = world.world.run.stage, client.of("/map")[0]
    assert len(reported["data"]) == reported["info"]["width"] * reported["info"]["height"]
    row = int(
        (pose["y"] - reported["info"]["origin"]["position"]["y"]) / reported["info"]["resolution"]
    )
    column = int(
        (pose["x"] - reported["info"]["origin"]["position"]["x"]) / reported["info"]["resolution"]
    )
    assert reported["data"][row * reported["info"]["width"] + column] == 0
    assert set(reported["data"]) <= {-1, 0, 100}
    assert stage.site.grid.cells.size >= len(reported["data"])
    clock = client.of("/clock")[-1]["clock"]
    assert clock["sec"] + clock["nanosec"] * 1e-9 == pytest.approx(world.clock.now, abs=5.0)
    client.say({"op": "unsubscribe", "topic": "/robot_1/odom"})
    client.say({"op": "unsubscribe", "topic": "/tf"})
    known = world.gateway.robots["robot_1"]
    world.until(lambda: known.frames is None)  # what nobody wants does not load the link
    assert known.scan is not None


def test_a_throttled_topic_comes_no_more_often_than_asked(world):
    client = world.client()
    client.subscribe("/clock", throttle_rate=1000)
    world.until(lambda: len(client.of("/clock")) == 3)
    times = [
        entry["clock"]["sec"] + entry["clock"]["nanosec"] * 1e-9 for entry in client.of("/clock")
    ]
    assert all(b - a >= 1.0 - 1e-3 for a, b in itertools.pairwise(times))


def test_nobody_drives_without_control_and_two_cannot_have_it(world):
    first, second = driver(world), world.client()
    drive(world, first, 0.3, 0.1)
    second.twist(CMD, 0.5)
    world.until(lambda: second.statuses)
    assert unnamed(second.statuses[0], "take_control") == []
    taken = second.call(world, "/robot_1/take_control")
    assert (taken["success"], unnamed(taken["message"], "held")) == (False, [])
    assert world.robot("robot-1").set_point.speed != 0.5
    assert first.call(world, "/robot_1/release_control")["success"]
    world.until(lambda: not world.robot("robot-1").is_moving)
    world.until(lambda: second.call(world, "/robot_1/take_control")["success"])


def test_a_client_that_falls_silent_stops_its_robot_in_half_a_second_and_keeps_it(world):
    client = driver(world)
    robot = drive(world, client)
    world.until(lambda: robot.is_moving)
    client.twist(CMD, 0.3)
    silent_since = world.clock.now
    world.until(lambda: robot.set_point[:2] == (0.0, 0.0))
    assert 0.4 < world.clock.now - silent_since < 2.0  # the robot's own watchdog takes 3 s
    world.until(lambda: not robot.is_moving)
    assert robot.controller.mode == "Teleoperation"
    drive(world, client, 0.2)


def test_a_client_that_is_stopped_loses_its_robot_after_5_seconds(world):
    frozen, other = DeafClient(world.url), world.client()
    world.until(lambda: frozen.is_answered)
    frozen.say({"op": "call_service", "service": "/robot_1/take_control"})
    robot = world.robot("robot-1")
    world.until(lambda: robot.controller.mode == "Teleoperation")
    silent_since = world.clock.now  # it answers no ping from now on
    world.until(lambda: robot.controller.grant is None)
    assert 3.0 < world.clock.now - silent_since < 20.0
    assert other.call(world, "/robot_1/take_control")["success"]
    world.pause(6.0)
    assert other.is_open  # it answers pings
    frozen.sock.close()


def test_a_client_that_leaves_in_mid_drive_stops_its_robot_and_frees_it(world):
    client, other = driver(world), world.client()
    robot = drive(world, client)
    world.until(lambda: robot.is_moving)
    began = world.clock.now
    client.leave()
    world.until(lambda: not robot.is_moving)
    assert world.clock.now - began < 2.0  # not only by the watchdog, which takes 3 s
    world.until(lambda: robot.controller.grant is None)
    assert other.call(world, "/robot_1/take_control")["success"]
    assert any(not unnamed(line, "ROS client 1", "gone") for line in world.lines)


def test_an_emergency_stops_a_robot_whoever_drives_it(world):
    client, other = driver(world), world.client()
    robot = drive(world, client)
    assert other.call(world, "/robot_1/emergency_stop")["success"]
    world.until(lambda: not robot.is_moving)
    assert robot.controller.mode == "Idle"
    world.until(lambda: client.twist(CMD, 0.3) or client.statuses)
    assert unnamed(client.statuses[-1], "take_control") == []


def test_speeds_are_clamped_and_reverse_means_to_stand(world):
    client = driver(world)
    robot = drive(world, client, 0.4, 0.2)
    client.twist(CMD, -1.0, 0.0)
    world.until(lambda: robot.set_point.speed == 0.0)
    client.twist(CMD, 1e300, -1e300)
    world.until(lambda: robot.body.asked[0] == pytest.approx(robot.body.spec.max_speed))
    assert abs(robot.body.asked[1]) <= robot.body.spec.max_turn_rate


@pytest.mark.parametrize("delay", [0.0, 0.25])
def test_commands_and_readings_take_as_long_as_the_link_of_the_run(delay):
    world = ServedWorld(f"link.delay_s={delay}")
    try:
        client = driver(world)
        robot = drive(world, client, 0.3)
        client.subscribe("/robot_1/odom")
        world.until(lambda: client.of("/robot_1/odom"))
        taken = []
        usual = robot.body.drive
        robot.body.drive = lambda *asked: (taken.append(world.clock.now), usual(*asked))
        world.pause(1.0)  # what was under way has arrived
        taken.clear()
        reported = world.clock.now
        client.twist(CMD, 0.25)
        world.until(lambda: taken)
        assert taken[0] - reported >= delay
        stamp = client.of("/robot_1/odom")[-1]["header"]["stamp"]
        assert world.clock.now - stamp["sec"] - stamp["nanosec"] * 1e-9 >= delay
    finally:
        world.close()


def test_without_its_token_or_from_a_page_of_another_site_nobody_is_let_in(world):
    bare = world.url.partition("?")[0]
    token = world.url.partition("token=")[2]
    assert world.client(bare).refused == 401
    wrong = ("y" if token[0] == "x" else "x") + token[1:]
    assert world.client(f"{bare}?token={wrong}").refused == 401
    port = address_of(world)[1]
    named = DeafClient(world.url, Host=f"evil.example:{port}")
    world.until(lambda: named.is_answered)
    assert named.sock.recv(12) == b"HTTP/1.1 421"
    named.sock.close()
    for page in ({"Origin": "http://evil.example"}, {"Origin": "null"}):
        strange = ScriptedRosClient(world.url, **page)
        world.until(lambda asked=strange: asked.refused)
        assert strange.refused == 403
    own = ScriptedRosClient(world.url, Origin=f"http://localhost:{port}")
    world.until(lambda: own.is_open)
    shown = ScriptedRosClient(bare, Authorization=f"Bearer {token}")
    world.until(lambda: shown.is_open)


BAD = {
    "no JSON": "hello",
    "no object": "[]",
    "no operation": '{"topic": "/clock"}',
    "an unknown operation": '{"op": "fragment", "id": 1}',
    "NaN": '{"op": "publish", "topic": "/robot_1/cmd_vel", "msg": {"linear": {"x": NaN}, '
    '"angular": {"z": 0}}}',
    "infinity": '{"op": "publish", "topic": "/robot_1/cmd_vel", "msg": {"linear": {"x": 1e999}, '
    '"angular": {"z": 0}}}',
    "texts": '{"op": "publish", "topic": "/robot_1/cmd_vel", "msg": {"linear": {"x": "1"}, '
    '"angular": {"z": 0}}}',
    "no message": '{"op": "publish", "topic": "/robot_1/cmd_vel"}',
    "no topic": '{"op": "subscribe"}',
    "a long topic": json.dumps({"op": "subscribe", "topic": "/" + "x" * 5000}),
    "another type": '{"op": "subscribe", "topic": "/clock", "type": "std_msgs/String"}',
    "a topic that is not served": '{"op": "subscribe", "topic": "/robot_1/secrets"}',
    "a period below zero": '{"op": "subscribe", "topic": "/clock", "throttle_rate": -1}',
    "a topic that is not read": '{"op": "advertise", "topic": "/tf", "type": "tf2_msgs/TFMessage"}',
    "depth": "[" * 50_000,
}


@pytest.mark.parametrize("bad", BAD, ids=str)
def test_what_makes_no_sense_is_refused_in_one_line_and_the_drive_goes_on(world, bad):
    client = driver(world)
    robot = drive(world, client, 0.3)
    client.say(BAD[bad])
    world.until(lambda: client.statuses)
    assert "\n" not in client.statuses[0]
    assert client.is_open
    drive(world, client, 0.2)
    assert math.isfinite(sum(robot.set_point))


def test_a_picture_of_10_megabytes_ends_the_connection_of_who_sends_it_and_no_other(world):
    client, rude = driver(world), world.client()
    drive(world, client, 0.3)
    large = json.dumps({"op": "publish", "topic": "/x", "msg": "A" * 10_000_000})

    def send():
        with contextlib.suppress(ConnectionClosed, OSError):
            rude.say(large)

    threading.Thread(target=send).start()
    world.until(lambda: rude.closed)
    assert rude.closed in (1009, 1006)
    drive(world, client, 0.2)


def test_a_flood_is_dropped_in_one_line_and_others_drive_on(world):
    client, rude = driver(world), driver(world, "robot_2")
    for _ in range(2000):
        rude.twist("/robot_2/cmd_vel", 0.1)
    assert rude.call(world, "/robot_2/emergency_stop")["success"]
    drive(world, client, 0.3)
    world.until(lambda: any("floods" in line for line in world.lines))
    assert sum("floods" in line for line in world.lines) == 1
    assert rude.is_open
    assert client.is_open


def test_a_client_that_reads_nothing_is_served_no_more_and_disturbs_nobody(world):
    client, deaf = driver(world), world.client()
    deaf.subscribe("/map")
    for _ in range(40):
        deaf.subscribe("/map")
    drive(world, client, 0.3)
    connections = [c for c, p in world.server._peers.items() if p is not None]
    assert all(connection.waiting <= 10_000_000 for connection in connections)


def test_clients_beyond_the_limit_may_only_stop_robots(world):
    clients = [world.client() for _ in range(16)]
    assert all(client.is_open for client in clients)
    robot = drive(world, driver_of(world, clients[0]))
    late = world.client()
    assert not late.call(world, "/robot_2/take_control")["success"]
    late.subscribe("/map")
    world.until(lambda: late.statuses)
    assert late.call(world, "/robot_1/emergency_stop")["success"]
    world.until(lambda: robot.controller.mode == "Idle")
    clients[1].leave()
    world.until(lambda: driver(world, "robot_2").is_open)
    assert not late.closed


def test_connections_without_a_token_keep_nobody_out_and_are_closed(world):
    with contextlib.ExitStack() as stack:
        silent = [
            stack.enter_context(socket.create_connection(address_of(world))) for _ in range(200)
        ]
        client = driver(world)
        assert client.call(world, "/robot_1/emergency_stop")["success"]
        assert len(world.server._peers) <= 64
        closed = []

        def all_are_closed():
            closed.extend(sock for sock in silent if sock not in closed and is_closed(sock))
            return len(closed) == 200

        world.until(all_are_closed)
        assert client.is_open


@pytest.mark.parametrize(
    ("line", "more", "status"),
    [
        ("GET //[?token= HTTP/1.1", "", b"400"),
        ("GET / HTTP/1.1", f"Host: localhost{CRLF}", b"400"),
        ("GET / HTTP/1.1", f"Origin: http://[{CRLF}", b"403"),
    ],
)
def test_a_request_that_makes_no_sense_is_refused_and_the_drive_goes_on(world, line, more, status):
    client = driver(world)
    head = f"{line}\r\nHost: localhost\r\n{more}Upgrade: websocket\r\n"
    head += "Connection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
    head += "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n"
    with socket.create_connection(address_of(world)) as rude:
        rude.sendall(head.encode())
        rude.setblocking(False)
        answer = []

        def is_refused():
            with contextlib.suppress(BlockingIOError):
                answer.append(rude.recv(1000))
            return answer

        world.until(is_refused)
    assert answer[0].startswith(b"HTTP/1.1 " + status)
    drive(world, client, 0.2)


def test_a_request_together_with_good_bye_is_not_answered_and_the_drive_goes_on(world):
    client, rude = driver(world), world.client()
    gone = len(world.lines)
    text = json.dumps({"op": "call_service", "service": "/rosapi/topics"}).encode()
    mask = bytes(4)
    frames = bytes([0x81, 0x80 | 126]) + len(text).to_bytes(2, "big") + mask + text
    rude.send_raw(frames + bytes([0x88, 0x82]) + mask + (1000).to_bytes(2, "big"))
    world.until(lambda: len(world.lines) > gone)
    drive(world, client, 0.2)
