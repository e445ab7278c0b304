"""A run from above, as moving pictures: walls, robots, guards, hazards, the operator's view.

The operator's delayed picture stands beside the truth: the robot as it is, and a ghost with
the camera's cone where the operator takes it to be.
"""

from __future__ import annotations

import math
import shutil
import subprocess
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from dva_sim.errors import ConfigError
from dva_sim.recorder import Moment, TrackPoint
from dva_sim.simulation import Recording

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FPS = 10
LENGTH_S = 18.0  # a film lasts about this long; the run is sped up to fit
TRAFFIC_WINDOW_S = 20.0
ROBOT_COLOURS = ("#3f90da", "#94a4a2", "#832db6")
GUARD_COLOUR, GHOST_COLOUR = "#2f7d32", "#e07a00"
HAZARD_COLOURS = {"fire": "#d1332e", "gas_leak": "#b59a00", "flood": "#2a7fb8"}


def write_film(recordings: Sequence[Recording], path: Path) -> Path:
    """Write one run, or several in step, to a `.gif` or `.mp4`.

    Args:
        recordings: Runs made with `keep_traffic`; shown side by side.
        path: Where to; the ending decides the form.

    Raises:
        ConfigError: see `check_path`.
    """
    check_path(path)
    film = Film(recordings)
    (_write_gif if path.suffix.lower() == ".gif" else _write_mp4)(film, path)
    return path


def check_path(path: Path) -> None:
    """Refuse a film that cannot be written, before anything is run.

    Raises:
        ConfigError: an ending that is neither, `.mp4` without ffmpeg, or no such folder.
    """
    suffix = path.suffix.lower()
    if suffix not in (".gif", ".mp4"):
        raise ConfigError(f"video should end in .gif or .mp4, not {path.name!r}")
    if suffix == ".mp4" and shutil.which("ffmpeg") is None:
        raise ConfigError("mp4 needs ffmpeg, which is not installed; use a .gif")
    if not path.parent.is_dir():
        raise ConfigError(f"folder {str(path.parent)!r} for the video does not exist")


class Film:
    """The pictures of some runs in step.

    Args:
        recordings: The runs.
    """

    def __init__(self, recordings: Sequence[Recording]) -> None:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        self.duration = max(r.duration for r in recordings)
        self.speed = max(1.0, round(self.duration / LENGTH_S))
        extent = recordings[0].site.extent
        tall = (extent[3] - extent[1]) / (extent[2] - extent[0])
        across = 8.6 if len(recordings) == 1 else 6.2
        size = across * len(recordings), (across - 0.9) * tall + 1.5
        self.figure: Figure = Figure(figsize=size, dpi=100, layout="constrained")
        canvas: Any = FigureCanvasAgg
        self._canvas = canvas(self.figure)
        grid = self.figure.add_gridspec(
            2, len(recordings), height_ratios=[(across - 0.9) * tall + 0.4, 0.6]
        )
        self._scenes = [
            Scene(r, self.figure.add_subplot(grid[0, i]), self.figure.add_subplot(grid[1, i]))
            for i, r in enumerate(recordings)
        ]
        self._canvas.draw()
        self._background = self._canvas.copy_from_bbox(self.figure.bbox)

    def frames(self) -> Iterator[np.ndarray[Any, Any]]:
        """Pictures in order, each of shape `(height, width, 3)`, 8 bits a colour."""
        count = math.ceil(self.duration / self.speed * FPS) + FPS
        for number in range(count):
            yield self.at(min(number / FPS * self.speed, self.duration))

    def at(self, time: float) -> np.ndarray[Any, Any]:
        """The picture at a moment of the run [s]."""
        self._canvas.restore_region(self._background)
        for scene in self._scenes:
            for artist in scene.show(time):
                artist.draw(self._canvas.get_renderer())
        return np.asarray(self._canvas.buffer_rgba())[:, :, :3].copy()


