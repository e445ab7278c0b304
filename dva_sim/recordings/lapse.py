"""What figures take from a recording: the site, who was where when, hazards, what was told."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dva_sim.recordings.reading import read_recording
from dva_sim.simulation.incidents import Incident
from dva_sim.worlds.site import Site

Columns = dict[str, NDArray[Any]]


@dataclass(frozen=True)
class Lapse:
    """A run as a figure needs it.

    Attributes:
        site: Where it took place.
        tracks: A row for each sampled moment of everybody: `agent`, `t_s`, `x_m`, `y_m`,
            `heading_rad`, `mode`; in order of time for each agent.
        told: A row for each line of the story: `t_s`, `who`, `what`, `kind`.
        incidents: The hazards, with those that were reported and not there.
        contained: When incidents were dealt with [s], by their place in `incidents`.
        duration: How long the run lasted, or the file goes [s].
    """

    site: Site
    tracks: Columns
    told: Columns
    incidents: tuple[Incident, ...]
    contained: dict[int, float]
    duration: float


def read_lapse(path: Path) -> Lapse:
    """What a figure needs of a recording.

    Raises:
        ConfigError: no such file, or not a recording.
    """
    playback = read_recording(path).playback
    recorder = playback.recorder
    rows = [(name, *point) for name, track in recorder.tracks.items() for point in track]
    told = [(m.time, m.who, m.what, m.kind) for m in recorder.timeline]
    return Lapse(
        playback.site,
        _columns(rows, "agent", "t_s", "x_m", "y_m", "heading_rad", "mode"),
        _columns(told, "t_s", "who", "what", "kind"),
        tuple(playback.incidents),
        playback.contained,
        playback.duration,
    )


def _columns(rows: list[tuple[Any, ...]], *names: str) -> Columns:
    columns = list(zip(*rows, strict=True)) or [()] * len(names)
    return {name: np.array(column) for name, column in zip(names, columns, strict=True)}
