"""`dva-sim episode` and `replay`: a run played or read, told, drawn and kept."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from rich.console import Console

from dva_sim.cli.console import console, warn
from dva_sim.cli.stories import tell, tell_outcome, tell_side_by_side, tell_story
from dva_sim.experiments.report.episode import EpisodeRequest, doubts, open_recording, write_replay
from dva_sim.recordings.pictures import Wanted
from dva_sim.simulation.full import Recording

PART = ".part"  # what a live run leaves whose supervisor was killed


def episode(request: EpisodeRequest, where: Console = console) -> None:
    """Play what is asked for, tell it, and write its files.

    Raises:
        ConfigError: it cannot be played, drawn or kept.
    """
    asked = request.scenarios()
    warn(doubts(asked), where)
    runs = []
    for scenario in asked:
        runs.append(request.play(scenario))
        tell(runs[-1], where)
    if len(runs) > 1:
        tell_side_by_side([run.kept for run in runs if isinstance(run.kept, Recording)], where)
    _say_written(request.write(runs), request.pictures, where)


def replay(file: Path, pictures: Wanted, ros2: Path | None, where: Console = console) -> None:
    """Tell the story of a recording, and draw or export what is asked for.

    Raises:
        ConfigError: not a recording, or what is asked for is not in it.
    """
    if file.suffix == PART:
        from dva_sim.live.recording import finish  # late: start-up

        file, part = file.with_suffix(""), file
        finish(part, file, own_code=False)
        where.print(f"{file} made of {part}", soft_wrap=True)
    opened = open_recording(file, pictures)
    run = opened.playback
    tell_story(run, where)
    if opened.tables is not None:
        tell_outcome(opened.tables, f"simulated by dva-sim {opened.about['version']}", where)
    if not opened.is_whole:
        there = f"{run.duration:.0f} of {opened.lasted:.0f} s are there"
        where.print(f"[yellow]{file} was cut short: {there}[/yellow]", soft_wrap=True)
    _say_written(write_replay(opened, pictures, ros2), pictures, where)


def _say_written(files: Iterable[str], pictures: Wanted, where: Console) -> None:
    """Write files, and say where they are."""
    if pictures.any:
        with where.status("Drawing ..."):
            files = list(files)
    for line in files:
        where.print(line, soft_wrap=True)
