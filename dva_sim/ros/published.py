"""Messages of ROS 2 with the positions, scans and pictures of our robots."""

from __future__ import annotations

import base64
import math
import re
from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from dva_sim.agents.observation import Observation
from dva_sim.worlds.maps import OCCUPIED, UNKNOWN, OccupancyGrid

MAP: Final = "map"  # the site's frame: x east, y north; odometry does not drift, so it is odom, too
MAX_CELLS: Final = 250_000  # design: maximum number of cells; larger sites get larger cells
REACH_M: Final = 8.0  # range of the lidar [m]
Json = dict[str, Any]


def make_namespace(label: str) -> str:
    """Return a label as a valid name in ROS: `robot-1` becomes `robot_1`."""
    name = re.sub(r"[^A-Za-z0-9_]", "_", label)
    return name if name[:1].isalpha() else f"r{name}"


def make_time(now: float) -> Json:
    """Return a time [s] as builtin_interfaces/Time."""
    seconds, nanoseconds = divmod(round(now * 1e9), 1_000_000_000)
    return {"sec": seconds, "nanosec": nanoseconds}


def _header(now: float, frame: str) -> Json:
    return {"stamp": make_time(now), "frame_id": frame}


def _turned(heading: float) -> Json:
    return {"x": 0.0, "y": 0.0, "z": math.sin(heading / 2), "w": math.cos(heading / 2)}


def _vector(x: float, y: float = 0.0, z: float = 0.0) -> Json:
    return {"x": x, "y": y, "z": z}


def odometry(name: str, observation: Observation, captured: float) -> Json:
    """Return nav_msgs/Odometry of a robot from a camera frame."""
    pose = {
        "position": _vector(observation.x, observation.y),
        "orientation": _turned(observation.heading),
    }
    twist = {
        "linear": _vector(observation.speed),
        "angular": _vector(0.0, 0.0, observation.turn_rate),
    }
    return {
        "header": _header(captured, MAP),
        "child_frame_id": f"{name}/base_link",
        "pose": {"pose": pose, "covariance": [0.0] * 36},
        "twist": {"twist": twist, "covariance": [0.0] * 36},
    }


def transform(name: str, observation: Observation, captured: float) -> Json:
    """Return tf2_msgs/TFMessage of a robot from a camera frame."""
    return {
        "transforms": [
            {
                "header": _header(captured, MAP),
                "child_frame_id": f"{name}/base_link",
                "transform": {
                    "translation": _vector(observation.x, observation.y),
                    "rotation": _turned(observation.heading),
                },
            }
        ]
    }


def scan(name: str, ranges: Sequence[float], now: float) -> Json:
    """Return sensor_msgs/LaserScan: rays all around, the first one ahead."""
    step = 2.0 * math.pi / len(ranges)
    return {
        "header": _header(now, f"{name}/base_link"),
        "angle_min": 0.0,
        "angle_max": step * (len(ranges) - 1),
        "angle_increment": step,
        "time_increment": 0.0,
        "scan_time": 0.0,
        "range_min": 0.0,
        "range_max": REACH_M,
        "ranges": [min(value, REACH_M) for value in ranges],  # noise may exceed it
        "intensities": [],
    }


def clock(now: float) -> Json:
    """Return rosgraph_msgs/Clock: the time of the run."""
    return {"clock": make_time(now)}


def picture(name: str, jpeg: bytes, captured: float) -> Json:
    """Return sensor_msgs/CompressedImage."""
    data = base64.b64encode(jpeg).decode()
    return {"header": _header(captured, f"{name}/camera"), "format": "jpeg", "data": data}


def occupancy(grid: OccupancyGrid) -> Json:
    """Return nav_msgs/OccupancyGrid: 0 free, 100 occupied, -1 unknown."""
    cells = grid.cells
    step = max(1, math.ceil(math.sqrt(cells.size / MAX_CELLS)))
    rows, columns = (-(-size // step) for size in cells.shape)
    padded = np.full((rows * step, columns * step), UNKNOWN, cells.dtype)
    padded[: cells.shape[0], : cells.shape[1]] = cells
    blocks = padded.reshape(rows, step, columns, step)
    is_known = np.where((blocks == UNKNOWN).all(axis=(1, 3)), -1, 0)
    values = np.where((blocks == OCCUPIED).any(axis=(1, 3)), 100, is_known)
    x, y, heading = grid.origin
    return {
        "header": _header(0.0, MAP),
        "info": {
            "map_load_time": make_time(0.0),
            "resolution": grid.resolution * step,
            "width": columns,
            "height": rows,
            "origin": {"position": _vector(x, y), "orientation": _turned(heading)},
        },
        "data": values.ravel().tolist(),
    }
