"""Water in the rooms of a building: they fill, and doors let it through like weirs.

Each space has one level. What flows through a door follows a broad-crested weir, held back by
the water on the other side (Villemonte); outdoors it is gone. No water is lost on the way.

Left out: waves, slopes, drains, water under shut doors.

References:
    V. T. Chow, Open-Channel Hydraulics, New York 1959: broad-crested weirs.
    J. R. Villemonte, Engineering News-Record 139 (1947) 866: submerged weirs.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dva_sim.worlds.hazards.building import Spaces
from dva_sim.worlds.hazards.flood import SILL, WEIR

Floats = NDArray[np.float64]

EASY = 0.25  # share of the way to the same level that one step may cover


class Filling:
    """Water that comes in one space of a building.

    Args:
        spaces: The building.
        room: Index of the space that it comes in.
        inflow: [m^3/s]
        sill: Height of the thresholds [m].
    """

    def __init__(self, spaces: Spaces, room: int, inflow: float, sill: float = SILL) -> None:
        self._spaces, self._room, self._inflow = spaces, room, inflow
        self._sill = np.where(spaces.top < spaces.ceiling[spaces.a], sill, 0.0)
        areas = np.r_[spaces.area, np.inf]
        a, b = areas[spaces.a], areas[spaces.b]
        self._levels = 1.0 / (1.0 / a + 1.0 / b)  # volume per difference of levels [m^2]

    def dry(self) -> Floats:
        """The water in each space and, last, what has run out [m^3]."""
        return np.zeros(self._spaces.count + 1)

    def step(self, state: Floats, age: float, dt: float) -> Floats:
        """The state `dt` [s] later."""
        new = self.step_without_inflow(state, age, dt)
        new[self._room] += self._inflow * dt
        return new

    def step_without_inflow(self, state: Floats, age: float, dt: float) -> Floats:
        """The same once the water is shut off."""
        spaces = self._spaces
        depth = np.append(state[:-1] / spaces.area, 0.0)
        a, b = depth[spaces.a], depth[spaces.b]
        flow = np.sign(a - b) * over_weir(
            np.maximum(a, b) - self._sill, np.minimum(a, b) - self._sill, spaces.width
        )
        most = EASY * self._levels * np.abs(a - b) / dt
        moved = np.clip(flow, -most, most) * dt
        return np.asarray(
            state
            - np.bincount(spaces.a, moved, len(state))
            + np.bincount(spaces.b, moved, len(state))
        )


def over_weir(above: Floats, below: Floats, width: Floats) -> Floats:
    """Water that flows over a broad crest [m^3/s].

    Args:
        above: Water over the crest on the higher side [m]; none where negative.
        below: On the lower side [m].
        width: Of the crest [m].
    """
    head = np.maximum(above, 0.0)
    drowned = np.clip(below / np.maximum(head, 1e-12), 0.0, 1.0)
    return np.asarray(WEIR * width * head**1.5 * (1.0 - drowned**1.5) ** 0.385)
