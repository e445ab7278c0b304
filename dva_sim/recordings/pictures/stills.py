"""Single pictures of runs: one moment, or a robot's-eye view."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from matplotlib.figure import Figure

from dva_sim.kernel.errors import ConfigError
from dva_sim.recordings.pictures.moments import Moments
from dva_sim.recordings.pictures.picture_layout import Sheet, heading_of
from dva_sim.recordings.pictures.run_endings import RunVerdict, decided_at, pattern_name, verdicts
from dva_sim.recordings.pictures.scene import Scene
from dva_sim.simulation.full import Playback

DPI = 200


def still(recordings: Sequence[Playback], time: float) -> Figure:
    """Draw runs side by side at one moment [s], and a key."""
    runs = [Moments(recording) for recording in recordings]
    several = len(runs) > 1
    ends = verdicts(recordings)
    sheet = Sheet(runs, len(runs), len(runs), heading_of(recordings), dpi=DPI)
    scenes = []
    for ax, run, end in zip(sheet.maps, runs, ends, strict=True):
        title = pattern_name(run.recording) if several else sheet.title
        scenes.append(Scene(ax, run, end, title, _outlook(end) if several else None))
    sheet.figure.draw_without_rendering()  # names are placed when sizes are known
    for scene in scenes:
        scene.fix(time)
    return sheet.figure


def time_of_still(recordings: Sequence[Playback], at: float | None) -> float:
    """Return the moment to draw [s].

    By default, of one run its end, of several the moment when the first one is done.

    Raises:
        ConfigError: a moment before the beginning or after the end of all runs.
    """
    ends = max(recording.duration for recording in recordings)
    if at is not None:
        if not 0 <= at <= ends:
            raise ConfigError(f"--at {at:g} is not within the run, which lasts {ends:.0f} s")
        return at
    first = decided_at(verdicts(recordings)) if len(recordings) > 1 else None
    return ends if first is None else first


def save_eye(recording: Playback, robot: str, time: float, path: Path) -> None:
    """Write the picture of a robot's camera at a moment [s], twice as large as it is sent.

    Raises:
        ConfigError: no such robot.
    """
    from PIL import Image

    Image.fromarray(Moments(recording).eye(robot, time, 640, 480)).save(path)


def _outlook(verdict: RunVerdict) -> str | None:
    """Describe a run that is still in progress when another one is done."""
    return f"still under way, {verdict.text}" if verdict.text else None
