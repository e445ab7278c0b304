"""What kinds of robots there are: their profiles, as users write them."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from dva_sim.config import Config
from dva_sim.worlds.drives import DriveSpec

Positive = Annotated[float, Field(gt=0)]


class RobotProfile(Config):
    """Body and motors of a kind of robot."""

    description: str = ""
    mass_kg: Positive = 60.0
    radius_m: Positive = 0.30
    max_speed_mps: Positive = 0.5
    max_turn_rate_rad_s: Positive = 0.5235987755982988
    max_acceleration_mps2: Positive = 0.5
    max_deceleration_mps2: Positive = 1.0
    max_turn_acceleration_rad_s2: Positive = 1.5
    motor_time_constant_s: Positive = 0.15

    def drive_spec(self) -> DriveSpec:
        """The same for the physics."""
        return DriveSpec(
            mass=self.mass_kg,
            radius=self.radius_m,
            max_speed=self.max_speed_mps,
            max_turn_rate=self.max_turn_rate_rad_s,
            max_acceleration=self.max_acceleration_mps2,
            max_deceleration=self.max_deceleration_mps2,
            max_turn_acceleration=self.max_turn_acceleration_rad_s2,
            motor_time_constant=self.motor_time_constant_s,
        )
