"""The messages of the last seconds, as a strip below the map.

A run from above as moving pictures, or several runs in step.

Writing films: GIF by Pillow, MP4 by ffmpeg; a film that fails leaves no half file.
"""

from __future__ import annotations

import math
import shutil
import subprocess
from collections.abc import Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO, Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from numpy.typing import NDArray
from PIL import Image, ImageColor

from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.whole_files import whole
from dva_sim.recordings.pictures import style
from dva_sim.recordings.pictures.colours import ROBOT
from dva_sim.recordings.pictures.moments import Moments
from dva_sim.recordings.pictures.run_endings import pattern_name, verdicts
from dva_sim.recordings.pictures.scene import Scene
from dva_sim.recordings.pictures.style import Sheet, heading_of
from dva_sim.simulation.full import Playback

WINDOW_S = 10.0


class Traffic:
    """Messages to the robots above the line, from them below.

    Args:
        ax: Where.
        moments: A run made with `keep_traffic`.
    """

    def __init__(self, ax: Axes, moments: Moments) -> None:
        self._moments, robots = moments, set(moments.recording.radii)
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
        """The strip at a moment [s]; after the end of the run its last one."""
        time = self._moments.within(time)
        for times, height, lines in self._strips:
            inside = times[(times > time - WINDOW_S) & (times <= time)] - time
            lines.set_segments([np.array([[x, 0.0], [x, height]]) for x in inside])
        return [lines for *_, lines in self._strips]


FPS = 8
LENGTH_S = 16.0  # a film lasts about this long; the run is sped up to fit
HELD_S = 3.0  # so long does its last picture stand
GLANCES = 2  # pictures of a camera that a film shows in a second: more are no easier to follow
DPI = 100
TRAFFIC, EYE = 0.8, 1.5  # heights of what is below maps, without a camera's picture and with it
# What is there: its place from the left and from the top, its width and height, as shares.
ALONE, STRIP, SCREEN = (0.18, 0.0, 0.79, 0.68), (0.62, 0.12, 0.35, 0.65), (0.02, 0.12, 0.4, 0.84)


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
        heading = f"{heading_of(recordings)}{_shown_at(self.speed)}"
        sheet = Sheet(runs, len(runs), len(runs), heading, EYE if inset else TRAFFIC, DPI)
        self.figure = sheet.figure
        self._parts: list[Any] = []
        scenes: list[Scene] = []
        for column, (run, end) in enumerate(zip(runs, verdicts(recordings), strict=True)):
            title = sheet.title or pattern_name(run.recording)
            scenes.append(Scene(sheet.maps[column], run, end, title))
            self._parts.append(Traffic(sheet.below(column, *(STRIP if inset else ALONE)), run))
            if inset:
                eye = sheet.below(column, *SCREEN)
                self._parts.append(_Eye(eye, run, self.speed / GLANCES))
        self._parts += scenes
        canvas: Any = self.figure.canvas
        canvas.draw()
        for scene in scenes:
            scene.freeze(canvas)
        self._canvas, self._background = canvas, canvas.copy_from_bbox(self.figure.bbox)

    def __len__(self) -> int:
        return math.ceil(self.duration / self.speed * FPS) + round(HELD_S * FPS)

    def frames(self) -> Iterator[NDArray[np.uint8]]:
        """Pictures in order, each of shape `(height, width, 3)`."""
        moving = math.ceil(self.duration / self.speed * FPS)
        for number in range(moving):
            yield self.at(number / FPS * self.speed)
        yield from [self.at(self.duration)] * (len(self) - moving)

    def at(self, time: float) -> NDArray[np.uint8]:
        """The picture at a moment of the run [s]."""
        self._canvas.restore_region(self._background)
        renderer = self._canvas.get_renderer()
        for part in self._parts:
            for artist in part.show(time):
                artist.draw(renderer)
        return np.asarray(self._canvas.buffer_rgba())[:, :, :3].copy()


def _shown_at(speed: float) -> str:
    return f"; shown {speed:g} times as fast" if speed > 1 else ""


class _Eye:
    """What the operator at the wheel sees on the screen, or else what a robot sees now.

    Args:
        ax: Where.
        moments: The run.
        step: How long a picture stands [s].
    """

    def __init__(self, ax: Axes, moments: Moments, step: float) -> None:
        self._moments, self._step = moments, step
        self._shown: tuple[str, float] | None = None  # which robot's picture, and of when [s]
        self._image = ax.imshow(np.zeros((240, 320, 3), np.uint8), animated=True)
        self._title = ax.set_title(" ", fontsize=style.FONT, loc="left")
        self._title.set_animated(True)
        ax.set_axis_off()
        ax.set_anchor("NW")

    def show(self, time: float) -> list[Artist]:
        """The picture at a moment [s]; after the end of the run its last one."""
        robots = self._moments.names(ROBOT)
        if not robots:
            return []
        time = self._moments.within(time)
        if time < self._moments.recording.duration:
            time -= time % self._step
        glance = self._moments.glance(time)
        if glance is None:
            robot, captured, title = robots[0], time, f"{robots[0]}'s camera"
        else:
            robot, captured = glance.robot, glance.captured
            title = f"{glance.operator}'s screen, {time - captured:.1f} s old"
        if self._shown != (robot, captured):
            self._image.set_data(self._moments.eye(robot, captured))
            self._shown = robot, captured
        self._title.set_text(title)
        return [self._image, self._title]


