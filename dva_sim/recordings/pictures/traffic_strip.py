"""The messages of the last seconds, as a strip below the map."""

from __future__ import annotations

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes

from dva_sim.recordings.pictures import style
from dva_sim.recordings.pictures.moments import Moments

WINDOW_S = 10.0


class Traffic:
    """Messages to the robots above the line, from them below.

    Args:
        ax: Axes to draw on.
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
