"""A phone's profile: the properties of phone, grip and app that a study can change."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from dva_sim.agents.habits import PhoneHabits
from dva_sim.agents.tilt.accelerometer import GRAVITY, Triple
from dva_sim.kernel.config import Key


class PhoneProfile(PhoneHabits):
    """A phone, how it is held, and how its app reads, filters, maps and sends.

    Assumptions about these are in `PhoneHabits`.

    Attributes:
        accelerometer: Name of a part, or a file with one.
        sample_rate_hz: Samples per second that the app gets.
        reference_mps2: x, y, z of the pose that means nothing: speed zero, straight on.
        filter: Name, or a class in a file, `mine.py:Mine`.
        filter_options: Options of the filter, such as `{window: 9}` of the median.
        mapping: Name, or a class in a file.
        mapping_options: Options of the mapping, such as `{gain: 2}`.
        send: `on_change` sends what differs from the last one sent when 20 samples have come or
            `max_delay_s` has passed; `keep_alive` sends at the wanted rate always.
        max_delay_s: Longest time between two looks at the filter (`on_change`), and between two
            values of a filter that works in batches.
        limits: Stage at which level and turn are limited: in the reading of each sample
            (`before_filter`, as figure 5.7 of the document has it), or in the command alone
            (`after_mapping`).
        values_at: Time at which a value of an incomplete batch is taken: at the first `sample`
            after `max_delay_s` (as figure 5.8 has it), or at the `delay` itself.
        while_open: Fate of samples while a request is open: the app continues to `take` them; or it
            sends from within the call that takes a sample (figure 5.8), so that the system has to
            `drop` or to `queue` them until the reply has come.
        ideal: True if the desired command takes effect at once: a reference, not a phone.
    """

    description: str = ""
    accelerometer: str = "mpu6050"
    sample_rate_hz: Annotated[float, Field(gt=0, le=1000)] = 34.0
    reference_mps2: Triple = (0.0, 0.0, GRAVITY)
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
    limits: Annotated[
        Literal["before_filter", "after_mapping"], Key("limits of the reading", stated=False)
    ] = "after_mapping"
    values_at: Annotated[Literal["sample", "delay"], Key("time of values", stated=False)] = "delay"
    while_open: Annotated[
        Literal["take", "drop", "queue"], Key("samples during a request", stated=False)
    ] = "take"
    ideal: bool = False

    @model_validator(mode="after")
    def _reference_is_gravity(self) -> PhoneProfile:
        size = sum(part * part for part in self.reference_mps2) ** 0.5
        if not 0.8 * GRAVITY < size < 1.2 * GRAVITY:
            raise ValueError(f"reference_mps2 should be about {GRAVITY:g} m/s^2 long, not {size:g}")
        if self.reference_mps2[2] <= 0.0:
            raise ValueError("reference_mps2 should have z above 0: the screen looks up")
        return self
