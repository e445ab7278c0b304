"""Robots and people from above: where they are and head for, what they do, where they were.

Hazards as fields over the floor: smoke, heat, gas and water, and where they come from.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable
from typing import Any

import numpy as np
from contourpy import contour_generator
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgb, to_rgba
from matplotlib.markers import MarkerStyle
from matplotlib.patches import Circle, Wedge
from matplotlib.path import Path
from numpy.typing import NDArray

from dva_sim.recordings.pictures import colours, style
from dva_sim.recordings.pictures.colours import BYSTANDER, ROBOT
from dva_sim.recordings.pictures.moments import FRESH, Moments, kind_of
from dva_sim.worlds.hazards import Hazard, Raster

LARGER = 1.25  # bodies are drawn a little larger than they are
STEP = 0.5  # between the points of a trail [s]
CONE = 2.5  # length of the view cone [m]


class DrawnBody:
    """One of them with a trail; for a driven robot also what its operator sees.

    Args:
        ax: Where.
        moments: The run.
        name: Who.
    """

    def __init__(self, ax: Axes, moments: Moments, name: str) -> None:
        self.name, self.kind = name, kind_of(name)
        self._ax, self._moments = ax, moments
        person = self.kind == BYSTANDER
        self._trail = LineCollection(
            [], linewidths=0.7 if person else 1.5, zorder=5, capstyle="round", animated=True
        )
        ax.add_collection(self._trail, autolim=False)
        (self._mark,) = ax.plot(
            [], [], ls="none", mec="white", mew=0.5 if person else 0.9, zorder=7, animated=True
        )
        self._ghost = _Ghost(ax, moments, name) if self.kind == ROBOT else None

    def size(self) -> float:
        """Diameter on the picture [points]: true to scale, but never too small to see."""
        (x0, _), (x1, _) = self._ax.transData.transform([(0, 0), (1, 0)])
        metre = (x1 - x0) * 72 / self._ax.figure.dpi
        return max(
            float(2 * LARGER * self._moments.radius(self.name) * metre), style.SMALLEST[self.kind]
        )

    def place(self, time: float) -> tuple[float, float]:
        """Where it is [m]."""
        here = self._moments.at(self.name, time)
        return here.x, here.y

    def is_there(self, time: float) -> bool:
        """Whether it is still on the site."""
        return self._moments.is_there(self.name, time)

    def show(self, time: float) -> list[Artist]:
        """The body at a moment [s]."""
        self._draw_trail(time)
        if not self.is_there(time):
            return [self._trail]
        here = self._moments.at(self.name, time)
        self._mark.set_data([here.x], [here.y])
        self._mark.set(
            marker=_pointed(style.OUTLINES[self.kind]).rotated(rad=here.heading),
            markersize=self.size() * style.LENGTHS[self.kind],
            markerfacecolor=style.colour_of(self.kind, here.mode),
        )
        ghost = self._ghost.show(time) if self._ghost else []
        return [self._trail, *ghost, self._mark]

    def _draw_trail(self, time: float) -> None:
        """Where it was, the paler the longer ago, in the colours of what it did then."""
        past = self._moments.past(self.name, time)
        step = max(1, round(STEP / max(1e-3, (past[-1].time - past[0].time) / len(past))))
        past = [*past[:-1:step], past[-1]]
        places = np.array([(p.x, p.y) for p in past])
        moved = np.hypot(*np.diff(places, axis=0).T) > 1e-3
        self._trail.set_segments(np.stack([places[:-1], places[1:]], axis=1)[moved])
        colours = [
            to_rgba(style.colour_of(self.kind, p.mode), _fading(time - p.time))
            for p, here in zip(past[1:], moved, strict=True)
            if here
        ]
        self._trail.set_color(colours)


class _Ghost:
    """Where the operator takes a robot to be, while there is a picture."""

    def __init__(self, ax: Axes, moments: Moments, name: str) -> None:
        recording = moments.recording
        self._views = recording.recorder.views.get(recording.robot_named(name) or "", [])
        self._times = [p.time for p in self._views]
        self._half = recording.scenario.camera.field_of_view_deg / 2
        radius = LARGER * moments.radius(name)
        self._cone = Wedge((0, 0), CONE, 0, 1, fc=style.GHOST, ec="none", alpha=0.22, zorder=6.2,
                           animated=True)  # fmt: skip
        self._ring = Circle((0, 0), radius, fc="none", ec=style.GHOST, lw=1.4, ls="--", zorder=7.2,
                            animated=True)  # fmt: skip
        ax.add_patch(self._cone)
        ax.add_patch(self._ring)

    def show(self, time: float) -> list[Artist]:
        index = bisect_right(self._times, time) - 1
        if index < 0 or time - self._times[index] > FRESH:
            return []
        seen = self._views[index]
        heading = math.degrees(seen.heading)
        self._ring.center = seen.x, seen.y
        self._cone.set_center((seen.x, seen.y))
        self._cone.set_theta1(heading - self._half)
        self._cone.set_theta2(heading + self._half)
        return [self._cone, self._ring]


def _pointed(outline: tuple[tuple[float, float], ...]) -> Any:
    """A marker from the outline of a body that heads east."""
    return MarkerStyle(Path([*outline, outline[0]], closed=True))


def _fading(age: float) -> float:
    """How strong a trail of some age [s] still is."""
    return 0.1 + 0.75 * math.exp(-age / style.TRAIL_S)


LAYER = 2.2  # over the floors, under walls and names
STAR, MARK = 12, 8  # sizes of the mark of a source [points]
CELL = 0.25  # of the fields [m]
MOST_CELLS = 120_000  # of a field; on a larger site cells are larger
SMOKE_PATH = 2.5  # smoke covers the floor as it does a thing so far away [m]
THICKEST = 0.58  # so much of the floor does smoke cover at most
DEEP = 0.15  # from this depth water has its full colour [m]
WET = 0.002  # less is not drawn [m]
LEAST_HEAT = 1.0  # less is not drawn [kW/m2]


class DrawnFields:
    """All hazards of a run on one map.

    Args:
        ax: Where.
        moments: The run.
    """

    def __init__(self, ax: Axes, moments: Moments) -> None:
        self._ax, self._moments = ax, moments
        west, south, east, north = moments.recording.site.extent
        self._cell = max(CELL, ((east - west) * (north - south) / MOST_CELLS) ** 0.5)
        lower = _lower_limit(moments)
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
        """The hazards at a moment [s]."""
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
        """Those of a field."""
        west, east, south, north = raster.extent
        rows, columns = raster.values.shape
        x = west + (np.arange(columns) + 0.5) * (east - west) / columns
        y = south + (np.arange(rows) + 0.5) * (north - south) / rows
        contours = contour_generator(x, y, raster.values)
        for level, lines in zip(self._levels, self._lines, strict=True):
            found: Any = contours.lines(level)
            lines.set_segments(found)
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
        """Those of a kind that go on."""
        hazards = (incident.hazard for incident in moments.going_on(time))
        places = [hazard.position for hazard in hazards if hazard.title == self._title]
        if not places:
            return []
        self._marks.set_data(*zip(*places, strict=True))
        return [self._marks]


def _lower_limit(moments: Moments) -> float:
    """Lower explosive limit of what leaks; of several gases, of the one that explodes first."""
    limits = [incident.hazard.explodes_at() for incident in moments.recording.incidents]
    return min(1.0, *limits)


def _over(upper: NDArray[Any], under: NDArray[Any]) -> NDArray[Any]:
    """One translucent picture over another `(rows, columns, 4)`."""
    a, b = upper[..., 3:], under[..., 3:]
    cover = a + b * (1 - a)
    colours = (upper[..., :3] * a + under[..., :3] * b * (1 - a)) / np.maximum(cover, 1e-6)
    return np.concatenate([colours, cover], axis=2)


def _tinted(colour: str, cover: NDArray[Any]) -> NDArray[Any]:
    """One colour that covers the floor more or less, `(rows, columns, 4)`."""
    picture = np.empty((*cover.shape, 4))
    picture[..., :3] = to_rgb(colour)
    picture[..., 3] = cover
    return picture


def _smoke(extinction: NDArray[Any]) -> NDArray[Any]:
    return _tinted(colours.SMOKE, THICKEST * (1.0 - np.exp(-SMOKE_PATH * extinction)))


def _water(depth: NDArray[Any]) -> NDArray[Any]:
    deep = np.clip(depth / DEEP, 0.0, 1.0)
    return _tinted(colours.WATER, np.where(depth > WET, 0.25 + 0.5 * deep, 0.0))


def _gas(share: NDArray[Any]) -> NDArray[Any]:
    """By share of the lower explosive limit: above it, it could explode."""
    cover = np.interp(share, (0.0, 0.02, *style.GAS_LEVELS), (0.0, 0.0, 0.12, 0.2, 0.34, 0.55))
    return _tinted(colours.GAS, cover)


def _heat(flux: NDArray[Any]) -> NDArray[Any]:
    """From yellow to red as it gets hotter."""
    strong = np.clip(np.log10(np.maximum(flux, LEAST_HEAT) / LEAST_HEAT) / 1.5, 0.0, 1.0)
    picture = _tinted(colours.FIRE, 0.55 * np.sqrt(strong))
    picture[..., 1] += (1 - strong) * 0.5
    return picture
