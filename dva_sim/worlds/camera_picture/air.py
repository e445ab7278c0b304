"""What fire, smoke and water do to a picture."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dva_sim.worlds.hazards import Raster

Floats = NDArray[np.float32]

SMOKE = np.array([112, 110, 108], dtype=np.float32)  # lit by lamps, assumed
GAIN = np.array([0.75, 0.12, -0.4], dtype=np.float32)  # of red, green, blue by firelight; assumed
GLOW_REACH = 1.6  # half of the firelight is left there [m], assumed
SAMPLES = 64  # of the air along each ray
REACH = 32.0  # beyond this the air is taken to be as it is there [m]
WET = 0.003  # from this depth on a floor mirrors [m]
WATER = np.array([92, 128, 160], dtype=np.float32)


class Rays(NamedTuple):
    """Where each pixel of a picture looks.

    Attributes:
        x: East of the lens, per metre ahead `(w,)`.
        y: North of it.
        length: Length of a ray per metre ahead `(w,)`.
        origin: Of the lens [m].
    """

    x: Floats
    y: Floats
    length: Floats
    origin: tuple[float, float]


def look_up(raster: Raster, x: Floats, y: Floats) -> Floats:
    """Values at places [m]; 0 outside."""
    values = np.asarray(raster.values, dtype=np.float32)
    xmin, xmax, ymin, ymax = raster.extent
    rows, columns = values.shape
    column = np.floor((x - xmin) * (columns / (xmax - xmin))).astype(np.intp)
    row = np.floor((y - ymin) * (rows / (ymax - ymin))).astype(np.intp)
    inside = (column >= 0) & (column < columns) & (row >= 0) & (row < rows)
    index = np.where(inside, row * columns + column, 0)
    return np.where(inside, values.ravel().take(index), np.float32(0))


def add_smoke(scene: Floats, depth: Floats, rays: Rays, smoke: Raster) -> None:
    """Let smoke hide what is behind it: exp(-K d) of its contrast is left after d metres.

    Args:
        scene: Red, green, blue `(3, h, w)`, changed in place.
        depth: Of each pixel, along the axis of the lens `(h, w)` [m].
        rays: Where the columns look.
        smoke: Extinction coefficient K [1/m].
    """
    step = REACH / SAMPLES
    ahead = (np.arange(SAMPLES, dtype=np.float32)[:, None] + 0.5) * step
    extinction = look_up(smoke, rays.origin[0] + ahead * rays.x, rays.origin[1] + ahead * rays.y)
    extinction *= rays.length
    if not extinction.any():
        return
    before = np.cumsum(extinction, axis=0) * step - extinction * step
    sample = depth * np.float32(1 / step)
    number = np.minimum(sample.astype(np.int32), SAMPLES - 1)
    sample -= number
    number *= depth.shape[1]
    number += np.arange(depth.shape[1], dtype=np.int32)
    thickness = extinction.take(number)
    thickness *= sample * np.float32(step)
    thickness += before.take(number)
    left = np.exp(-thickness)
    for plane, colour in zip(scene, SMOKE, strict=True):
        plane -= colour
        plane *= left
        plane += colour


def add_firelight(scene: Floats, gap2: Floats, lit: Any, strength: float) -> None:
    """Warm light of a fire on what is around it.

    Args:
        scene: Red, green, blue `(3, h, w)`, changed in place.
        gap2: Squared distance of each pixel's place from the fire `(h, w)` [m^2].
        lit: Which pixels lie in the room of the fire `(h, w)`.
        strength: 0 to 1.
    """
    light = np.float32(strength) / (np.float32(1.0) + gap2 * np.float32(1.0 / GLOW_REACH**2))
    light *= lit
    for plane, gain in zip(scene, GAIN, strict=True):
        plane *= 1.0 + gain * light


def add_water(scene: Floats, water: Floats, base: Floats, grazing: Floats, time: float) -> None:
    """Let wet floor mirror what stands behind it.

    A level mirror at the foot of an upright wall shows it upside down in its own column.

    Args:
        scene: Red, green, blue `(3, h, w)`, changed in place.
        water: Depth of the water at each pixel that shows floor, else 0 `(h, w)` [m].
        base: Row where the wall of each column stands on the floor `(w,)`.
        grazing: Share that a row's water mirrors, 0 to 1 `(h,)`.
        time: Moves the ripples [s].
    """
    wet = np.flatnonzero(water > WET)
    if not len(wet):
        return
    rows, columns = np.divmod(wet, scene.shape[2])
    ripple = 1.6 * np.sin(0.55 * rows + 0.03 * columns + 4.0 * time)
    mirrored = np.round(2 * base[columns] - rows + ripple).astype(np.intp)
    np.clip(mirrored, 0, scene.shape[1] - 1, out=mirrored)
    mirrored *= scene.shape[2]
    mirrored += columns
    share = grazing[rows]
    tint = 0.55 * (1.0 - np.exp(-12.0 * water.take(wet)))
    for plane, colour in zip(scene, WATER, strict=True):
        flat = plane.reshape(-1)
        below = flat[wet]
        below += tint * (colour - below)
        below += share * (0.92 * flat[mirrored] - below)
        flat[wet] = below
