"""A recording taken to ROS 2: a bag with poses, velocities, transforms, commands, map and story.

References:
    REP 103 and REP 105: metres, radians, x forward; the frame `map`.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from dva_sim.kernel.errors import ConfigError, DvaSimError
from dva_sim.kernel.recorder import Moment, TrackPoint
from dva_sim.recordings import messages
from dva_sim.simulation.full import Playback
from dva_sim.worlds.maps import UNKNOWN, OccupancyGrid

LEVELS = {"safety": 30, "mode": 10, "link": 10}  # warning for safety, debug for the others
INFO = 20

Entry = tuple[float, str, Any]  # time [s], topic, message


def write_bag(playback: Playback, folder: Path) -> None:
    """Write a run as a ROS 2 bag, in MCAP storage and virtual time from zero.

    Velocities are differences of sampled poses, in the body's own frame; commands are what the
    phones sent.

    Args:
        playback: The run.
        folder: Folder of the bag; must not exist yet.

    Raises:
        ConfigError: `rosbags` is not installed, or the folder is there.
        DvaSimError: the bag cannot be written.
    """
    try:
        from rosbags.rosbag2 import StoragePlugin, Writer, WriterError
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise ConfigError("ROS 2 bags need rosbags: pip install -e '.[ros2]'") from None
    if folder.exists():
        raise ConfigError("already exists; give a new folder for the bag", folder)
    store = get_typestore(Stores.ROS2_HUMBLE)
    entries = sorted(_entries(playback, store.types), key=lambda entry: entry[0])
    connections: dict[str, Any] = {}
    try:
        with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as bag:
            for time, topic, message in entries:
                kind = message.__msgtype__
                if topic not in connections:
                    connections[topic] = bag.add_connection(topic, kind, typestore=store)
                data = store.serialize_cdr(message, kind)
                bag.write(connections[topic], messages.nanoseconds(time), data)
    except (OSError, WriterError) as error:
        reason = getattr(error, "strerror", None) or error
        raise DvaSimError(f"{folder} cannot be written: {reason}") from None


def _entries(playback: Playback, types: Any) -> Iterator[Entry]:
    make = _Maker(types)
    yield 0.0, "/map", make.grid(playback.site.grid)
    for name, track in playback.recorder.tracks.items():
        topic = f"/{_ros_name(name)}"
        for here in track:
            yield here.time, f"{topic}/pose", make.pose(here)
            yield here.time, "/tf", make.transform(_ros_name(name), here)
        for before, after in itertools.pairwise(track):
            if after.time > before.time:
                moved = make.twist(after.time, _ros_name(name), *_velocity(before, after))
                yield after.time, f"{topic}/velocity", moved
    for drive in playback.recorder.drives:
        name = _ros_name(playback.labels[drive.robot])
        for time, speed, turn_rate in drive.commands:
            yield time, f"/{name}/command", make.twist(time, name, speed, 0.0, turn_rate)
    for moment in playback.recorder.timeline:
        yield moment.time, "/rosout", make.log(moment)


def _velocity(before: TrackPoint, after: TrackPoint) -> tuple[float, float, float]:
    """Forward and to the left [m/s], turning [rad/s], in the body's own frame."""
    gap = after.time - before.time
    turn = (after.heading - before.heading + math.pi) % (2 * math.pi) - math.pi
    middle = before.heading + turn / 2
    dx = (after.x - before.x) / gap
    dy = (after.y - before.y) / gap
    cos = math.cos(middle)
    sin = math.sin(middle)
    return cos * dx + sin * dy, cos * dy - sin * dx, turn / gap


def _ros_name(name: str) -> str:
    """Return a name as ROS allows it."""
    return "".join(letter if letter.isalnum() else "_" for letter in name)


class _Maker:
    """Makes messages of the types of a ROS release."""

    def __init__(self, types: Any) -> None:
        self._types = types

    def pose(self, p: TrackPoint) -> Any:
        """Return geometry_msgs/PoseStamped."""
        return self._new("geometry_msgs/msg/PoseStamped", self._header(p.time), self._pose(p))

    def transform(self, name: str, p: TrackPoint) -> Any:
        """Return tf2_msgs/TFMessage with one transform."""
        turn = self._pose(p).orientation
        transform = self._new("geometry_msgs/msg/Transform", self._vector(p.x, p.y), turn)
        stamped = self._new(
            "geometry_msgs/msg/TransformStamped", self._header(p.time), name, transform
        )
        return self._new("tf2_msgs/msg/TFMessage", [stamped])

    def twist(self, time: float, name: str, ahead: float, left: float, turn: float) -> Any:
        """Return geometry_msgs/TwistStamped."""
        angular = self._new("geometry_msgs/msg/Vector3", 0.0, 0.0, turn)
        twist = self._new("geometry_msgs/msg/Twist", self._vector(ahead, left), angular)
        return self._new("geometry_msgs/msg/TwistStamped", self._header(time, name), twist)

    def grid(self, grid: OccupancyGrid) -> Any:
        """Return nav_msgs/OccupancyGrid: 0 free, 100 occupied, -1 unknown."""
        rows, columns = grid.cells.shape
        origin = self._pose(TrackPoint(0.0, *grid.origin, ""))
        data = self._time(0.0), grid.resolution, columns, rows, origin
        info = self._new("nav_msgs/msg/MapMetaData", *data)
        cells = np.where(grid.cells == UNKNOWN, -1, grid.cells.astype(np.int16)).astype(np.int8)
        return self._new("nav_msgs/msg/OccupancyGrid", self._header(0.0), info, cells.ravel())

    def log(self, moment: Moment) -> Any:
        """Return rcl_interfaces/Log."""
        level = LEVELS.get(moment.kind, INFO)
        stamp = self._time(moment.time)
        return self._new("rcl_interfaces/msg/Log", stamp, level, moment.who, moment.what, "", "", 0)

    def _new(self, kind: str, *values: Any) -> Any:
        return self._types[kind](*values)

    def _time(self, time: float) -> Any:
        stamp = messages.stamp(time)
        return self._new("builtin_interfaces/msg/Time", stamp["sec"], stamp["nsec"])

    def _header(self, time: float, frame: str = messages.FRAME) -> Any:
        return self._new("std_msgs/msg/Header", self._time(time), frame)

    def _vector(self, x: float, y: float) -> Any:
        return self._new("geometry_msgs/msg/Vector3", x, y, 0.0)

    def _pose(self, p: TrackPoint) -> Any:
        place = self._new("geometry_msgs/msg/Point", p.x, p.y, 0.0)
        z = math.sin(p.heading / 2)
        w = math.cos(p.heading / 2)
        turn = self._new("geometry_msgs/msg/Quaternion", 0.0, 0.0, z, w)
        return self._new("geometry_msgs/msg/Pose", place, turn)
