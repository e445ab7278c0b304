"""Hazards of a recording whose class is the user's own: shown as they were, never simulated again.

A recording loads no code. What such a hazard looked like is in the file: its sizes once a second,
and what lay over the floor every two seconds.
"""

from __future__ import annotations

import base64
from bisect import bisect_right
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from dva_sim.worlds.hazards import QUANTITIES, Hazard, Raster, Surroundings
from dva_sim.worlds.layout import Site

Said = Sequence[tuple[float, Mapping[str, Any]]]  # messages of a topic, with their times [s]


class RecordedHazard(Hazard):
    """A hazard as it was.

    Attributes:
        times: When it was told of [s], in order.
        sizes: Its radius [m], its danger radius [m] and its severity at those times.
    """

    reported_as = "fire"  # nobody asks: what was reported is in the recording

    times: tuple[float, ...]
    sizes: tuple[tuple[float, float, float], ...]

    def radius(self, time: float) -> float:
        """See `Hazard`."""
        return self._size(time)[0]

    def danger_radius(self, time: float) -> float:
        """See `Hazard`."""
        return self._size(time)[1]

    def severity(self, time: float) -> float:
        """See `Hazard`."""
        return self._size(time)[2]

    def _size(self, time: float) -> tuple[float, float, float]:
        """As last told of."""
        index = bisect_right(self.times, time)
        return self.sizes[index - 1] if index else (0.0, 0.0, 0.0)


def recorded_hazard(number: int, entry: Mapping[str, Any], said: Said) -> Hazard:
    """The stand-in for a hazard.

    Args:
        number: Of its incident, from 1.
        entry: What the file says of the incident.
        said: The messages about all hazards.
    """

    class AsRecorded(RecordedHazard):
        title: ClassVar[str] = entry["described"]["title"]
        shows: ClassVar[tuple[str, ...]] = tuple(entry["described"]["shows"])
        colour: ClassVar[str] = entry["described"]["colour"]
        mark: ClassVar[str] = entry["described"]["mark"]

    own = [(time, state) for time, state in said if state["number"] == number]
    keys = "radius_m", "danger_radius_m", "severity"
    position, start = entry["hazard"]["position"], entry["hazard"]["start"]
    return AsRecorded(
        position=tuple(position),
        start=start,
        times=tuple(time for time, _ in own),
        sizes=tuple(tuple(state[key] for key in keys) for _, state in own),
    )


class RecordedSurroundings(Surroundings):
    """What lay over the floor, of all hazards together, as last recorded; nothing is simulated.

    Args:
        site: Where.
        hazards: What happened.
        grids: What was recorded of each quantity.
    """

    def __init__(self, site: Site, hazards: Sequence[Hazard], grids: Mapping[str, Said]) -> None:
        super().__init__(site, hazards)
        self._grids = grids

    def contain(self, number: int, time: float) -> None:
        """See `Surroundings`: it was, and the file shows what came of it."""

    def raster(self, what: str, time: float, cell: float = 0.25) -> Raster:
        """See `Surroundings`; cells are as wide as they were recorded."""
        what = "smoke" if what == "layer" else what
        west, south, east, north = self._site.extent
        said = self._grids.get(what, ())
        index = bisect_right([when for when, _ in said], time)
        if not index:
            return Raster(np.zeros((1, 1)), (west, east, south, north), QUANTITIES[what].unit)
        content = said[index - 1][1]
        cell, place = content["cell_size"]["x"], content["pose"]["position"]
        part = np.frombuffer(base64.b64decode(content["data"]), "<f4")
        part = part.reshape(-1, content["column_count"])
        low, left = round((place["y"] - south) / cell), round((place["x"] - west) / cell)
        rows = max(round((north - south) / cell), low + part.shape[0])
        columns = max(round((east - west) / cell), left + part.shape[1])
        values = np.zeros((rows, columns))
        values[low : low + part.shape[0], left : left + part.shape[1]] = part
        extent = west, west + columns * cell, south, south + rows * cell
        return Raster(values, extent, QUANTITIES[what].unit)
