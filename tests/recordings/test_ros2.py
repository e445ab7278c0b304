"""A recording as a ROS 2 bag, read back by the reader of another library."""

import math

import pytest
from recordings.runs import drill, drive
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore

from dva_sim.kernel.errors import ConfigError
from dva_sim.recordings.reading import read_recording
from dva_sim.recordings.ros2 import write_bag


@pytest.fixture(scope="module")
def bag(folder, tmp_path_factory):
    """All messages of the drill's bag, by topic."""
    path = tmp_path_factory.mktemp("bags") / "drill"
    write_bag(read_recording(folder / "drill.mcap").playback, path)
    store, found = get_typestore(Stores.ROS2_HUMBLE), {}
    with Reader(path) as reader:
        for connection, time, data in reader.messages():
            message = store.deserialize_cdr(data, connection.msgtype)
            found.setdefault(connection.topic, []).append((time, message))
    return found


@pytest.mark.system
def test_everybody_has_a_pose_and_a_velocity(bag):
    names = "robot_1", "robot_2", "guard_1", "guard_2"
    topics = {f"/{name}/{what}" for name in names for what in ("pose", "velocity")}
    assert set(bag) == {*topics, "/map", "/tf", "/rosout", "/robot_2/command"}


def test_poses_are_those_of_the_run(bag):
    track = drill().recorder.tracks["guard-1"]
    poses = bag["/guard_1/pose"]
    assert len(poses) == len(track)
    for (time, message), point in zip(poses[::50], track[::50], strict=True):
        stamp = message.header.stamp
        assert time == stamp.sec * 10**9 + stamp.nanosec == round(point.time * 1e9)
        place = message.pose.position
        assert (place.x, place.y) == pytest.approx((point.x, point.y), abs=1e-4)
        turn = message.pose.orientation
        assert 2 * math.atan2(turn.z, turn.w) == pytest.approx(point.heading, abs=1e-4)


def test_velocities_lead_from_one_pose_to_the_next(bag):
    """Turned into the frame of the map and added up, they give the way that was gone."""
    poses, x, y = bag["/robot_2/pose"], 0.0, 0.0
    for (_, before), (_, moved) in zip(poses, bag["/robot_2/velocity"], strict=False):
        turn, speed = before.pose.orientation, moved.twist.linear
        heading = 2 * math.atan2(turn.z, turn.w) + moved.twist.angular.z * 0.05
        x += 0.1 * (math.cos(heading) * speed.x - math.sin(heading) * speed.y)
        y += 0.1 * (math.sin(heading) * speed.x + math.cos(heading) * speed.y)
    first, last = poses[0][1].pose.position, poses[-1][1].pose.position
    assert (x, y) == pytest.approx((last.x - first.x, last.y - first.y), abs=1e-3)
    assert math.hypot(x, y) > 1


def test_commands_are_those_of_the_phone(bag):
    drove = next(d for d in drill().recorder.drives if d.commands)
    sent = [(m.twist.linear.x, m.twist.angular.z) for _, m in bag["/robot_2/command"]]
    assert sent[:50] == [pytest.approx(made[1:], abs=1e-4) for made in drove.commands[:50]]


def test_the_map_is_the_floor_of_the_site(bag):
    ((time, grid),) = bag["/map"]
    cells = drill().site.grid.cells
    assert time == 0
    assert (grid.info.height, grid.info.width) == cells.shape
    assert grid.info.resolution == pytest.approx(0.05)
    counts = [int((grid.data == value).sum()) for value in (0, 100, -1)]
    assert counts == [int((cells == value).sum()) for value in (0, 100, 255)]


def test_the_story_is_in_the_log(bag):
    reports = [(m.name, m.msg) for _, m in bag["/rosout"]]
    assert reports == [(m.who, m.what) for m in drill().recorder.timeline]


def test_a_bag_that_is_there_is_kept(tmp_path):
    with pytest.raises(ConfigError, match="already exists"):
        write_bag(drive(), tmp_path)
