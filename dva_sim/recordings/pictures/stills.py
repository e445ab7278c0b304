"""Single pictures of runs: one moment, a strip of moments, a robot's-eye view."""

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
    """Runs side by side at one moment [s]."""
    return _sheet(recordings, [time], len(recordings))


def strip(recordings: Sequence[Playback], times: Sequence[float]) -> Figure:
    """A run at several moments [s], from left to right and from top to bottom; of several runs
    each has a column."""
    count = len(recordings)
    # Of a single run one column or two: more would be too small to read.
    return _sheet(recordings, times, count if count > 1 else min(len(times), 2))


def best_time(recordings: Sequence[Playback]) -> float:
    """The moment that shows most [s]: of one run its end, of several when the first one is done."""
    ends = max(recording.duration for recording in recordings)
    if len(recordings) == 1:
        return ends
    first = decided_at(verdicts(recordings))
    return ends if first is None else first


def even_times(recordings: Sequence[Playback], panels: int) -> list[float]:
    """Moments spread evenly over the runs, the end among them [s]."""
    ends = max(recording.duration for recording in recordings)
    return [ends * (n + 1) / panels for n in range(panels)]


def save_eye(recording: Playback, robot: str, time: float, path: Path) -> None:
    """Write what a robot's camera sees at a moment [s], twice as large as it is sent.

    Raises:
        ConfigError: no such robot.
    """
    from PIL import Image

    Image.fromarray(Moments(recording).eye(robot, time, 640, 480)).save(path)


def check_times(recordings: Sequence[Playback], times: Sequence[float]) -> None:
    """Refuse moments that no run has.

    Raises:
        ConfigError: before the beginning or after the end.
    """
    ends = max(recording.duration for recording in recordings)
    wrong = [time for time in times if not 0 <= time <= ends]
    if wrong:
        raise ConfigError(f"--at {wrong[0]:g} is not within the run, which lasts {ends:.0f} s")


def _sheet(recordings: Sequence[Playback], times: Sequence[float], columns: int) -> Figure:
    """All runs at all moments, and a key."""
    runs = [Moments(recording) for recording in recordings]
    several, ends = len(runs) > 1, verdicts(recordings)
    panels = [(time, *each) for time in times for each in zip(runs, ends, strict=True)]
    sheet = Sheet(runs, len(panels), columns, heading_of(recordings), dpi=DPI)
    scenes = []
    for ax, (_, run, end) in zip(sheet.maps, panels, strict=True):
        title = pattern_name(run.recording) if several else sheet.title
        outlook = _outlook(end) if several and len(times) == 1 else None
        scenes.append(Scene(ax, run, end, title, outlook))
    sheet.figure.draw_without_rendering()  # names are placed when sizes are known
    for scene, (time, *_) in zip(scenes, panels, strict=True):
        scene.fix(time)
    return sheet.figure


def _outlook(verdict: RunVerdict) -> str | None:
    """Describe a run that is still in progress when another one is done."""
    return f"still under way, {verdict.text}" if verdict.text else None
