"""Effects of fire, smoke and water on a picture."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dva_sim.worlds.hazards import Raster

Floats = NDArray[np.float32]

SMOKE = np.array([112, 110, 108], dtype=np.float32)  # colour of smoke under lamps; assumed
# Gain of red, green and blue in firelight; assumed.
GAIN = np.array([0.75, 0.12, -0.4], dtype=np.float32)
GLOW_REACH = 1.6  # distance at which half of the firelight is left [m]; assumed
SAMPLES = 64  # samples of the air along each ray
REACH = 32.0  # distance beyond which the air counts as uniform [m]
MIRRORING_DEPTH_M = 0.003  # depth of water from which a floor mirrors [m]
WATER = np.array([92, 128, 160], dtype=np.float32)


class Rays(NamedTuple):
    """Direction of each pixel of a picture.

    Attributes:
        x: East of the lens, per metre ahead `(w,)`.
        y: North of it.
        length: Length of a ray per metre ahead `(w,)`.
        origin: Position of the lens [m].
    """

    x: Floats
    y: Floats
    length: Floats
    origin: tuple[float, float]


def look_up(x: Floats, y: Floats, *rasters: Raster) -> list[Floats]:
    """Return values of rasters on the same grid at places [m]; 0 outside."""
    xmin, xmax, ymin, ymax = rasters[0].extent
    rows, columns = rasters[0].values.shape
    # A rim of zeros around the grid takes what lies outside.
    column = (x - np.float32(xmin)) * np.float32(columns / (xmax - xmin)) + np.float32(1)
    row = (y - np.float32(ymin)) * np.float32(rows / (ymax - ymin)) + np.float32(1)
    np.clip(column, 0, columns + 1, out=column)
    np.clip(row, 0, rows + 1, out=row)
    index = row.astype(np.int32)
    index *= columns + 2
    index += column.astype(np.int32)
    return [np.pad(r.values.astype(np.float32), 1).take(index) for r in rasters]


class SmokeView(NamedTuple):
    """Smoke on a site, both on the same grid; in a building it hangs under the ceilings.

    Attributes:
        mean: Extinction coefficient K, the mean from floor to ceiling [1/m].
        layer: Extinction within the layer, which is denser the thinner it is [1/m].
    """

    mean: Raster
    layer: Raster


def add_smoke(
    scene: Floats, depth: Floats, rays: Rays, fall: Floats, smoke: SmokeView, heights: Any
) -> None:
    """Reduce contrast behind smoke: exp(-K d) of it is left after d metres of smoke.

    A column takes the layer to hang equally low everywhere along its ray. Two columns share the
    air that they look through, two rows what is left of the contrast.

    Args:
        scene: Red, green, blue `(3, h, w)`, changed in place.
        depth: Depth of each pixel, along the axis of the lens `(h, w)` [m].
        rays: Directions of the columns.
        fall: Slope of each row below the axis, per metre ahead `(h,)`.
        heights: Heights of the lens and of the ceiling [m].
    """
    whole = depth
    depth = depth[::2]
    fall = fall[::2]
    step = REACH / SAMPLES
    ahead = (np.arange(SAMPLES, dtype=np.float32)[:, None] + 0.5) * step
    x, y = (values[::2] for values in (rays.x, rays.y))
    extinction, mean = look_up(
        rays.origin[0] + ahead * x, rays.origin[1] + ahead * y, smoke.layer, smoke.mean
    )
    if not extinction.any():
        return
    share = mean.sum(axis=0) / np.maximum(extinction.sum(axis=0), 1e-6)
    extinction *= rays.length[::2] * np.float32(step)
    before = np.cumsum(extinction, axis=0) - extinction
    sample = depth * np.float32(1 / step)
    number = np.minimum(sample.astype(np.int32), SAMPLES - 1)
    sample -= number
    number *= extinction.shape[1]
    number += np.arange(depth.shape[1], dtype=np.int32) // 2
    thickness = extinction.take(number)
    thickness *= sample
    thickness += before.take(number)
    thickness *= np.sqrt(1 + fall * fall)[:, None]
    if share.min() < 1:
        share = np.repeat(share, 2)[: depth.shape[1]]
        thickness *= _in_the_layer(depth, fall, heights, share)
    np.negative(thickness, out=thickness)
    left = np.repeat(np.exp(thickness, out=thickness), 2, axis=0)[: len(whole)]
    for plane, colour in zip(scene, SMOKE, strict=True):
        plane -= colour
        plane *= left
        plane += colour


def _in_the_layer(depth: Floats, fall: Floats, heights: Any, share: Floats) -> Floats:
    """Return the share of each pixel's ray above the lower face of the layer `(h, w)`."""
    eye, ceiling = heights
    bottom = ceiling * (1 - np.minimum(share, 1))
    here = np.float32(eye) - bottom
    there = depth * -fall[:, None]
    there += here
    whole = np.abs(there)
    whole += np.abs(here) + np.float32(1e-4)
    np.maximum(there, 0, out=there)
    there += np.maximum(here, 0)
    there /= whole
    return there


def add_firelight(scene: Floats, gap2: Floats, lit: Any, strength: float) -> None:
    """Warm light of a fire on its surroundings.

    Args:
        scene: Red, green, blue `(3, h, w)`, changed in place.
        gap2: Squared distance of every second row's places from the fire `(h / 2, w)` [m^2].
        lit: True for pixels in the room of the fire `(h / 2, w)`.
        strength: 0 to 1.
    """
    light = np.float32(strength) / (np.float32(1.0) + gap2 * np.float32(1.0 / GLOW_REACH**2))
    light *= lit
    for plane, gain in zip(scene, GAIN, strict=True):
        factor = np.repeat(1 + gain * light, 2, axis=0)
        plane *= factor[: len(plane)]


def add_water(scene: Floats, water: Floats, base: Floats, grazing: Floats, time: float) -> None:
    """Let wet floor mirror the wall and the objects behind it.

    A level mirror at the foot of an upright wall shows it upside down in its own column.

    Args:
        scene: Red, green, blue `(3, h, w)`, changed in place.
        water: Depth of the water at each pixel that shows floor, else 0 `(h, w)` [m].
        base: Row where the wall of each column stands on the floor `(w,)`.
        grazing: Share that a row's water mirrors, 0 to 1 `(h,)`.
        time: Moves the ripples [s].
    """
    wet = np.flatnonzero(water > MIRRORING_DEPTH_M)
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