COLOURS = 112  # of a GIF
ALIKE = 8  # a colour that differs less from the last picture's stays as it was, of 255
SAMPLES = 6  # pictures that these are chosen from


def write_film(film: Film, path: Path) -> None:
    """Write a film; the ending of `path` decides the form.

    Raises:
        ConfigError: ffmpeg is missing or failed.
    """
    with whole(path) as part:
        (_write_gif if path.suffix.lower() == ".gif" else _write_mp4)(film, part)


def find_ffmpeg() -> str:
    """Path of ffmpeg: the one of the `imageio-ffmpeg` package, or else of the system.

    Raises:
        ConfigError: there is none.
    """
    try:
        import imageio_ffmpeg
    except ImportError:
        found = shutil.which("ffmpeg")
    else:
        found = imageio_ffmpeg.get_ffmpeg_exe()
    if found is None:
        raise ConfigError(
            "mp4 needs ffmpeg: pip install 'dva-sim[video]', or install ffmpeg, or write a .gif"
        )
    return found


def _write_gif(film: Film, path: Path) -> None:
    # One palette, from pictures spread over the run, keeps the file small.
    times = [film.duration * (n + 1) / SAMPLES for n in range(SAMPLES)]
    samples = [Image.fromarray(film.at(time)) for time in times]
    sheet = Image.new("RGB", (samples[0].width, samples[0].height * SAMPLES))
    for number, sample in enumerate(samples):
        sheet.paste(sample, (0, number * sample.height))
    most = COLOURS - len(style.SMALL)
    common = sheet.quantize(most, Image.Quantize.MEDIANCUT).getpalette() or []
    # Few pixels show a robot: left to chance, its colour would be lost.
    palette = Image.new("P", (1, 1))
    palette.putpalette(common[: 3 * most] + [v for c in style.SMALL for v in ImageColor.getrgb(c)])
    pictures = [
        Image.fromarray(frame).quantize(palette=palette, dither=Image.Dither.NONE)
        for frame in _steady(film.frames())
    ]
    pictures[0].save(
        path, save_all=True, append_images=pictures[1:], duration=1000 // FPS, loop=0, optimize=True
    )


def _steady(frames: Iterator[NDArray[np.uint8]]) -> Iterator[NDArray[np.uint8]]:
    """Pictures that change only where one can see it: what stays the same takes no room."""
    shown = next(frames)
    yield shown
    for frame in frames:
        red, green, blue = np.moveaxis(np.abs(frame.astype(np.int16) - shown) >= ALIKE, 2, 0)
        shown = np.where((red | green | blue)[:, :, None], frame, shown)
        yield shown


def _write_mp4(film: Film, path: Path) -> None:
    frames = film.frames()
    first = next(frames)
    command = [find_ffmpeg(), "-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24"]
    command += ["-s", f"{first.shape[1]}x{first.shape[0]}", "-r", str(FPS), "-i", "-"]
    # Most players want an even number of pixels and this order of colours.
    command += ["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2:color=white", "-c:v", "libx264"]
    command += ["-crf", "20", "-pix_fmt", "yuv420p", "-movflags", "+faststart", str(path)]
    with TemporaryFile() as said:
        process = subprocess.Popen(command, stdin=subprocess.PIPE, stderr=said)
        try:
            _feed(process, first.tobytes(), frames)
        finally:
            process.kill()  # where it has ended already, that does nothing
            process.wait()
        if process.returncode != 0:
            raise ConfigError(f"ffmpeg could not write the video: {_last_line(said, process)}")


def _feed(process: subprocess.Popen[bytes], first: bytes, frames: Iterator[Any]) -> None:
    """Hand over all pictures; a pipe that breaks shows in how ffmpeg ended."""
    pipe = process.stdin
    assert pipe is not None
    try:
        with pipe:
            pipe.write(first)
            for frame in frames:
                pipe.write(frame.tobytes())
    except BrokenPipeError:
        pass
    process.wait()


def _last_line(said: IO[bytes], process: subprocess.Popen[bytes]) -> str:
    said.seek(0)
    lines = said.read().decode(errors="replace").strip().splitlines()
    if lines:
        return lines[-1]
    return f"it ended with {process.returncode}; a negative number is the signal that killed it"
