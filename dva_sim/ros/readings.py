"""Values from messages of ROS, checked and converted to SI units and the site's frame.

rosbridge writes NaN and infinity into JSON as null or `NaN`; both are refused where a value is
needed.

References:
    REP 103 (units and frames), REP 117 (ranges without a valid distance); definitions of nav_msgs,
    geometry_msgs, sensor_msgs and tf2_msgs.
"""

from __future__ import annotations

import base64
import binascii
import math
from collections.abc import Mapping
from typing import Any, Final, NamedTuple

from dva_sim.ros.profile import RosProfile
from dva_sim.ros.rosbridge import is_finite

JPEG: Final = b"\xff\xd8\xff"
RAYS: Final = 36  # rays of a scan for devices, the first one ahead
MAX_RANGES: Final = 20_000  # maximum scan readings
FASTEST: Final = 50.0  # design: a higher reported speed counts as an error [m/s, rad/s]
MAX_ANGLE: Final = 10.0  # maximum angle of a scan [rad]
LATEST: Final = 1 << 40  # latest possible time [s]
FARTHEST: Final = 100_000.0  # design: greatest distance of a robot from its origin [m]


class BadReading(Exception):
    """An unusable message, with the reason."""


class RosMotion(NamedTuple):
    """Pose in the site frame [m, rad], and velocity along the heading [m/s, rad/s].

    Attributes:
        stamp: Measurement time by the robot's clock [s]; None: unknown.
    """

    x: float
    y: float
    heading: float
    speed: float
    turn_rate: float
    stamp: float | None


def number(value: Any, what: str) -> float:
    """Return a finite number.

    Raises:
        BadReading: the value is not a finite number.
    """
    if not is_finite(value):
        raise BadReading(f"{what} is {_shown(value)}, not a finite number")
    return float(value)


def part(message: Any, *path: str) -> Any:
    """Return the value at a path of keys.

    Raises:
        BadReading: the path does not exist.
    """
    for key in path:
        if not isinstance(message, Mapping) or key not in message:
            raise BadReading(f"{'.'.join(path)} is missing")
        message = message[key]
    return message


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 40 else f"{text[:37]}..."


def read_stamp(message: Any) -> float | None:
    """Return the time in a header, of ROS 1 or 2 [s]; None if it is zero or missing."""
    stamp = message.get("header", {}).get("stamp") if isinstance(message, Mapping) else None
    if not isinstance(stamp, Mapping):
        return None
    seconds = stamp.get("sec", stamp.get("secs"))
    nanoseconds = stamp.get("nanosec", stamp.get("nsecs"))
    if (
        not isinstance(seconds, int)
        or not isinstance(nanoseconds, int)
        or not (seconds or nanoseconds)
    ):
        return None
    if not 0 <= seconds < LATEST or not 0 <= nanoseconds < 1e9:
        return None
    return seconds + nanoseconds * 1e-9


def read_yaw(rotation: Any) -> float:
    """Return the heading in a quaternion [rad].

    Raises:
        BadReading: it is not a rotation.
    """
    x, y, z, w = (number(part(rotation, key), f"orientation.{key}") for key in "xyzw")
    if not 0.9 < math.sqrt(x * x + y * y + z * z + w * w) < 1.1:
        raise BadReading("orientation is not a unit quaternion")
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


