"""Colours, sizes and the legend of pictures from above.

Where things stand on a picture from above: a heading, maps in columns, a key; all in inches.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from dva_sim.recordings.pictures.colours import (
    ACTIVITIES,
    BYSTANDER,
    FIRE,
    GAS,
    GUARD,
    KINDS,
    ROBOT,
    ROBOT_MODES,
    SMOKE,
    WATER,
)
from dva_sim.recordings.pictures.moments import Moments
from dva_sim.recordings.pictures.run_endings import pattern_name
from dva_sim.simulation.full import Playback
from dva_sim.worlds.view import limits, set_limits

INK, HALO, GHOST = "#2b3038", "white", "#e07a00"
WIDTH = 8.4  # of a picture [in]: a page shows 840 pixels of it
FONT = 8.0  # of labels [points]: 11 pixels on such a page
TITLE = 10.0  # [points]
LEAST = 6.5  # of names on the ground [points]: 9 pixels on such a page
ROOMY = 10.0  # from this scale on a map has room for small marks [points/m]
AHEAD, BEHIND, FAILED = ENDS = "#1b7a3d", "#59606a", "#a03030"  # how a run ended
SMALLEST = {ROBOT: 8.5, GUARD: 7.5, BYSTANDER: 4.5}  # diameters, however large the site [points]
TRAIL_S = 40.0  # a trail's colour falls to a third in that time [s]

SHAPES = {ROBOT: "s", GUARD: "o", BYSTANDER: "o"}

# Outlines of bodies of diameter 1 that head east: a box with a bow, a disc with a beak.
_BEAK = tuple(
    (0.5 * math.cos(angle), 0.5 * math.sin(angle))
    for angle in (math.radians(degrees) for degrees in range(48, 313, 12))
)
OUTLINES = {
    ROBOT: ((0.8, 0.0), (0.32, 0.48), (-0.5, 0.48), (-0.5, -0.48), (0.32, -0.48)),
    GUARD: ((0.82, 0.0), *_BEAK),
    BYSTANDER: ((0.82, 0.0), *_BEAK),
}
LENGTHS = {ROBOT: 1.6, GUARD: 1.64, BYSTANDER: 1.64}  # of the marker box, twice the bow

SMALL = (*ROBOT_MODES.values(), *ACTIVITIES.values(), FIRE, GAS, WATER, GHOST, *ENDS)
GAS_LEVELS = (0.1, 0.2, 0.5, 1.0)  # of the lower explosive limit
HEAT_LEVELS = (1.0, 2.5, 10.0)  # [kW/m2]; skin bears 2.5 for long


def colour_of(kind: str, mode: str) -> str:
    """Colour of somebody who does something."""
    if kind == BYSTANDER and mode == "walking":
        return KINDS[kind]  # green is for guards
    modes = ROBOT_MODES if kind == ROBOT else ACTIVITIES
    return modes.get(mode, KINDS.get(kind, INK))


def legend(moments: Iterable[Moments]) -> list[Artist]:
    """A key for what occurs in some runs."""
    runs, handles = list(moments), []
    for kind in (ROBOT, GUARD, BYSTANDER):
        names = [(run, name) for run in runs for name in run.names(kind)]
        modes = {p.mode: None for run, name in names for p in run.tracks[name]}
        for mode in sorted(modes, key=_order):
            handles.append(_dot(SHAPES[kind], colour_of(kind, mode), f"{kind}: {mode.lower()}"))
    looks = {title: hazard for run in runs for title, hazard in run.looks.items()}
    for title, hazard in sorted(looks.items()):
        handles.append(_dot(hazard.mark, hazard.colour, title))
    if any(run.recording.recorder.views for run in runs):
        seen = "as the operator sees it"
        handles.append(_dot("o", "none", seen, GHOST))
    handles += _fields({what for run in runs for what in run.shown})
    return handles


def _fields(shown: set[str]) -> list[Artist]:
    handles: list[Artist] = []
    if "smoke" in shown:
        handles.append(Patch(fc=SMOKE, alpha=0.5, label="smoke"))
    if "heat" in shown:
        levels = ", ".join(f"{level:g}" for level in HEAT_LEVELS)
        handles.append(Line2D([], [], color=FIRE, lw=1, label=f"heat {levels} kW/m²"))
    if "gas" in shown:
        levels = ", ".join(f"{100 * level:.0f}" for level in GAS_LEVELS)
        handles.append(Line2D([], [], color=GAS, lw=1, label=f"gas {levels} % of LEL"))
    if "water" in shown:
        handles.append(Patch(fc=WATER, alpha=0.5, label="water"))
    return handles


def _dot(shape: str, colour: str, label: str, edge: str = "white") -> Any:
    return Line2D([], [], ls="none", marker=shape, mfc=colour, mec=edge, ms=7, label=label)


def _order(mode: str) -> tuple[int, str]:
    """Modes as they are listed above, others after them."""
    known = [*ROBOT_MODES, *ACTIVITIES]
    return (known.index(mode) if mode in known else len(known)), mode


MARGIN, GAP = 0.06, 0.16  # around everything; between columns
HEADING, TITLE_HEIGHT, LINE = 0.24, 0.22, 0.32  # of lines above all, above and below a map
TALLEST = 7.5  # a map


class Sheet:
    """An empty picture that is as high as what it has to hold.

    Args:
        runs: What is shown; all at the same place.
        maps: How many maps there are.
        columns: How many of them stand abreast.
        heading: Above all; of a single map it is the title.
        below: Height left free below each column of maps.
        dpi: Pixels of an inch.

    Attributes:
        figure: The picture.
        maps: The maps, row by row, in their final size and still empty.
        title: Of a single map.
    """

    def __init__(
        self,
        runs: Sequence[Moments],
        maps: int,
        columns: int,
        heading: str,
        below: float = 0.0,
        dpi: float = 100.0,
    ) -> None:
        rows = math.ceil(maps / columns)
        self._across = (WIDTH - 2 * MARGIN - (columns - 1) * GAP) / columns
        map_size = _size_of_map(runs[0].recording, self._across)
        self._row = TITLE_HEIGHT + map_size[1] + LINE
        top = 0.0 if maps == 1 else HEADING
        self.figure = _new_figure(dpi)
        key = _add_key(self.figure, runs)
        self._height = MARGIN + top + rows * self._row + below + key + MARGIN
        self.figure.set_figheight(self._height)
        self.title = heading if maps == 1 else ""
        self._below = MARGIN + top + rows * self._row, below
        if not self.title:
            self._add_heading(heading)
        self.maps = [
            self._map(number % columns, top + number // columns * self._row, map_size, runs[0])
            for number in range(maps)
        ]

    def below(self, column: int, left: float, top: float, width: float, height: float) -> Axes:
        """A part of what is left free below a column: its place and size, as shares of that."""
        begins, high = self._below
        x, y = self._left(column) + left * self._across, begins + top * high
        return self._axes(x, y, width * self._across, height * high)

    def _left(self, column: int) -> float:
        return MARGIN + column * (self._across + GAP)

    def _map(self, column: int, top: float, size: tuple[float, float], run: Moments) -> Axes:
        """A map in the middle of its column."""
        width, height = size
        left = self._left(column) + (self._across - width) / 2
        ax = self._axes(left, MARGIN + top + TITLE_HEIGHT, width, height)
        set_limits(ax, run.recording.site)
        return ax

    def _axes(self, left: float, top: float, width: float, height: float) -> Axes:
        """Axes by their place from the upper left corner."""
        wide, high = WIDTH, self._height
        box = left / wide, 1.0 - (top + height) / high, width / wide, height / high
        return self.figure.add_axes(box)

    def _add_heading(self, text: str) -> None:
        x, y = MARGIN / WIDTH, 1.0 - MARGIN / self._height
        self.figure.text(x, y, text, va="top", fontsize=TITLE, color=INK)


def heading_of(recordings: Sequence[Playback]) -> str:
    """What is shown: one run, or the same one under two patterns."""
    first = recordings[0]
    what = pattern_name(first) if len(recordings) == 1 else "The same run under two patterns"
    delay = first.scenario.link.delay_s
    told = f"{1000 * delay:g}\N{NO-BREAK SPACE}ms" if delay < 1 else f"{delay:g}\N{NO-BREAK SPACE}s"
    return f"{what}, {told} of delay each way" if delay else what


def _new_figure(dpi: float) -> Figure:
    """A figure that is drawn without any window."""
    figure = Figure(figsize=(WIDTH, WIDTH), dpi=dpi)
    canvas: Any = FigureCanvasAgg
    canvas(figure)
    return figure


def _size_of_map(recording: Playback, across: float) -> tuple[float, float]:
    """Width and height of a map that is so wide at most."""
    (left, right), (low, high) = limits(recording.site)
    shape = (high - low) / (right - left)
    height = min(TALLEST, across * shape)
    return height / shape, height


def _add_key(figure: Figure, runs: Sequence[Moments]) -> float:
    """A key below all maps, in as few lines as it fits into; its height."""
    canvas: Any = figure.canvas
    handles = legend(runs)
    for columns in range(len(handles), 0, -1):
        key = figure.legend(
            handles=handles, loc="lower center", ncols=columns, fontsize=FONT,
            frameon=False, handletextpad=0.4, columnspacing=1.2, borderpad=0.1, borderaxespad=0.2,
        )  # fmt: skip
        box = key.get_window_extent(canvas.get_renderer())
        if box.width < figure.bbox.width or columns == 1:
            return float(box.height / figure.dpi)
        key.remove()
    return 0.0
