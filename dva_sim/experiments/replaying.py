"""`dva-sim replay`: a recording told and drawn from its file alone, or taken to ROS 2."""

from __future__ import annotations

from pathlib import Path

from rich.console import Console

from dva_sim.experiments import telling
from dva_sim.experiments.console import console, draw
from dva_sim.experiments.pictures import Wanted
from dva_sim.recordings import Opened, read_recording


def replay(file: Path, pictures: Wanted, ros2: Path | None, where: Console = console) -> Opened:
    """Tell the story of a recording, and draw or export what is asked for.

    Raises:
        ConfigError: not a recording, or what is asked for is not in it.
    """
    opened = read_recording(file)
    run = opened.playback
    pictures.check(run.scenario)
    telling.tell_story(run, where)
    if opened.tables is not None:
        made = f"simulated by dva-sim {opened.about['version']}"
        telling.tell_outcome(opened.tables, made, where)
    if not opened.is_whole:
        there = f"{run.duration:.0f} of {opened.lasted:.0f} s are there"
        where.print(f"[yellow]{file} was cut short: {there}[/yellow]", soft_wrap=True)
    draw(pictures, [run], where)
    if ros2 is not None:
        from dva_sim.recordings.ros2 import write_bag

        write_bag(run, ros2)
        where.print(f"ROS 2 bag: {ros2}", soft_wrap=True)
    return opened
