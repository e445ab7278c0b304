"""Profiles of robots of ROS: topics, message types, units, frames, the site's origin, limits."""

from __future__ import annotations

import math
import re
from typing import Annotated, Final, Literal

from pydantic import Field, field_validator, model_validator

from dva_sim.kernel import resources
from dva_sim.kernel.config import Config, validate
from dva_sim.kernel.yaml_files import Document, load_yaml
from dva_sim.simulation.scenario.parts import SiteConfig

FOLDER: Final = "agents/ros"
DEFAULT: Final = "differential"

Positive = Annotated[float, Field(gt=0)]
_NAME = re.compile(r"/?[A-Za-z][A-Za-z0-9_]*(/[A-Za-z][A-Za-z0-9_]*)*")


def _checked(name: str | None) -> str | None:
    if name is not None and not _NAME.fullmatch(name):
        raise ValueError("should be a ROS name, as in odom or /robot/odom")
    return name


class RosTopics(Config):
    """Topics, below the namespace unless they begin with a slash; null: not used.

    Attributes:
        odometry: nav_msgs/Odometry; null: the pose comes from `tf`.
        tf: tf2_msgs/TFMessage, read if `odometry` is null.
        battery: sensor_msgs/BatteryState.
        picture: sensor_msgs/CompressedImage, as JPEG.
        scan: sensor_msgs/LaserScan.
        command: Velocity commands, published.
    """

    odometry: str | None = "odom"
    tf: str = "/tf"
    battery: str | None = "battery_state"
    picture: str | None = "image_raw/compressed"
    scan: str | None = "scan"
    command: str = "cmd_vel"

    @field_validator("*")
    @classmethod
    def _is_a_name(cls, name: str | None) -> str | None:
        return _checked(name)


class RosFrames(Config):
    """Coordinate frames that messages must use.

    Attributes:
        odometry: `header.frame_id` of odometry, or the parent in `tf`.
        base: `child_frame_id`, the robot itself: x ahead, y to the left.
    """

    odometry: str = "odom"
    base: str = "base_link"


class RosUnits(Config):
    """Units of the robot's messages; REP 103 prescribes metres and radians.

    Attributes:
        length: Unit of lengths and speeds.
        angle: Unit of turn rates and of the angles of scans.
        charge: Unit of `percentage` of BatteryState, whose definition says 0 to 1.
    """

    length: Literal["m", "mm"] = "m"
    angle: Literal["rad", "deg"] = "rad"
    charge: Literal["share", "percent"] = "share"

    @property
    def metres(self) -> float:
        """One unit of length [m]."""
        return 1.0 if self.length == "m" else 0.001

    @property
    def radians(self) -> float:
        """One unit of angle [rad]."""
        return 1.0 if self.angle == "rad" else math.pi / 180.0


class RosOrigin(Config):
    """Pose of the odometry's frame on the site: x east, y north, counter-clockwise from east."""

    x_m: float = 0.0
    y_m: float = 0.0
    heading_deg: float = 0.0


class RosLimits(Config):
    """Limits of a robot's commands, and the signs that it has stopped.

    Attributes:
        max_speed_mps: Maximum forward speed; commands are clamped to it.
        max_turn_rate_rad_s: Maximum turn rate; commands are clamped to it.
        max_deceleration_mps2: Deceleration with which it stops.
        watchdog_s: Maximum time that a command is in force after its arrival.
        max_age_s: Maximum time that it is in force after the newest tick its sender had seen.
        odometry_within_s: Maximum age of odometry; beyond it the robot is stopped.
        picture_within_s: Maximum age of the newest picture; beyond it none is shown.
        stands_within_s: Time within which it must stand after a stop command.
    """

    max_speed_mps: Positive = 0.5
    max_turn_rate_rad_s: Positive = 0.5235987755982988
    max_deceleration_mps2: Positive = 1.0
    watchdog_s: Annotated[float, Field(gt=0, le=10)] = 1.0
    max_age_s: Annotated[float, Field(gt=0, le=30)] = 3.0
    odometry_within_s: Annotated[float, Field(gt=0, le=10)] = 0.5
    picture_within_s: Annotated[float, Field(gt=0, le=60)] = 2.0
    stands_within_s: Annotated[float, Field(gt=0, le=30)] = 2.0


class RosProfile(Config):
    """A robot of ROS, behind a rosbridge server.

    Attributes:
        ros: Version of ROS, which determines the spelling of types and times.
        command: Type of the velocity commands.
        command_hz: Rate at which a command in force is repeated.
        enable: Service (std_srvs/Trigger) that is called until it succeeds before the robot can be
            driven, for example to switch on motors; null: none.
        site: Site of the DVA; positions are in its frame.
        origin: Origin of the odometry on that site.
        radius_m: Radius of the smallest circle around the robot.
        camera_deg: Angle of view of the camera.
        frame_hz: Rate at which observations are published.
        largest_picture_bytes: Larger pictures are dropped.
    """

    description: str = ""
    ros: Literal[1, 2] = 2
    topics: RosTopics = Field(default_factory=RosTopics)
    command: Literal["Twist", "TwistStamped"] = "Twist"
    command_hz: Annotated[float, Field(ge=2, le=50)] = 10.0
    enable: str | None = None
    frames: RosFrames = Field(default_factory=RosFrames)
    units: RosUnits = Field(default_factory=RosUnits)
    site: SiteConfig = Field(default_factory=SiteConfig)
    origin: RosOrigin = Field(default_factory=RosOrigin)
    limits: RosLimits = Field(default_factory=RosLimits)
    radius_m: Positive = 0.30
    camera_deg: Annotated[float, Field(gt=0, le=360)] = 60.0
    frame_hz: Annotated[float, Field(gt=0, le=30)] = 10.0
    largest_picture_bytes: Annotated[int, Field(ge=1000, le=10_000_000)] = 1_000_000

    @field_validator("enable")
    @classmethod
    def _enable_is_a_name(cls, name: str | None) -> str | None:
        return _checked(name)

    @model_validator(mode="after")
    def _command_outlives_its_period(self) -> RosProfile:
        if self.limits.watchdog_s < 1.0 / self.command_hz:
            raise ValueError("limits.watchdog_s should be at least one period of command_hz")
        return self

    def type_name(self, package: str, name: str) -> str:
        """Return the name of a message type in this version of ROS."""
        return f"{package}/{name}" if self.ros == 1 else f"{package}/msg/{name}"

    def topic(self, namespace: str, name: str) -> str:
        """Return the full name of a topic of this robot."""
        return name if name.startswith("/") else f"/{namespace.strip('/')}/{name}"


def load_ros_profile(name: str) -> RosProfile:
    """Return the profile of a name or path.

    Raises:
        ConfigError: not found, or not valid.
    """
    return read_ros_profile(load_yaml(resources.find(name, FOLDER)))


def read_ros_profile(document: Document) -> RosProfile:
    """Return the profile in a file.

    Raises:
        ConfigError: it is not valid.
    """
    return validate(RosProfile, document.data, document.error)
