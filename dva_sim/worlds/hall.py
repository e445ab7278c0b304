"""A bare hall with walls as one likes: where drives are tried and physics is tested."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from dva_sim.worlds.geo import GeoFrame
from dva_sim.worlds.maps import rasterise
from dva_sim.worlds.site import Site

CAMPUS: Final = GeoFrame(38.6612, -9.2058)  # Monte de Caparica
Segment = tuple[float, float, float, float]


def hall(width: float, depth: float, walls: Sequence[Segment] = ()) -> Site:
    """A hall with a corner at 0, 0, and walls in it [m], thin as all walls are."""
    import shapely

    border = [
        (0, 0, width, 0),
        (width, 0, width, depth),
        (width, depth, 0, depth),
        (0, depth, 0, 0),
    ]
    lines = np.array([*border, *walls], float)
    return Site(
        name="hall",
        frame=CAMPUS,
        walls=lines,
        rooms=(),
        doors=np.empty((0, 4)),
        robot_bases=(),
        guard_posts=(),
        operator_desks=(),
        detectors=(),
        extent=(0.0, 0.0, width, depth),
        grid=rasterise(shapely.box(0, 0, width, depth), lines, 0.1),
    )
