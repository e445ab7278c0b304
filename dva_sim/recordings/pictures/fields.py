"""Hazards as fields over the floor: smoke, heat, gas and water, and their sources."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from contourpy import contour_generator
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgb
from numpy.typing import NDArray

from dva_sim.recordings.pictures import colours, style
from dva_sim.recordings.pictures.moments import Moments
from dva_sim.worlds.hazards import Hazard, Raster

LAYER = 2.2  # drawing order: over the floors, under walls and names
STAR = 12  # size of the mark of a source [points]
MARK = 8  # size of the mark of a source [points]
CELL = 0.25  # side of a cell of the fields [m]
MAX_CELLS = 120_000  # maximum cells of a field; a larger site has larger ones
SMOKE_PATH = 2.5  # optical path through smoke that covers the floor [m]
THICKEST = 0.58  # maximum opacity of smoke over the floor
DEEP = 0.15  # depth from which water has its full colour [m]
DRAWN_DEPTH_M = 0.002  # least depth that is drawn [m]
MIN_HEAT = 1.0  # least heat flux that is drawn [kW/m2]


class DrawnFields:
    """All hazards of a run on one map.

    Args:
        ax: Axes to draw on.
        moments: The run.
    """

    def __init__(self, ax: Axes, moments: Moments) -> None:
        self._ax = ax
        self._moments = moments
        west, south, east, north = moments.recording.site.extent
        self._cell = max(CELL, ((east - west) * (north - south) / MAX_CELLS) ** 0.5)
        # Of several gases the one that explodes first counts.
        limits = [incident.hazard.explodes_at() for incident in moments.recording.incidents]
        lower = min(1.0, *limits)
        paints: dict[str, Callable[[NDArray[Any]], NDArray[Any]]] = {
            "water": _water,
            "heat": _heat,
            "smoke": _smoke,
            "gas": lambda v: _gas(v / lower),
        }
        self._paints = {what: paint for what, paint in paints.items() if what in moments.shown}
        gas = tuple(level * lower for level in style.GAS_LEVELS)
        self._contours = {
            "heat": _Contours(ax, style.HEAT_LEVELS, colours.FIRE),
            "gas": _Contours(ax, gas, colours.GAS),
        }
        self._image = ax.imshow(
            np.zeros((1, 1, 4), np.uint8), origin="lower", interpolation="bilinear",
            zorder=LAYER, animated=True,
        )  # fmt: skip
        self._sources = [_Source(ax, hazard) for hazard in moments.looks.values()]

    def show(self, time: float) -> list[Artist]:
        """Return the hazards at a moment [s]."""
        artists: list[Artist] = []
        picture: NDArray[Any] | None = None
        for what, paint in self._paints.items():
            raster = self._moments.recording.surroundings.raster(what, time, self._cell)
            if raster.values.max() <= 0:
                continue
            layer = paint(raster.values)
            picture = layer if picture is None else _over(layer, picture)
            self._image.set_extent(raster.extent)
            if what in self._contours:
                artists += self._contours[what].show(raster)
        if picture is not None:
            self._image.set_data((255 * picture).astype(np.uint8))
            artists.append(self._image)
        for source in self._sources:
            artists += source.show(self._moments, time)
        return artists


class _Contours:
    """Lines of equal values."""

    def __init__(self, ax: Axes, levels: tuple[float, ...], colour: str) -> None:
        self._levels = levels
        widths = np.linspace(0.6, 1.4, len(levels))
        self._lines = [
            LineCollection([], colors=colour, linewidths=width, zorder=4.5, animated=True)
            for width in widths
        ]
        for lines in self._lines:
            ax.add_collection(lines, autolim=False)

    def show(self, raster: Raster) -> list[Artist]:
        """Return the hazards of a field."""
        west, east, south, north = raster.extent
        rows, columns = raster.values.shape
        x = west + (np.arange(columns) + 0.5) * (east - west) / columns
        y = south + (np.arange(rows) + 0.5) * (north - south) / rows
        contours = contour_generator(x, y, raster.values)
        for level, lines in zip(self._levels, self._lines, strict=True):
            segments: Any = contours.lines(level)
            lines.set_segments(segments)
        return list(self._lines)


class _Source:
    """A mark where hazards of one kind come from."""

    def __init__(self, ax: Axes, hazard: Hazard) -> None:
        self._title = hazard.title
        (self._marks,) = ax.plot(
            [], [], ls="none", marker=hazard.mark, ms=STAR if hazard.mark == "*" else MARK,
            color=hazard.colour, mec="white", mew=0.8, zorder=6, animated=True,
        )  # fmt: skip

    def show(self, moments: Moments, time: float) -> list[Artist]:
        """Return the active hazards of a kind."""
        hazards = (incident.hazard for incident in moments.going_on(time))
        places = [hazard.position for hazard in hazards if hazard.title == self._title]
        if not places:
            return []
        self._marks.set_data(*zip(*places, strict=True))
        return [self._marks]


def _over(upper: NDArray[Any], under: NDArray[Any]) -> NDArray[Any]:
    """Return one translucent picture over another `(rows, columns, 4)`."""
    a = upper[..., 3:]
    b = under[..., 3:]
    cover = a + b * (1 - a)
    colours = (upper[..., :3] * a + under[..., :3] * b * (1 - a)) / np.maximum(cover, 1e-6)
    return np.concatenate([colours, cover], axis=2)


def _tinted(colour: str, cover: NDArray[Any]) -> NDArray[Any]:
    """Return one colour that covers the floor more or less, `(rows, columns, 4)`."""
    picture = np.empty((*cover.shape, 4))
    picture[..., :3] = to_rgb(colour)
    picture[..., 3] = cover
    return picture


def _smoke(extinction: NDArray[Any]) -> NDArray[Any]:
    return _tinted(colours.SMOKE, THICKEST * (1.0 - np.exp(-SMOKE_PATH * extinction)))


def _water(depth: NDArray[Any]) -> NDArray[Any]:
    deep = np.clip(depth / DEEP, 0.0, 1.0)
    return _tinted(colours.WATER, np.where(depth > DRAWN_DEPTH_M, 0.25 + 0.5 * deep, 0.0))


def _gas(share: NDArray[Any]) -> NDArray[Any]:
    """Return colours by share of the lower explosive limit: above it, it could explode."""
    cover = np.interp(share, (0.0, 0.02, *style.GAS_LEVELS), (0.0, 0.0, 0.12, 0.2, 0.34, 0.55))
    return _tinted(colours.GAS, cover)


def _heat(flux: NDArray[Any]) -> NDArray[Any]:
    """Return colours from yellow to red as it gets hotter."""
    strong = np.clip(np.log10(np.maximum(flux, MIN_HEAT) / MIN_HEAT) / 1.5, 0.0, 1.0)
    picture = _tinted(colours.FIRE, 0.55 * np.sqrt(strong))
    picture[..., 1] += (1 - strong) * 0.5
    return picture
