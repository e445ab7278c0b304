"""Messages of a phone's page: samples of its sensor, and its calibration."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple

from dva_sim.agents.tilt import known_filters, known_mappings
from dva_sim.agents.tilt.accelerometer import GRAVITY, Triple
from dva_sim.console.wire.arguments import CalibrationAsked, SampleBatch
from dva_sim.kernel.errors import ConfigError

PIPELINES: Final[Mapping[str, str | None]] = {"default": None, "dissertation": "req-rep"}
"""Pattern of each pipeline's app; None: that of the robot."""
FLAT: Final[Triple] = (0.0, 0.0, GRAVITY)  # what a phone that lies flat measures


class Samples(NamedTuple):
    """Samples of one message.

    Attributes:
        first: Index of the first sample, of all that the page has taken.
        at: Times of the samples, by the phone, rising [s].
        xyz: Measured values in the phone's axes [m/s^2].
        hand: True if the person holds on.
        orientation: Orientation of the screen [deg].
    """

    first: int
    at: list[float]
    xyz: list[Triple]
    hand: bool
    orientation: int


@dataclass(frozen=True)
class PhoneSettings:
    """The calibration of a phone.

    Attributes:
        reference: Reading in the neutral pose, in the phone's own axes [m/s^2].
        changes: Changes of the pipeline's profile.
        pipeline: Name of that profile.
        filter: Requested filter; None: the pipeline's own.
        calibrated: True once somebody has calibrated it.
        ios: True if the signs are those of iOS.
        keep: True if the person agrees that the motion is recorded.
    """

    reference: Triple = FLAT
    changes: dict[str, Any] = field(default_factory=dict)
    pipeline: str = "default"
    filter: str | None = None
    calibrated: bool = False
    ios: bool = False
    keep: bool = False


def samples_of(line: SampleBatch) -> Samples:
    """Return the samples of a message."""
    times = [when / 1000.0 for when in line["at"]]
    whole = [(x, y, z) for x, y, z in line["xyz"]]
    return Samples(line["n"], times, whole, line["hand"], line["orientation"])


def settings_of(line: CalibrationAsked) -> PhoneSettings:
    """Read a calibration.

    Raises:
        ConfigError: there is no such filter or mapping; says which there are.
    """
    reference = line["reference_mps2"]
    ios = line.get("ios", False)
    if reference is not None:
        x, y, z = reference
        measured = x, y, z
    else:
        measured = (0.0, 0.0, -GRAVITY) if ios else FLAT
    changes = {
        "speed_step_mps2": line["speed_step_mps2"],
        "turn_step_mps2": line["turn_step_mps2"],
        "max_delay_s": line["max_delay_s"],
        "mapping": _known("mapping", line["mapping"], known_mappings()),
    }
    chosen = line["filter"]
    if chosen is not None:
        changes["filter"] = _known("filter", chosen, known_filters())
    return PhoneSettings(
        reference=measured,
        changes=changes,
        pipeline=line["pipeline"],
        filter=chosen,
        calibrated=True,
        ios=ios,
        keep=line.get("keep", False),
    )


def _known(key: str, name: str, names: Iterable[str]) -> str:
    if name not in names:
        raise ConfigError(f"{key} should be one of {', '.join(sorted(names))}")
    return name
