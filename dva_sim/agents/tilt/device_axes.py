"""From the axes of a phone's browser to those of the pipeline: the one place where signs turn.

A browser (`devicemotion`, `accelerationIncludingGravity`) tells x to the right of the phone, y to
its top, z out of its screen, however it is held, and does not turn them with the screen. Android
reports what the part measures: +9.8 along z for a phone that lies flat. iOS reports the opposite of
all three. The pipeline has x = g sin(pitch), which grows when the far edge of the screen goes down,
and y = g cos(pitch) sin(roll), which grows when its left edge does; z as Android.

References:
    W3C Device Orientation and Motion; W3C Screen Orientation (`angle`: by how much what is shown is
    turned clockwise against the phone's natural orientation, as the phone is turned the other way).
"""

from __future__ import annotations

from typing import Final, Literal

from dva_sim.agents.tilt.accelerometer import Triple

Orientation = Literal[0, 90, 180, 270]

# Where the screen's right and its top lie along the phone's x and y.
_SCREEN: Final[dict[int, tuple[float, float, float, float]]] = {  # source: W3C Device Orientation
    0: (1.0, 0.0, 0.0, 1.0),
    90: (0.0, -1.0, 1.0, 0.0),
    180: (-1.0, 0.0, 0.0, -1.0),
    270: (0.0, 1.0, -1.0, 0.0),
}
ORIENTATIONS: Final = tuple(_SCREEN)


def to_tilt_axes(measured: Triple, orientation: int = 0, ios: bool = False) -> Triple:
    """Convert a browser's reading to the pipeline's axes: x forwards, y to the left, z up.

    Args:
        measured: x, y, z in the axes of the phone [m/s^2].
        orientation: `screen.orientation.angle`, one of `ORIENTATIONS` [deg].
        ios: True for the signs of iOS.
    """
    x, y, z = measured
    if ios:
        x = -x
        y = -y
        z = -z
    right_x, right_y, top_x, top_y = _SCREEN[orientation]
    return -(top_x * x + top_y * y), right_x * x + right_y * y, z


def to_device_axes(tilt: Triple, orientation: int = 0, ios: bool = False) -> Triple:
    """Return the inverse of `to_tilt_axes`: the values that a browser reports."""
    forwards, left, z = tilt
    right_x, right_y, top_x, top_y = _SCREEN[orientation]
    x = right_x * left - top_x * forwards
    y = right_y * left - top_y * forwards
    return (-x, -y, -z) if ios else (x, y, z)