class Scene:
    """One run on one map, with a strip of its message traffic below."""

    def __init__(self, recording: Recording, ax: Axes, strip: Axes) -> None:
        from dva_sim.worlds.view import draw_site

        self._recording, self._ax, self._strip = recording, ax, strip
        draw_site(ax, recording.site)
        scenario = recording.scenario
        title = f"{scenario.pattern}, {scenario.link.delay_s * 1000:.0f} ms each way"
        ax.set_title(title, fontsize=11, loc="left")
        tracks = recording.recorder.tracks
        names = [n for n in tracks if n.startswith("robot")]
        self._bodies = [
            _Body(ax, recording, name, ROBOT_COLOURS[i % len(ROBOT_COLOURS)])
            for i, name in enumerate(names)
        ]
        guards = [n for n in tracks if n.startswith("guard")]
        self._bodies += [_Body(ax, recording, name, GUARD_COLOUR) for name in guards]
        self._hazards = [_HazardPatch(ax, recording, i) for i in range(len(recording.incidents))]
        self._traffic = _Traffic(strip, recording)
        self._caption = ax.text(
            0.34, -0.03, "", transform=ax.transAxes, ha="left", va="top", fontsize=9, animated=True
        )
        ax.text(
            *(1.0, -0.03), "orange: what the operator sees", transform=ax.transAxes, ha="right",
            va="top", fontsize=7.5, color=GHOST_COLOUR,
        )  # fmt: skip
        self._clock = ax.text(
            1.0, 1.015, "", transform=ax.transAxes, ha="right", va="bottom", animated=True
        )

    def show(self, time: float) -> list[Artist]:
        """Artists that change, as they are at a moment [s]."""
        artists: list[Artist] = []
        parts: list[Any] = [*self._hazards, *self._bodies, self._traffic]
        for part in parts:
            artists += part.show(time)
        self._caption.set_text(_caption(self._recording.recorder.timeline, time))
        self._clock.set_text(f"{min(time, self._recording.duration):5.1f} s")
        return [*artists, self._caption, self._clock]


class _Body:
    """A robot or guard with its trail; for a driven robot also what its operator believes."""

    def __init__(self, ax: Axes, recording: Recording, name: str, colour: str) -> None:
        from matplotlib.patches import Circle, Wedge

        self._points = recording.recorder.tracks[name]
        self._times = [p.time for p in self._points]
        robot = next((r for r in recording.robots.values() if r.device.label == name), None)
        radius = robot.body.spec.radius if robot else 0.25
        self._radius = radius
        (self._trail,) = ax.plot([], [], color=colour, lw=1.2, alpha=0.6, animated=True)
        (self._nose,) = ax.plot([], [], color="white", lw=1.6, animated=True)
        self._disc = Circle((0, 0), radius * 1.3, fc=colour, ec="black", lw=0.8, animated=True)
        ax.add_patch(self._disc)
        self._label = ax.text(0, 0, name, fontsize=7.5, ha="center", va="bottom", animated=True)
        views = recording.recorder.views.get(robot.device.id_tag, []) if robot else []
        self._views, self._view_times = views, [p.time for p in views]
        self._half = recording.scenario.camera.field_of_view_deg / 2
        self._cone = Wedge((0, 0), 2.5, 0, 1, fc=GHOST_COLOUR, ec="none", alpha=0.22, animated=True)
        self._ghost = Circle(
            (0, 0), radius * 1.3, fc="none", ec=GHOST_COLOUR, lw=1.4, ls="--", animated=True
        )
        ax.add_patch(self._cone)
        ax.add_patch(self._ghost)

    def show(self, time: float) -> list[Artist]:
        """The body at a moment [s]."""
        index = max(0, bisect_right(self._times, time) - 1)
        point = self._points[index]
        past = self._points[: index + 1]
        self._trail.set_data([p.x for p in past], [p.y for p in past])
        self._disc.center = point.x, point.y
        reach = 1.3 * self._radius
        nose = point.x + reach * math.cos(point.heading), point.y + reach * math.sin(point.heading)
        self._nose.set_data([point.x, nose[0]], [point.y, nose[1]])
        self._label.set_position((point.x, point.y + 1.6 * self._radius))
        artists: list[Artist] = [self._trail, *self._belief(time), self._disc, self._nose]
        return [*artists, self._label]

    def _belief(self, time: float) -> list[Artist]:
        """The ghost: where the operator takes the robot to be, while there is a picture."""
        index = bisect_right(self._view_times, time) - 1
        if index < 0 or time - self._view_times[index] > 3.0:
            return []
        seen: TrackPoint = self._views[index]
        self._ghost.center = seen.x, seen.y
        heading = math.degrees(seen.heading)
        self._cone.set_center((seen.x, seen.y))
        self._cone.set_theta1(heading - self._half)
        self._cone.set_theta2(heading + self._half)
        return [self._cone, self._ghost]


