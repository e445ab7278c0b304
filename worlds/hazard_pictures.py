"""Draws `pictures/hazard-*.png` of this folder: `python worlds/hazard_pictures.py`."""

from __future__ import annotations

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap

from dva_sim.worlds.hazards import Surroundings, make_hazard
from dva_sim.worlds.layout import Site
from dva_sim.worlds.site import load_site
from dva_sim.worlds.view import draw_site

HERE = Path(__file__).parent
PLACES = {"fire": (19.0, 22.5), "gas_leak": (19.0, 22.5), "flood": (35.0, 19.0)}  # [m]
TIMES = {"fire": (120.0, 300.0), "gas_leak": (120.0, 900.0), "flood": (60.0, 1800.0)}  # [s]
SHOWN = {"fire": "smoke", "gas_leak": "gas", "flood": "water"}
SCALE = {"fire": 1.0, "gas_leak": 1 / 0.044, "flood": 1000.0}
LABEL = {
    "fire": "mean extinction [1/m]",
    "gas_leak": "methane / explosive limit",
    "flood": "depth of water [mm]",
}
TOP = {"fire": 6.0, "gas_leak": 1.0, "flood": 20.0}
COLOUR = {"fire": "#3c3c3c", "gas_leak": "#b8860b", "flood": "#1f6fb4"}
PROBES = {
    "fire": {
        "chemistry lab": (22.5, 22.5),
        "north corridor": (13.1, 22.0),
        "main corridor": (20, 12),
    },
    "gas_leak": {
        "2 m off": (17.0, 22.9),
        "lab, by the door": (15.0, 22.0),
        "north corridor": (13.1, 22.0),
    },
    "flood": {
        "server room": (39.0, 22.8),
        "control room": (38.0, 15.5),
        "main corridor": (35.0, 12.0),
    },
}


def draw(site: Site, kind: str) -> None:
    """Two moments from above, and what it is like at three places."""
    air = Surroundings(site, [make_hazard(kind, PLACES[kind], 0.0)])
    figure, axes = plt.subplots(
        1, 3, figsize=(15, 3.6), layout="constrained", width_ratios=(3, 3, 2)
    )
    for ax, time in zip(axes, TIMES[kind], strict=False):
        _from_above(ax, site, air, kind, time)
    figure.colorbar(ax.images[-1], ax=axes[:2], label=LABEL[kind], shrink=0.8, extend="max")
    _at_places(axes[2], air, kind)
    figure.savefig(HERE / "pictures" / f"hazard-{kind.replace('_', '-')}.png", dpi=110)
    plt.close(figure)


def _from_above(ax: Axes, site: Site, air: Surroundings, kind: str, time: float) -> None:
    draw_site(ax, site, labels=False)
    clear = LinearSegmentedColormap.from_list("air", [COLOUR[kind] + "00", COLOUR[kind]])
    picture = air.raster(SHOWN[kind], time, 0.1)
    values, limit = picture.values * SCALE[kind], TOP[kind]
    ax.imshow(values, clear, extent=picture.extent, origin="lower", vmin=0, vmax=limit, zorder=2)
    ax.plot(*PLACES[kind], "*", color="#d62728", markersize=12, zorder=5)
    ax.set_title(f"after {time / 60:.0f} min")


def _at_places(ax: Axes, air: Surroundings, kind: str) -> None:
    times = np.linspace(1.0, 900.0 if kind == "fire" else 1800.0, 300)
    rasters = [air.raster(SHOWN[kind], time).values for time in times]
    for name, (x, y) in PROBES[kind].items():
        values = [SCALE[kind] * raster[int(y / 0.25), int(x / 0.25)] for raster in rasters]
        ax.plot(times / 60.0, values, label=name)
    ax.set_xlabel("time [min]")
    ax.set_ylabel(LABEL[kind])
    ax.legend(frameon=False)
    ax.spines[["top", "right"]].set_visible(False)


if __name__ == "__main__":
    for kind in PLACES:
        draw(load_site("caparica"), kind)
