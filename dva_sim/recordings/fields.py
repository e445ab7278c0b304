"""Hazards as grids over the floor: smoke, radiant heat, gas and water."""

from __future__ import annotations

import base64
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from dva_sim.recordings import messages
from dva_sim.recordings.messages import FRAME, Message
from dva_sim.simulation import Playback
from dva_sim.worlds.hazards import Raster

FIELDS = {"fire": ("smoke", "heat"), "gas_leak": ("gas",), "flood": ("water",)}
PERIOD_S = 2.0  # between two grids [s]
CELL = 0.5  # [m]
MOST_CELLS = 20_000  # of a grid; on a larger site cells are larger
DIGITS = 11  # of the 23 binary ones of a number: one part in 4000, and half the file


def grids(playback: Playback) -> Iterator[Message]:
    """All fields of the hazards there are, as far as they are not zero."""
    kinds = {i.kind for i in playback.incidents if not i.false_alarm}
    whats = [what for kind in sorted(kinds) for what in FIELDS[kind]]
    west, south, east, north = playback.site.extent
    cell = max(CELL, ((east - west) * (north - south) / MOST_CELLS) ** 0.5)
    starts = [i.start for i in playback.incidents if not i.false_alarm]
    for number in range(int(playback.duration / PERIOD_S) + 1):
        time = number * PERIOD_S
        for what in whats if time > min(starts) else ():
            raster = playback.surroundings.raster(what, time, cell)
            if raster.values.max() > 0:
                yield _grid(what, time, cell, raster)


def _grid(what: str, time: float, cell: float, raster: Raster) -> Message:
    rows, columns = np.nonzero(raster.values > 0)
    low, left = int(rows.min()), int(columns.min())
    part = raster.values[low : rows.max() + 1, left : columns.max() + 1]
    west, _, south, _ = raster.extent
    content = {
        "timestamp": messages.stamp(time),
        "frame_id": FRAME,
        "pose": messages.pose(west + left * cell, south + low * cell),
        "column_count": part.shape[1],
        "cell_size": {"x": round(cell, 6), "y": round(cell, 6)},
        "row_stride": 4 * part.shape[1],
        "cell_stride": 4,
        "fields": [{"name": what, "offset": 0, "type": 7}],
        "data": base64.b64encode(_shortened(part).tobytes()).decode(),
    }
    return Message(time, f"/fields/{what}", "foxglove.Grid", content)


def _shortened(values: NDArray[np.float64]) -> NDArray[np.float32]:
    """As 32-bit numbers whose last digits are zero, which are packed far smaller."""
    bits = np.ascontiguousarray(values, "<f4").view("<u4")
    mask = np.uint32(0xFFFFFFFF << (23 - DIGITS) & 0xFFFFFFFF)
    return (bits & mask).view("<f4")
