"""A run from above as moving pictures, or several runs in step."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from dva_sim.experiments.pictures import style
from dva_sim.experiments.pictures.moments import ROBOT, Moments
from dva_sim.experiments.pictures.scene import Scene
from dva_sim.experiments.pictures.traffic import Traffic
from dva_sim.simulation import Playback

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FPS = 10
LENGTH_S = 18.0  # a film lasts about this long; the run is sped up to fit
DPI = 100
WIDE, NARROW = 8.6, 6.2  # of a map, alone and beside another [in]
TALLEST = 7.5  # a map [in]
LEGEND = 0.45  # height [in]
LINES, LETTERS = 6, 70  # of the story


class Film:
    """The pictures of some runs in step, each with its message traffic below.

    Args:
        recordings: The runs, made with `keep_traffic`.
        inset: Show what a robot's camera sees, too.
    """

    def __init__(self, recordings: Sequence[Playback], inset: bool = False) -> None:
        runs = [Moments(recording) for recording in recordings]
        self.duration = max(r.duration for r in recordings)
        self.speed = max(1.0, round(self.duration / LENGTH_S))
        across = WIDE if len(runs) == 1 else NARROW
        map_height = height_of_map(recordings[0], across)
        below = 1.7 if inset else 0.75
        size = across * len(runs), map_height + below + LEGEND
        self.figure = new_figure(size)
        grid = self.figure.add_gridspec(2, len(runs), height_ratios=[map_height, below])
        scenes: list[Scene] = []
        self._parts: list[Any] = []
        for number, run in enumerate(runs):
            ax = self.figure.add_subplot(grid[0, number])
            scenes.append(Scene(ax, run, title_of(run.recording), tell=not inset))
            strip: Any = grid[1, number]
            if inset:
                eye, rest = strip.subgridspec(1, 2, width_ratios=[1, 1.6])
                story, strip = rest.subgridspec(2, 1, height_ratios=[1.5, 1])
                self._parts.append(_Eye(self.figure.add_subplot(eye), run))
                self._parts.append(_Story(self.figure.add_subplot(story), run.recording))
            self._parts.append(Traffic(self.figure.add_subplot(strip), run.recording))
        self._parts += scenes
        add_legend(self.figure, runs)
        canvas: Any = self.figure.canvas
        canvas.draw()
        self.figure.set_layout_engine("none")
        for scene in scenes:
            scene.freeze(canvas)
        self._canvas, self._background = canvas, canvas.copy_from_bbox(self.figure.bbox)

    def __len__(self) -> int:
        return math.ceil(self.duration / self.speed * FPS) + FPS

    def frames(self) -> Iterator[NDArray[np.uint8]]:
        """Pictures in order, each of shape `(height, width, 3)`."""
        for number in range(len(self)):
            yield self.at(min(number / FPS * self.speed, self.duration))

    def at(self, time: float) -> NDArray[np.uint8]:
        """The picture at a moment of the run [s]."""
        self._canvas.restore_region(self._background)
        renderer = self._canvas.get_renderer()
        for part in self._parts:
            for artist in part.show(time):
                artist.draw(renderer)
        return np.asarray(self._canvas.buffer_rgba())[:, :, :3].copy()


class _Eye:
    """What the operator at the wheel sees on the screen, or else what a robot sees now."""

    def __init__(self, ax: Axes, moments: Moments) -> None:
        self._moments = moments
        self._image = ax.imshow(np.zeros((240, 320, 3), np.uint8), animated=True)
        self._title = ax.set_title(" ", fontsize=style.FONT, loc="left")
        self._title.set_animated(True)
        ax.set_axis_off()

    def show(self, time: float) -> list[Artist]:
        """The picture at a moment [s]."""
        robots = self._moments.names(ROBOT)
        if not robots:
            return []
        glance = self._moments.glance(time)
        if glance is None:
            robot, captured, title = robots[0], time, f"{robots[0]}'s camera"
        else:
            robot, captured = glance.robot, glance.captured
            title = f"{glance.operator} sees {robot}'s camera, {time - captured:.2f} s old"
        self._image.set_data(self._moments.eye(robot, captured))
        self._title.set_text(title)
        return [self._image, self._title]


class _Story:
    """The newest lines of what is told."""

    def __init__(self, ax: Axes, recording: Playback) -> None:
        self._timeline = [m for m in recording.recorder.timeline if m.kind != "link"]
        self._text = ax.text(
            0, 1, "", transform=ax.transAxes, ha="left", va="top", fontsize=style.FONT,
            color=style.INK, linespacing=1.35, animated=True,
        )  # fmt: skip
        ax.set_axis_off()

    def show(self, time: float) -> list[Artist]:
        """What is told up to a moment [s]."""
        told = [m for m in self._timeline if m.time <= time][-LINES:]
        lines = [f"{m.time:.1f} s  {m.who} {m.what}".replace("_", " ") for m in told]
        self._text.set_text("\n".join(line[:LETTERS] for line in lines))
        return [self._text]


def new_figure(size: tuple[float, float], dpi: float = DPI) -> Figure:
    """A figure of a size [in] that is drawn without any window."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, dpi=dpi, layout="constrained")
    canvas: Any = FigureCanvasAgg
    canvas(figure)
    return figure


def height_of_map(recording: Playback, across: float) -> float:
    """Height that a map of a width takes [in]."""
    xmin, ymin, xmax, ymax = recording.site.extent
    return float(min(TALLEST, across * (ymax - ymin + 2.2) / (xmax - xmin + 1.6) + 0.25))


def title_of(recording: Playback) -> str:
    """What tells runs apart that stand side by side."""
    scenario = recording.scenario
    return f"{scenario.pattern}, {scenario.link.delay_s * 1000:.0f} ms each way"


def add_legend(figure: Figure, runs: Sequence[Moments]) -> None:
    """A key below all maps."""
    handles = style.legend(runs)
    columns = max(2, round(figure.get_figwidth() / 1.75))
    if handles:
        figure.legend(
            handles=handles, loc="outside lower center", ncols=columns, fontsize=style.FONT,
            frameon=False, handletextpad=0.4, columnspacing=1.2, borderpad=0.1,
        )  # fmt: skip