class RosReader:
    """Reads the messages of one robot by its profile."""

    def __init__(self, profile: RosProfile) -> None:
        self._profile = profile
        origin = profile.origin
        self._turn = math.radians(origin.heading_deg)
        self._cos = math.cos(self._turn)
        self._sin = math.sin(self._turn)
        self._origin = origin.x_m, origin.y_m

    def odometry(self, message: Any) -> RosMotion:
        """Return the motion in a nav_msgs/Odometry.

        Raises:
            BadReading: it is not as it should be.
        """
        self._check_frame("header.frame_id", part(message, "header", "frame_id"), "odometry")
        self._check_frame("child_frame_id", part(message, "child_frame_id"), "base")
        x, y, heading = self._placed(part(message, "pose", "pose"), "position", "orientation")
        twist = part(message, "twist", "twist")
        units = self._profile.units
        speed = number(part(twist, "linear", "x"), "twist.linear.x") * units.metres
        turn = number(part(twist, "angular", "z"), "twist.angular.z") * units.radians
        if abs(speed) > FASTEST or abs(turn) > FASTEST:
            raise BadReading(f"{speed:g} m/s and {turn:g} rad/s are beyond any robot")
        return RosMotion(
            x, y=y, heading=heading, speed=speed, turn_rate=turn, stamp=read_stamp(message)
        )

    def transform(self, message: Any, before: RosMotion | None) -> RosMotion | None:
        """Return the motion in a tf2_msgs/TFMessage; None if it lacks the robot.

        Args:
            message: Transforms, one of which may concern the robot.
            before: Motion at the previous transform, to compute speeds from.

        Raises:
            BadReading: it is not as it should be.
        """
        transforms = part(message, "transforms")
        frames = self._profile.frames
        if not isinstance(transforms, list) or len(transforms) > 1000:
            raise BadReading("transforms is not a list of at most 1000")
        for each in transforms:
            ends = part(each, "header", "frame_id"), part(each, "child_frame_id")
            if tuple(_bare(end) for end in ends) == (_bare(frames.odometry), _bare(frames.base)):
                place = self._placed(part(each, "transform"), "translation", "rotation")
                return _moved(before, *place, read_stamp(each))
        return None

    def charge(self, message: Any) -> float:
        """Return the state of charge in a sensor_msgs/BatteryState, 0 to 1.

        Raises:
            BadReading: it has no state of charge.
        """
        share = number(part(message, "percentage"), "percentage")
        share /= 100.0 if self._profile.units.charge == "percent" else 1.0
        if not 0.0 <= share <= 1.0:
            raise BadReading(f"percentage {share:g} is not a share from 0 to 1: see units.charge")
        return share

    def picture(self, message: Any) -> bytes:
        """Return the JPEG in sensor_msgs/CompressedImage.

        Raises:
            BadReading: there is none, or it is too large.
        """
        data = part(message, "data")
        if not isinstance(data, str):
            raise BadReading(f"data is {_shown(type(data).__name__)}, not base64")
        size_limit = self._profile.largest_picture_bytes
        if len(data) * 3 // 4 > size_limit + 3:
            raise BadReading(f"{len(data) * 3 // 4} bytes; at most {size_limit} are taken")
        try:
            picture = base64.b64decode(data, validate=True)
        except (binascii.Error, ValueError):
            raise BadReading("data is not base64") from None
        if not picture.startswith(JPEG):
            raise BadReading("data is not JPEG")
        return picture

    def scan(self, message: Any) -> tuple[float, ...]:
        """Return the ranges of sensor_msgs/LaserScan in `RAYS` sectors [m], the nearest of each.

        Raises:
            BadReading: it is not as it should be.
        """
        units = self._profile.units
        first = number(part(message, "angle_min"), "angle_min") * units.radians
        step = number(part(message, "angle_increment"), "angle_increment") * units.radians
        range_max = number(part(message, "range_max"), "range_max") * units.metres
        ranges = part(message, "ranges")
        if not isinstance(ranges, list) or not 0 < len(ranges) <= MAX_RANGES:
            raise BadReading(f"ranges is not a list of 1 to {MAX_RANGES}")
        if not 0.0 < range_max < FARTHEST:
            raise BadReading(f"range_max {range_max:g} m is no range")
        if max(abs(first), abs(step)) > MAX_ANGLE:
            raise BadReading(f"angles of {first:g} and {step:g} rad are none")
        nearest = [range_max] * RAYS
        for index, value in enumerate(ranges):
            near = 0.0 if value == -math.inf else value  # REP 117: too close to be measured
            if is_finite(near) and near >= 0.0:
                sector = round((first + index * step) / (2.0 * math.pi / RAYS)) % RAYS
                nearest[sector] = min(nearest[sector], near * units.metres)
            elif value is not None and not isinstance(value, float):
                raise BadReading(f"ranges has {_shown(value)}, not a number")
        return tuple(round(value, 3) for value in nearest)

    def _check_frame(self, where: str, frame: Any, kind: str) -> None:
        expected = getattr(self._profile.frames, kind)
        if not isinstance(frame, str) or _bare(frame) != _bare(expected):
            raise BadReading(f"{where} is {_shown(frame)}, not {expected!r}: see frames.{kind}")

    def _placed(self, pose: Any, place: str, rotation: str) -> tuple[float, float, float]:
        scale = self._profile.units.metres
        x, y = (number(part(pose, place, key), f"{place}.{key}") * scale for key in "xy")
        if math.hypot(x, y) > FARTHEST:
            raise BadReading(f"{math.hypot(x, y):g} m from the origin is beyond any site")
        heading = read_yaw(part(pose, rotation)) + self._turn
        east = self._origin[0] + self._cos * x - self._sin * y
        return east, self._origin[1] + self._sin * x + self._cos * y, heading


def _bare(frame: Any) -> str:
    return str(frame).lstrip("/")


def _moved(
    before: RosMotion | None, x: float, y: float, heading: float, stamp: float | None
) -> RosMotion:
    """Return the motion between two poses.

    Raises:
        BadReading: the times do not increase.
    """
    if before is None:
        return RosMotion(x, y, heading, speed=0.0, turn_rate=0.0, stamp=stamp)
    if stamp is None or before.stamp is None or stamp <= before.stamp:
        raise BadReading("transforms have no time that grows, so no speed follows from them")
    dt = stamp - before.stamp
    ahead = heading
    along = (x - before.x) * math.cos(ahead) + (y - before.y) * math.sin(ahead)
    turned = math.remainder(heading - before.heading, 2.0 * math.pi)
    return RosMotion(x, y, heading, speed=along / dt, turn_rate=turned / dt, stamp=stamp)
