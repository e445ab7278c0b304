"""What a phone's page says, read with suspicion: samples and calibrations, or nothing at all.

Pure, and the same whoever has read the message before: what makes no sense is no sample, and never
an error.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, Final, NamedTuple

from dva_sim.agents.tilt import known_filters, known_mappings
from dva_sim.agents.tilt.accelerometer import GRAVITY, Triple
from dva_sim.agents.tilt.device_axes import ORIENTATIONS
from dva_sim.kernel.errors import ConfigError

MOST_SAMPLES: Final = 64  # of a message
MOST_MPS2: Final = 400.0  # no part of a phone measures more [m/s^2]
MOST_MS: Final = 1e13  # of a phone's clock [ms]
PIPELINES: Final = ("default", "dissertation")
STEPS: Final = (0.001, 100.0)  # [m/s^2]
DELAYS: Final = (0.02, 5.0)  # [s]
FLAT: Final[Triple] = (0.0, 0.0, GRAVITY)  # what a phone that lies flat measures


class Samples(NamedTuple):
    """Samples of one message.

    Attributes:
        first: Which one the first is, of all that the page has taken.
        at: When each was taken, by the phone, rising [s].
        xyz: What each measured, in the phone's axes [m/s^2].
        hand: Whether the person holds on.
        orientation: Of the screen [deg].
    """

    first: int
    at: list[float]
    xyz: list[Triple]
    hand: bool
    orientation: int


@dataclass(frozen=True)
class PhoneSettings:
    """How a person has calibrated a phone.

    Attributes:
        reference: What it measures in the pose that means nothing, in its own axes [m/s^2].
        changes: Of the pipeline's profile.
        pipeline: Name of that profile.
        filter: As asked for; None: the pipeline's own.
        calibrated: Whether somebody has.
        ios: Whether the signs are those of iOS.
        keep: Whether the person agrees that the motion is written down.
    """

    reference: Triple = FLAT
    changes: dict[str, Any] = field(default_factory=dict)
    pipeline: str = PIPELINES[0]
    filter: str | None = None
    calibrated: bool = False
    ios: bool = False
    keep: bool = False


def samples_of(line: dict[str, Any]) -> Samples | None:
    """The samples of a message; None if it makes no sense."""
    first, at, xyz = line.get("n"), line.get("at"), line.get("xyz")
    if not (isinstance(at, list) and isinstance(xyz, list) and 0 < len(at) <= MOST_SAMPLES):
        return None
    if len(at) != len(xyz) or not isinstance(first, int) or not 0 <= first <= 2**53:
        return None
    triples = [_triple(one) for one in xyz]
    whole = [one for one in triples if one is not None]
    if len(whole) != len(at) or not all(_is_within(one, 0.0, MOST_MS) for one in at):
        return None
    if any(later <= earlier for earlier, later in pairwise(at)):
        return None
    orientation = line.get("orientation")
    if orientation not in ORIENTATIONS:
        return None
    times = [float(one) / 1000.0 for one in at]
    return Samples(first, times, whole, line.get("hand") is True, int(orientation))


def settings_of(line: dict[str, Any]) -> PhoneSettings:
    """What a calibration says.

    Raises:
        ConfigError: it makes no sense; says what would.
    """
    reference = line.get("reference_mps2")
    measured = FLAT if reference is None else _triple(reference)
    if measured is None:
        raise ConfigError(f"reference_mps2 should be x, y, z, each within {MOST_MPS2:g} m/s^2")
    ios = line.get("ios") is True
    if reference is None and ios:
        measured = (0.0, 0.0, -GRAVITY)
    changes = {
        "speed_step_mps2": _number(line, "speed_step_mps2", STEPS),
        "turn_step_mps2": _number(line, "turn_step_mps2", STEPS),
        "max_delay_s": _number(line, "max_delay_s", DELAYS),
        "mapping": _one_of(line, "mapping", known_mappings()),
    }
    chosen = line.get("filter")
    if chosen is not None:
        changes["filter"] = _one_of(line, "filter", known_filters())
    pipeline = _one_of(line, "pipeline", PIPELINES)
    keep = line.get("keep") is True
    return PhoneSettings(
        reference=measured,
        changes=changes,
        pipeline=pipeline,
        filter=chosen,
        calibrated=True,
        ios=ios,
        keep=keep,
    )


def _number(line: dict[str, Any], key: str, limits: tuple[float, float]) -> float:
    value = line.get(key)
    if not _is_within(value, *limits):
        raise ConfigError(f"{key} should be a number from {limits[0]:g} to {limits[1]:g}")
    return float(value)  # type: ignore[arg-type]


def _one_of(line: dict[str, Any], key: str, names: Any) -> str:
    value = line.get(key)
    if not isinstance(value, str) or value not in names:
        raise ConfigError(f"{key} should be one of {', '.join(sorted(names))}")
    return value


def _triple(value: Any) -> Triple | None:
    if not isinstance(value, list | tuple) or len(value) != 3:
        return None
    if not all(_is_within(one, -MOST_MPS2, MOST_MPS2) for one in value):
        return None
    x, y, z = value
    return float(x), float(y), float(z)


def _is_within(value: Any, least: float, most: float) -> bool:
    """Whether it is a number between two; what is no number (NaN) is not."""
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return number and least <= value <= most
