"""Profiles of robots, as users write them."""

from __future__ import annotations

import math
from typing import Annotated, Any, Final

from pydantic import Field, model_validator

from dva_sim.agents.robot.battery import BatteryProfile
from dva_sim.agents.robot.command_queue import ServiceTime
from dva_sim.agents.robot.sensors import KINDS, SensorConfig
from dva_sim.kernel import resources
from dva_sim.kernel.config import Config, validate
from dva_sim.kernel.read_once import read_once
from dva_sim.kernel.yaml_files import Document, load_yaml
from dva_sim.worlds.drives import MAX_TICK, DriveSpec, load_drive

FOLDER: Final = "agents/robots"

ONE_OF_EACH: Final = tuple(SensorConfig(name=name) for name in KINDS)

Positive = Annotated[float, Field(gt=0)]
Corner = tuple[float, float]


class RobotProfile(Config):
    """Body, motors, computer and battery of a kind of robot.

    Attributes:
        radius_m: Radius of its footprint, or of a circle that encloses its corners.
        corners_m: Corners of a convex footprint, counter-clockwise, x ahead, y to the left, with
            the middle at 0, 0; by default a circle.
        drive: `differential`, `three_way`, or a class of your own as `mine.py:Mine`.
        options: Options of that drive.
        processing_s: Processing time of a message, a number or a law; by default 0.05.
        battery: Left out: power never ends.
        sensors: Sensors on board; by default one of each kind.
    """

    description: str = ""
    mass_kg: Positive = 60.0
    radius_m: Positive = 0.30
    corners_m: Annotated[tuple[Corner, ...], Field(max_length=16)] = ()
    max_speed_mps: Positive = 0.5
    max_turn_rate_rad_s: Positive = 0.5235987755982988
    max_acceleration_mps2: Positive = 0.5
    max_deceleration_mps2: Positive = 1.0
    max_turn_acceleration_rad_s2: Positive = 1.5
    motor_time_constant_s: Positive = 0.15
    drive: str = "differential"
    options: dict[str, Any] = Field(default_factory=dict)
    processing_s: ServiceTime = 0.05
    battery: BatteryProfile | None = None
    sensors: Annotated[tuple[SensorConfig, ...], Field(max_length=16)] = ONE_OF_EACH

    @model_validator(mode="after")
    def _footprint(self) -> RobotProfile:
        if not self.corners_m:
            return self
        if not _convex(self.corners_m):
            raise ValueError("corners_m should go counter-clockwise around 0, 0, without dents")
        farthest = max(math.hypot(*corner) for corner in self.corners_m)
        if farthest > self.radius_m:
            raise ValueError(f"radius_m should hold the corners, which reach {farthest:.3g} m out")
        return self

    @model_validator(mode="after")
    def _no_tunnelling(self) -> RobotProfile:
        most = self._spec().safe_speed(MAX_TICK)
        if self.max_speed_mps > most:
            problem = f"max_speed_mps should be at most {most:.3g} for a body of this size"
            raise ValueError(f"{problem}: faster, it could pass through a wall within a tick")
        return self

    def drive_spec(self) -> DriveSpec:
        """Return the drive's limits for the physics.

        Raises:
            ConfigError: there is no such drive.
        """
        return self._spec(drive=load_drive(self.drive, self.options))

    def _spec(self, **more: Any) -> DriveSpec:
        return DriveSpec(
            mass=self.mass_kg,
            radius=self.radius_m,
            max_speed=self.max_speed_mps,
            max_turn_rate=self.max_turn_rate_rad_s,
            max_acceleration=self.max_acceleration_mps2,
            max_deceleration=self.max_deceleration_mps2,
            max_turn_acceleration=self.max_turn_acceleration_rad_s2,
            motor_time_constant=self.motor_time_constant_s,
            corners=self.corners_m,
            **more,
        )


@read_once(lambda name: [resources.find(name, FOLDER)])
def load_robot(name: str) -> RobotProfile:
    """Return the profile of a name or path.

    Raises:
        ConfigError: the profile does not exist or is not valid.
    """
    return read_robot(load_yaml(resources.find(name, FOLDER)))


def read_robot(document: Document) -> RobotProfile:
    """Return the profile in a file; a drive in a file beside it is found from anywhere.

    Raises:
        ConfigError: it is not valid.
    """
    profile = validate(RobotProfile, document.data, document.error)
    file, _, class_name = profile.drive.rpartition(":")
    beside = document.file.resolve().parent / file
    if class_name and beside.is_file():
        return profile.model_copy(update={"drive": f"{beside}:{class_name}"})
    return profile


def _convex(corners: tuple[Corner, ...]) -> bool:
    """Return True if the corners go once around the origin, always turning left."""
    turned = 0.0
    for number, (bx, by) in enumerate(corners):
        ax, ay = corners[number - 1]
        cx, cy = corners[(number + 1) % len(corners)]
        if (bx - ax) * (cy - by) <= (by - ay) * (cx - bx) or ax * by <= ay * bx:
            return False
        turned += math.atan2(ax * by - ay * bx, ax * bx + ay * by)
    # One turn is 2 pi, about 6.3: two turns, as of a star, would be twice that.
    return len(corners) > 2 and turned < 7.0
