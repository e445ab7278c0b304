"""A run from above as moving pictures, or several runs in step."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from numpy.typing import NDArray

from dva_sim.recordings.pictures import style
from dva_sim.recordings.pictures.colours import ROBOT
from dva_sim.recordings.pictures.moments import Moments
from dva_sim.recordings.pictures.picture_layout import Sheet, heading_of
from dva_sim.recordings.pictures.run_endings import pattern_name, verdicts
from dva_sim.recordings.pictures.scene import Scene
from dva_sim.simulation.full import Playback

FPS = 8
LENGTH_S = 16.0  # approximate length of a film; the run is sped up to fit
HELD_S = 3.0  # time for which its last picture is shown
GLANCES = 2  # camera pictures per second of a film: more would be no easier to follow
DPI = 100
TRAFFIC = 0.8  # height of the part below maps without a camera's picture
EYE = 1.5  # height of the part below maps with a camera's picture
# What is there: its place from the left and from the top, its width and height, as shares.
SINGLE_VIEW = (0.18, 0.0, 0.79, 0.68)
STRIP = (0.62, 0.12, 0.35, 0.65)
SCREEN = (0.02, 0.12, 0.4, 0.84)


class Film:
    """The pictures of some runs in step, each with its message traffic below.

    A run that has ended stays as it was at its end, while another goes on.

    Args:
        recordings: The runs, made with `keep_traffic`.
        inset: Show what a robot's camera sees, too.
    """

    def __init__(self, recordings: Sequence[Playback], inset: bool = False) -> None:
        runs = [Moments(recording) for recording in recordings]
        self.duration = max(r.duration for r in recordings)
        self.speed = max(1.0, round(self.duration / LENGTH_S))
        pace = f"; shown {self.speed:g} times as fast" if self.speed > 1 else ""
        heading = f"{heading_of(recordings)}{pace}"
        sheet = Sheet(runs, len(runs), len(runs), heading, EYE if inset else TRAFFIC, DPI)
        self.figure = sheet.figure
        self._parts: list[Any] = []
        scenes: list[Scene] = []
        for column, (run, end) in enumerate(zip(runs, verdicts(recordings), strict=True)):
            title = sheet.title or pattern_name(run.recording)
            scenes.append(Scene(sheet.maps[column], run, end, title))
            self._parts.append(
                Traffic(sheet.below(column, *(STRIP if inset else SINGLE_VIEW)), run)
            )
            if inset:
                eye = sheet.below(column, *SCREEN)
                self._parts.append(_Eye(eye, run, self.speed / GLANCES))
        self._parts += scenes
        canvas: Any = self.figure.canvas
        canvas.draw()
        for scene in scenes:
            scene.freeze(canvas)
        self._canvas = canvas
        self._background = canvas.copy_from_bbox(self.figure.bbox)

    def __len__(self) -> int:
        return math.ceil(self.duration / self.speed * FPS) + round(HELD_S * FPS)

    def frames(self) -> Iterator[NDArray[np.uint8]]:
        """Yield pictures in order, each of shape `(height, width, 3)`."""
        moving = math.ceil(self.duration / self.speed * FPS)
        for number in range(moving):
            yield self.at(number / FPS * self.speed)
        yield from [self.at(self.duration)] * (len(self) - moving)

    def at(self, time: float) -> NDArray[np.uint8]:
        """Return the picture at a moment of the run [s]."""
        self._canvas.restore_region(self._background)
        renderer = self._canvas.get_renderer()
        for part in self._parts:
            for artist in part.show(time):
                artist.draw(renderer)
        return np.asarray(self._canvas.buffer_rgba())[:, :, :3].copy()


class _Eye:
    """Picture on the screen of the operator who is driving, or else a robot's camera view.

    Args:
        ax: Axes to draw on.
        moments: The run.
        step: Display time of a picture [s].
    """

    def __init__(self, ax: Axes, moments: Moments, step: float) -> None:
        self._moments = moments
        self._step = step
        self._shown: tuple[str, float] | None = None  # which robot's picture, and of when [s]
        self._image = ax.imshow(np.zeros((240, 320, 3), np.uint8), animated=True)
        self._title = ax.set_title(" ", fontsize=style.FONT, loc="left")
        self._title.set_animated(True)
        ax.set_axis_off()
        ax.set_anchor("NW")

    def show(self, time: float) -> list[Artist]:
        """Return the picture at a moment [s]; after the end of the run its last one."""
        robots = self._moments.names(ROBOT)
        if not robots:
            return []
        time = self._moments.within(time)
        if time < self._moments.recording.duration:
            time -= time % self._step
        glance = self._moments.glance(time)
        if glance is None:
            robot = robots[0]
            captured = time
            title = f"{robots[0]}'s camera"
        else:
            robot = glance.robot
            captured = glance.captured
            title = f"{glance.operator}'s screen, {time - captured:.1f} s old"
        if self._shown != (robot, captured):
            self._image.set_data(self._moments.eye(robot, captured))
            self._shown = robot, captured
        self._title.set_text(title)
        return [self._image, self._title]


WINDOW_S = 10.0


class Traffic:
    """Messages to the robots above the line, from them below.

    Args:
        ax: Axes to draw on.
        moments: A run made with `keep_traffic`.
    """

    def __init__(self, ax: Axes, moments: Moments) -> None:
        self._moments = moments
        robots = set(moments.recording.radii)
        traffic = moments.recording.recorder.traffic or []
        up = np.array([sent.time for sent in traffic if sent.destination in robots])
        down = np.array([sent.time for sent in traffic if sent.source in robots])
        ax.set_xlim(-WINDOW_S, 0)
        ax.set_ylim(-1, 1)
        ax.set_yticks([0.5, -0.5], ["to robots", "from robots"], fontsize=style.FONT)
        ax.set_xticks([-10, -5, 0], ["10 s ago", "5 s ago", "now"], fontsize=style.FONT)
        ax.spines[["top", "right", "left"]].set_visible(False)
        ax.axhline(0, color="0.7", lw=0.6)
        ax.tick_params(length=0)
        self._strips = [
            (times, height, ax.vlines([], 0, height, color=colour, lw=0.7, animated=True))
            for times, height, colour in ((up, 0.85, "#3f90da"), (down, -0.85, "0.55"))
        ]

    def show(self, time: float) -> list[Artist]:
        """Return the strip at a moment [s]; after the end of the run its last one."""
        time = self._moments.within(time)
        for times, height, lines in self._strips:
            inside = times[(times > time - WINDOW_S) & (times <= time)] - time
            lines.set_segments([np.array([[x, 0.0], [x, height]]) for x in inside])
        return [lines for *_, lines in self._strips]
