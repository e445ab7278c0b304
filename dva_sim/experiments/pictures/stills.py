"""Single pictures of a run: one moment, a strip of moments, a robot's-eye view."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from dva_sim.errors import ConfigError
from dva_sim.experiments.pictures.film import add_legend, height_of_map, new_figure, title_of
from dva_sim.experiments.pictures.moments import Moments
from dva_sim.experiments.pictures.scene import Scene
from dva_sim.simulation import Playback

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DPI = 160
WIDE = 9.0  # a still [in]
PANEL = 5.0  # a panel of a strip [in]
LEGEND = 0.45  # height [in]


def still(recordings: Sequence[Playback], time: float) -> Figure:
    """Runs side by side at one moment [s]."""
    runs = [Moments(recording) for recording in recordings]
    across = WIDE if len(runs) == 1 else 6.5
    height = height_of_map(recordings[0], across) + LEGEND
    figure = new_figure((across * len(runs), height), DPI)
    scenes = [
        Scene(figure.add_subplot(1, len(runs), number), run, title_of(run.recording))
        for number, run in enumerate(runs, 1)
    ]
    return _fixed(figure, scenes, runs, [time] * len(runs))


def strip(recording: Playback, times: Sequence[float]) -> Figure:
    """One run at several moments [s], from left to right and from top to bottom."""
    run = Moments(recording)
    height = height_of_map(recording, PANEL)
    columns = _columns(len(times), height / PANEL)
    rows = math.ceil(len(times) / columns)
    figure = new_figure((PANEL * columns, height * rows + LEGEND), DPI)
    scenes = [Scene(figure.add_subplot(rows, columns, n), run) for n in range(1, len(times) + 1)]
    return _fixed(figure, scenes, [run], times)


def even_times(recording: Playback, panels: int) -> list[float]:
    """Moments spread evenly over a run, its end among them [s]."""
    return [recording.duration * (n + 1) / panels for n in range(panels)]


def save_eye(recording: Playback, robot: str, time: float, path: Path) -> None:
    """Write what a robot's camera sees at a moment [s], twice as large as it is sent.

    Raises:
        ConfigError: no such robot.
    """
    from PIL import Image

    Image.fromarray(Moments(recording).eye(robot, time, 640, 480)).save(path)


def check_times(recording: Playback, times: Sequence[float]) -> None:
    """Refuse moments that a run does not have.

    Raises:
        ConfigError: before its beginning or after its end.
    """
    wrong = [time for time in times if not 0 <= time <= recording.duration]
    if wrong:
        problem = f"--at {wrong[0]:g} is not within the run, which lasts {recording.duration:.0f} s"
        raise ConfigError(problem)


def _columns(panels: int, tall: float) -> int:
    """Columns that bring the whole nearest to a sheet of 3 by 2."""

    def shape(columns: int) -> float:
        return columns / (math.ceil(panels / columns) * tall)

    return min(range(1, panels + 1), key=lambda n: abs(math.log(shape(n) / 1.5)))


def _fixed(
    figure: Figure, scenes: Sequence[Scene], runs: Sequence[Moments], times: Sequence[float]
) -> Figure:
    """The figure with each scene at its moment."""
    add_legend(figure, runs)
    figure.draw_without_rendering()  # names are placed when sizes are known
    for scene, time in zip(scenes, times, strict=True):
        scene.fix(time)
    return figure