class _HazardPatch:
    """A hazard as it grows."""

    def __init__(self, ax: Axes, recording: Recording, number: int) -> None:
        from matplotlib.patches import Circle

        self._incident = recording.incidents[number]
        self._position = self._incident.hazard.position
        self._over = recording.contained.get(number, math.inf)
        colour = HAZARD_COLOURS[self._incident.kind]
        self._area = Circle(self._position, 0.0, fc=colour, ec=colour, alpha=0.35, animated=True)
        ax.add_patch(self._area)
        (self._mark,) = ax.plot(
            *([p] for p in self._position), marker="*", ms=11, color=colour, mec="white",
            animated=True, zorder=6,
        )  # fmt: skip

    def show(self, time: float) -> list[Artist]:
        """The hazard at a moment [s]."""
        if not self._incident.is_there(time) or time >= self._over:
            return []
        self._area.set_radius(max(0.15, self._incident.hazard.radius(time)))
        return [self._area, self._mark]


class _Traffic:
    """Messages of the last seconds: to the robots above the line, from them below."""

    def __init__(self, ax: Axes, recording: Recording) -> None:
        robots = set(recording.robots)
        traffic = recording.recorder.traffic or []
        self._up = np.array([t for t, _, to, _ in traffic if to in robots])
        self._down = np.array([t for t, source, _, _ in traffic if source in robots])
        ax.set_xlim(-TRAFFIC_WINDOW_S, 0)
        ax.set_ylim(-1, 1)
        ax.set_yticks([0.5, -0.5], ["to robots", "from robots"], fontsize=7.5)
        ax.set_xticks([-20, -10, 0], ["20 s ago", "10 s ago", "now"], fontsize=7.5)
        ax.spines[["top", "right", "left"]].set_visible(False)
        ax.axhline(0, color="0.7", lw=0.6)
        ax.tick_params(length=0)
        self._lines = [
            ax.vlines([], 0, height, color=colour, lw=0.7, animated=True)
            for height, colour in ((0.85, "#3f90da"), (-0.85, "0.55"))
        ]

    def show(self, time: float) -> list[Artist]:
        """The strip at a moment [s]."""
        for lines, times, height in zip(
            self._lines, (self._up, self._down), (0.85, -0.85), strict=True
        ):
            inside = times[(times > time - TRAFFIC_WINDOW_S) & (times <= time)] - time
            lines.set_segments([np.array([[x, 0.0], [x, height]]) for x in inside])
        return list(self._lines)


def _caption(timeline: Sequence[Moment], time: float) -> str:
    """The newest line of the story."""
    told = [m for m in timeline if m.time <= time and m.kind != "link"]
    return f"{told[-1].who} {told[-1].what}" if told else ""


def _write_gif(film: Film, path: Path) -> None:
    from PIL import Image

    pictures = [Image.fromarray(frame) for frame in film.frames()]
    # One palette, from a picture with all colours on stage, keeps the file small.
    palette = pictures[len(pictures) // 2].quantize(128, Image.Quantize.MAXCOVERAGE)
    reduced = [p.quantize(palette=palette, dither=Image.Dither.NONE) for p in pictures]
    reduced[0].save(
        path, save_all=True, append_images=reduced[1:], duration=1000 // FPS, loop=0, optimize=True
    )


def _write_mp4(film: Film, path: Path) -> None:
    height, width = film.at(0.0).shape[:2]
    command = ["ffmpeg", "-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24"]
    command += ["-s", f"{width}x{height}", "-r", str(FPS), "-i", "-"]
    command += ["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p", str(path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE) as process:
        assert process.stdin is not None
        for frame in film.frames():
            process.stdin.write(frame.tobytes())
        process.stdin.close()
    if process.returncode != 0:
        raise ConfigError("ffmpeg could not write the video", path)
