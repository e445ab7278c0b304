"""The app's calibration: the conversion of tilt to commands, and their rate."""

from __future__ import annotations

import math
from typing import Final

from dva_sim.agents.tilt.accelerometer import GRAVITY, Triple

LEVELS: Final = 10.0  # source: the document: speed levels; one is SPEED_PER_LEVEL
SPEED_PER_LEVEL: Final = 0.05  # source: the document: [m/s]
MAX_TURN_DEG: Final = 30.0  # source: the document: maximum turn rate in either direction [deg/s]

Reading = tuple[float, float]  # speed level, turn [deg/s]
SIDE_KNOWN: Final = 3.0  # design: a phone calibrated so upright has no side up [m/s^2]
NEUTRAL: Final[Reading] = (0.0, 0.0)  # design: reading of a phone at rest: stand


class Calibration:
    """From accelerations to a reading: a speed level, and a turn rate in degrees per second.

    The reading counts steps of acceleration away from the reference pose, forwards and to the
    left. It is not limited here: limits come after the mapping, and a median of what is limited
    later is the limited median.

    Args:
        reference: x, y, z at rest in the pose that means nothing [m/s^2].
        speed_step: Acceleration along x for one level of speed [m/s^2].
        turn_step: Acceleration along y for one degree per second [m/s^2].
        max_delay: Maximum time between two reads of the filter [s].
    """

    def __init__(
        self,
        reference: Triple = (0.0, 0.0, GRAVITY),
        *,
        speed_step: float = 0.35,
        turn_step: float = 0.12,
        max_delay: float = 0.5,
    ) -> None:
        self.reference = reference
        self.max_delay = max_delay
        self._x, self._y, z = reference
        self._z = z if abs(z) > SIDE_KNOWN else 0.0
        self._speed_step = speed_step
        self._turn_step = turn_step

    def reading(self, ax: float, ay: float, az: float) -> Reading:
        """Return level and turn [deg/s] of a sample; z only shows which side is up."""
        if az * self._z < 0.0:
            return NEUTRAL  # upside down relative to the reference: not a command
        return (ax - self._x) / self._speed_step, (ay - self._y) / self._turn_step

    def pose(self, level: float, turn: float) -> tuple[float, float]:
        """Return the angles that read so on a perfect part.

        Pitch, roll [rad]; the nearest there are.
        """
        along = _share(self._x + level * self._speed_step, GRAVITY)
        pitch = math.asin(along)
        flat = GRAVITY * math.sqrt(1.0 - along * along)
        across = _share(self._y + turn * self._turn_step, flat) if flat > 0.0 else 0.0
        return pitch, math.asin(across)


def _share(part: float, whole: float) -> float:
    share = part / whole
    return -1.0 if share < -1.0 else 1.0 if share > 1.0 else share
