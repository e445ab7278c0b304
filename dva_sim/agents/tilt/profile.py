"""A phone's profile: what a study can change of a phone, of how it is held, and of its app."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from dva_sim.agents.tilt.accelerometer import GRAVITY, NonNegative, Positive, Triple
from dva_sim.kernel.config import Config, Key


class PhoneProfile(Config):
    """A phone, how it is held, and how its app reads, filters, maps and sends.

    Attributes:
        accelerometer: Name of a part, or a file with one.
        sample_rate_hz: Samples per second that the app gets.
        sample_jitter: Standard deviation of the time of a sample, as a share of the time between
            two.
        tremor_deg: Of the hand, as apparent tilt, standard deviation.
        max_tilt_deg: Farthest that the hand tilts the phone away from rest.
        max_tilt_speed_deg_s: Fastest that it does.
        reference_mps2: x, y, z of the pose that means nothing: speed zero, straight on.
        reference_error_mps2: How far off that pose was when the owner calibrated, standard
            deviation of x and y; the offset of the part itself is calibrated away.
        speed_step_mps2: Acceleration along the tilt axis for one level of speed.
        turn_step_mps2: Acceleration across it for one degree per second of turn.
        filter: By name, or a class in a file, `mine.py:Mine`.
        filter_options: Of the filter, such as `{window: 9}` of the median.
        mapping: By name, or a class in a file.
        mapping_options: Of the mapping, such as `{gain: 2}`.
        send: `on_change` sends what differs from the last one sent when 20 samples have come or
            `max_delay_s` has passed; `keep_alive` sends at the wanted rate always.
        max_delay_s: Longest time between two looks at the filter (`on_change`), and between two
            values of a filter that works in batches.
        ideal: What the person wants becomes the command at once: a reference, not a phone.
    """

    description: str = ""
    accelerometer: str = "mpu6050"
    sample_rate_hz: Annotated[float, Field(gt=0, le=1000)] = 34.0
    sample_jitter: Annotated[float, Field(ge=0, le=0.3)] = 0.1
    tremor_deg: NonNegative = 0.25
    max_tilt_deg: Annotated[float, Field(gt=0, le=80)] = 45.0
    max_tilt_speed_deg_s: Positive = 200.0
    reference_mps2: Triple = (0.0, 0.0, GRAVITY)
    reference_error_mps2: NonNegative = 0.08
    speed_step_mps2: Positive = 0.35
    turn_step_mps2: Positive = 0.12
    filter: Annotated[str, Key("filter")] = "median"
    filter_options: Annotated[
        dict[str, Any],
        Key(inner={"time_constant_s": Key("time constant of the filter", stated=False)}),
    ] = Field(default_factory=dict)
    mapping: Annotated[str, Key("mapping")] = "absolute"
    mapping_options: Annotated[dict[str, Any], Key(inner={"gain": Key("gain of the phone")})] = (
        Field(default_factory=dict)
    )
    send: Annotated[Literal["on_change", "keep_alive"], Key("sending")] = "keep_alive"
    max_delay_s: Annotated[
        float, Field(gt=0, le=10), Key("longest time between two values of the phone", stated=False)
    ] = 0.5
    ideal: bool = False

    @model_validator(mode="after")
    def _reference_is_gravity(self) -> PhoneProfile:
        size = sum(part * part for part in self.reference_mps2) ** 0.5
        if not 0.8 * GRAVITY < size < 1.2 * GRAVITY:
            raise ValueError(f"reference_mps2 should be about {GRAVITY:g} m/s^2 long, not {size:g}")
        if self.reference_mps2[2] <= 0.0:
            raise ValueError("reference_mps2 should have z above 0: the screen looks up")
        return self
