"""Layout of a picture from above: a heading, maps in columns, a key; all in inches."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from dva_sim.recordings.pictures.moments import Moments
from dva_sim.recordings.pictures.run_endings import pattern_name
from dva_sim.recordings.pictures.style import FONT, INK, TITLE, WIDTH, legend
from dva_sim.simulation.full import Playback
from dva_sim.worlds.view import limits, set_limits

MARGIN = 0.06  # around everything
GAP = 0.16  # between columns


HEADING = 0.24  # height of the lines above everything
TITLE_HEIGHT = 0.22  # height of the lines above a map
LINE = 0.32  # height of a line below a map


TALLEST = 7.5  # maximum height of a map


class Sheet:
    """An empty picture, as high as its maps, heading and key.

    Args:
        runs: Runs to show; all at the same place.
        maps: Number of maps.
        columns: Number of maps in a row.
        heading: Above all; of a single map it is the title.
        below: Height left free below each column of maps.
        dpi: Pixels of an inch.

    Attributes:
        figure: The picture.
        maps: The maps, row by row, in their final size and still empty.
        title: Title of a single map.
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
        """Return place and size of a part of the space below a column, as shares of that."""
        begins, high = self._below
        x = self._left(column) + left * self._across
        y = begins + top * high
        return self._axes(x, y, width * self._across, height * high)

    def _left(self, column: int) -> float:
        return MARGIN + column * (self._across + GAP)

    def _map(self, column: int, top: float, size: tuple[float, float], run: Moments) -> Axes:
        """Return a map in the middle of its column."""
        width, height = size
        left = self._left(column) + (self._across - width) / 2
        ax = self._axes(left, MARGIN + top + TITLE_HEIGHT, width, height)
        set_limits(ax, run.recording.site)
        return ax

    def _axes(self, left: float, top: float, width: float, height: float) -> Axes:
        """Return axes by their place from the upper left corner."""
        wide = WIDTH
        high = self._height
        box = left / wide, 1.0 - (top + height) / high, width / wide, height / high
        return self.figure.add_axes(box)

    def _add_heading(self, text: str) -> None:
        x = MARGIN / WIDTH
        y = 1.0 - MARGIN / self._height
        self.figure.text(x, y, text, va="top", fontsize=TITLE, color=INK)


def heading_of(recordings: Sequence[Playback]) -> str:
    """Return the heading: one run, or the same one under two patterns."""
    first = recordings[0]
    what = pattern_name(first) if len(recordings) == 1 else "The same run under two patterns"
    delay = first.scenario.link.delay_s
    text = f"{1000 * delay:g}\N{NO-BREAK SPACE}ms" if delay < 1 else f"{delay:g}\N{NO-BREAK SPACE}s"
    return f"{what}, {text} of delay each way" if delay else what


def _new_figure(dpi: float) -> Figure:
    """Return a figure that is drawn without any window."""
    figure = Figure(figsize=(WIDTH, WIDTH), dpi=dpi)
    canvas: Any = FigureCanvasAgg
    canvas(figure)
    return figure


def _size_of_map(recording: Playback, across: float) -> tuple[float, float]:
    """Return the width and height of a map that is so wide at most."""
    (left, right), (low, high) = limits(recording.site)
    shape = (high - low) / (right - left)
    height = min(TALLEST, across * shape)
    return height / shape, height


def _add_key(figure: Figure, runs: Sequence[Moments]) -> float:
    """Draw a key below all maps, in as few lines as possible; return its height."""
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
