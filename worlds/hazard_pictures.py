"""Draws `pictures/hazard-*.png` of this folder: `python worlds/hazard_pictures.py`."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap

from dva_sim.worlds.hazards import Surroundings, make_hazard
from dva_sim.worlds.site import Site, load_site
from dva_sim.worlds.view import draw_site

Point = tuple[float, float]

HERE = Path(__file__).parent


class Example(NamedTuple):
    """What is drawn of one kind.

    Attributes:
        kind: Of the hazard.
        place: Where it begins [m].
        times: Of the two pictures from above [s].
        until: Where the curves end [s].
        shown: What lies over the floor.
        scale: What its values are multiplied with.
        label: What that is then called.
        top: The value with the full colour.
        colour: As `#rrggbb`.
        probes: Places of the curves [m], by name.
    """

    kind: str
    place: Point
    times: tuple[float, float]
    until: float
    shown: str
    scale: float
    label: str
    top: float
    colour: str
    probes: dict[str, Point]


LAB = (19.0, 22.5)  # [m]
CORRIDORS = {"north corridor": (13.1, 22.0), "main corridor": (20.0, 12.0)}
EXAMPLES = (
    Example(
        "fire", LAB, (120.0, 300.0), 900.0, "smoke", 1.0, "mean extinction [1/m]", 6.0,
        "#3c3c3c", {"chemistry lab": (22.5, 22.5), **CORRIDORS},
    ),
    Example(
        "gas_leak", LAB, (120.0, 900.0), 1800.0, "gas", 1 / 0.044, "methane / explosive limit", 1.0,
        "#b8860b", {"2 m off": (17.0, 22.9), "lab, by the door": (15.0, 22.0),
                    "north corridor": (13.1, 22.0)},
    ),
    Example(
        "flood", (35.0, 19.0), (60.0, 1800.0), 1800.0, "water", 1000.0, "depth of water [mm]", 20.0,
        "#1f6fb4", {"server room": (39.0, 22.8), "control room": (38.0, 15.5),
                    "main corridor": (35.0, 12.0)},
    ),
)  # fmt: skip


def draw(site: Site, example: Example) -> None:
    """Two moments from above, and what it is like at three places."""
    air = Surroundings(site, [make_hazard(example.kind, example.place, 0.0)])
    figure, axes = plt.subplots(
        1, 3, figsize=(15, 3.6), layout="constrained", width_ratios=(3, 3, 2)
    )
    for ax, time in zip(axes, example.times, strict=False):
        _from_above(ax, site, air, example, time)
    figure.colorbar(ax.images[-1], ax=axes[:2], label=example.label, shrink=0.8, extend="max")
    _at_places(axes[2], air, example)
    name = example.kind.replace("_", "-")
    figure.savefig(HERE / "pictures" / f"hazard-{name}.png", dpi=110)
    plt.close(figure)


def _from_above(ax: Axes, site: Site, air: Surroundings, example: Example, time: float) -> None:
    draw_site(ax, site, labels=False)
    clear = LinearSegmentedColormap.from_list("air", [example.colour + "00", example.colour])
    picture = air.raster(example.shown, time, 0.1)
    values, limit = picture.values * example.scale, example.top
    ax.imshow(values, clear, extent=picture.extent, origin="lower", vmin=0, vmax=limit, zorder=2)
    ax.plot(*example.place, "*", color="#d62728", markersize=12, zorder=5)
    ax.set_title(f"after {time / 60:.0f} min")


def _at_places(ax: Axes, air: Surroundings, example: Example) -> None:
    times = np.linspace(1.0, example.until, 300)
    rasters = [air.raster(example.shown, time).values for time in times]
    for name, (x, y) in example.probes.items():
        values = [example.scale * raster[int(y / 0.25), int(x / 0.25)] for raster in rasters]
        ax.plot(times / 60.0, values, label=name)
    ax.set_xlabel("time [min]")
    ax.set_ylabel(example.label)
    ax.legend(frameon=False)
    ax.spines[["top", "right"]].set_visible(False)


if __name__ == "__main__":
    for example in EXAMPLES:
        draw(load_site("caparica"), example)
