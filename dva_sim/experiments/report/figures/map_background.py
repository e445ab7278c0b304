"""The site from above, as the background of a figure."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from dva_sim.experiments.analysis.run_grid import Floats
from dva_sim.experiments.report.figures.palette import INK
from dva_sim.experiments.report.figures.style import ASIDE, WIDTH
from dva_sim.kernel.errors import DvaSimError
from dva_sim.simulation import scenario as scenes

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from dva_sim.worlds.site import Site


_MARGIN = 2.5  # [m] around everything driven


_BAR = 5.0  # [m]


def site_of(scenario: Mapping[str, Any]) -> Site | None:
    """The site, or None where its files are not to be had; the ways are shown all the same."""
    try:
        return scenes.site_of(scenes.build(scenario), seed=0)
    except DvaSimError:
        return None


def draw_ground(ax: Axes, site: Site | None) -> None:
    """The plan of the site; axes in metres where its files are not to be had."""
    ax.set_aspect("equal")
    ax.grid(False)
    if site is None:
        ax.set_xlabel("x (east) [m]")
        ax.set_ylabel("y (north) [m]")
        return
    from dva_sim.worlds.view import draw_site  # late: start-up

    draw_site(ax, site, labels=False, scale=False)
    for artist in (*ax.lines, *ax.patches, *ax.collections):
        artist.set_label(ASIDE)


def frame_of(points: Floats) -> tuple[Floats, Floats]:
    """Lower left and upper right corner of what is worth seeing [m]."""
    return points.min(axis=0) - _MARGIN, points.max(axis=0) + _MARGIN


def row_height(size: Floats, columns: int) -> float:
    """Height of a row of panels that are as wide as there is room for [in]."""
    return float(np.clip(WIDTH / columns * size[1] / size[0] + 0.3, 1.2, 5.0))


def scale_bar(ax: Axes, corner: Floats) -> None:
    """Five metres, in the lower left corner."""
    x, y = corner + 0.8
    ax.plot([x, x + _BAR], [y, y], color=INK, lw=2, solid_capstyle="butt", zorder=11, label=ASIDE)
    ax.annotate(
        f"{_BAR:g} m", (x, y), xytext=(0, 3), textcoords="offset points", fontsize=7.5, zorder=11
    )
