"""One run as a strip of moments on the map: a typical one, and the worst."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from dva_sim.experiments.effects import Floats, View
from dva_sim.experiments.episodes_kept import Episode, agents_of, instants, way_of
from dva_sim.experiments.figures.ground import draw_ground, frame_of, row_height, scale_bar, site_of
from dva_sim.experiments.figures.keys import key
from dva_sim.experiments.figures.numbers import Numbers
from dva_sim.experiments.figures.palette import HAZARD, INK, PAPER, Look, look_of
from dva_sim.experiments.figures.style import Drawn, finish, panels
from dva_sim.experiments.labels import (
    capital,
    measure_name,
    number,
    percent,
    quantity,
    setting,
    unit_of,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MOMENTS = 6
_ABREAST = 3
_TALL = 1.3  # height over width, from which on all moments stand abreast
_NOSE = 0.05  # length of the line that shows where an agent heads, as a share of the width
_NUMBERED = 9  # of a kind: more have no room for their numbers


def time_lapse(
    view: View, episode: Episode, scenario: Mapping[str, Any], which: str
) -> Drawn | None:
    """Where everybody was at some moments, with the way so far.

    Args:
        view: Names the measure.
        episode: The run.
        scenario: Of its part, for the site.
        which: `typical` or `worst`.
    """
    names = agents_of(episode.moments)
    ways = {name: way_of(episode.moments, name) for name in names}
    moved = {name: way for name, way in ways.items() if len(way[0])}
    if not moved:
        return None
    site = site_of(scenario)
    points = np.vstack([places[:, :2] for _, places in moved.values()])
    low, high = frame_of(np.vstack([points, *((i.x, i.y) for i in episode.incidents)]))
    size = high - low
    abreast = _MOMENTS if size[1] > _TALL * size[0] else _ABREAST
    height = row_height(size, columns=abreast)
    figure, rows = panels(_MOMENTS // abreast, abreast, height, sharex=True, sharey=True)
    nose, numbers = _NOSE * float(size[0]), Numbers()
    times, numbered = instants(episode.moments, _MOMENTS), _numbered(list(moved))
    for ax, time in zip((ax for row in rows for ax in row), times, strict=True):
        draw_ground(ax, site)
        for name, (when, places) in moved.items():
            _agent(ax, places[when <= time], look_of(kind_of(name)), nose)
            if name in numbered and (when <= time).any():
                _number(ax, name, places[when <= time][-1])
        for incident in (i for i in episode.incidents if i.start <= time):
            ax.plot(incident.x, incident.y, "X", ms=7, color=HAZARD, mec=PAPER, zorder=8)
        ax.set_title(f"{number(time)} s")
        ax.label_outer()
    for name, (when, places) in moved.items():
        x, y, heading = places.T
        told = {"t_s": when, "x_m": x, "y_m": y, "heading_rad": heading}
        numbers.add({"agent": name}, told)
    rows[0][0].set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    scale_bar(rows[-1][0], low)
    _key(figure, list(moved), len(episode.incidents) > 0)
    title = f"{capital(which)} run: {_what(view, episode)}"
    name, caption = f"time_lapse_{which}", _caption(view, episode, which)
    return finish(figure, name, title, caption, numbers, (_READS,))


def _what(view: View, episode: Episode) -> str:
    value = quantity(episode.value, unit_of(view.measure))
    where = f", {setting(episode.setting)}" if episode.setting else ""
    return f"{measure_name(view.measure)} {value}{where}"


_READS = (
    "Typical and worst run: six moments with the way so far; a nose shows where an agent heads."
)


def _caption(view: View, episode: Episode, which: str) -> str:
    chosen = {
        "typical": "nearest to the median of all runs",
        "worst": "with the largest value",
    }[which]
    return (
        f"Of the {episode.kept:,} runs whose ways were kept, the one {chosen} (person "
        f"{episode.person}, trial {episode.trial}); {percent(episode.rank)} of all "
        f"{len(view.part):,} runs have a smaller value."
        f"{' Cross: an incident, once it has begun.' if episode.incidents else ''}"
    )


def kind_of(name: str) -> str:
    """`robot-1` is a robot."""
    return name.rpartition("-")[0] or name


def _numbered(names: Sequence[str]) -> set[str]:
    """Those of whose kind there are some, but not too many to be told apart by numbers."""
    kinds = Counter(kind_of(name) for name in names)
    return {name for name in names if 1 < kinds[kind_of(name)] <= _NUMBERED}


def _key(figure: Figure, names: Sequence[str], has_incidents: bool) -> None:
    from matplotlib.lines import Line2D

    kinds = list(dict.fromkeys(kind_of(name) for name in names))
    marks = [(look_of(kind).colour, look_of(kind).mark) for kind in kinds]
    marks += [(HAZARD, "X")] * has_incidents
    handles = [Line2D([], [], color=colour, marker=mark, ls="") for colour, mark in marks]
    key(figure, handles, [*kinds, *["incident"] * has_incidents])


def _number(ax: Axes, name: str, place: Floats) -> None:
    ax.text(
        float(place[0]),
        float(place[1]),
        name.rpartition("-")[2],
        ha="center",
        va="center_baseline",
        fontsize=6,
        fontweight="bold",
        color=PAPER,
        zorder=12,
        clip_on=True,
    )


def _agent(ax: Axes, so_far: Floats, look: Look, nose: float) -> None:
    """The way so far, and where it has led."""
    if not len(so_far):
        return
    x, y, heading = so_far[-1]
    ax.plot(so_far[:, 0], so_far[:, 1], color=look.colour, lw=1.6, zorder=9)
    ax.plot(*so_far[0, :2], "o", ms=4, mfc=PAPER, mec=look.colour, mew=1.2, zorder=10)
    if np.isfinite(heading):
        ends = [x, x + nose * np.cos(heading)], [y, y + nose * np.sin(heading)]
        ax.plot(*ends, color=INK, lw=1.2, zorder=9)
    ax.plot(x, y, look.mark, ms=7, color=look.colour, mec=INK, mew=0.6, zorder=10)
