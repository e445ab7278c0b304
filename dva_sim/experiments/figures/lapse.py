"""One run as a strip of moments on the map: a typical one, and the worst."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from dva_sim.experiments.effects import Floats, View
from dva_sim.experiments.episodes_kept import Episode, agents_of, instants, way_of
from dva_sim.experiments.figures.ground import draw_ground, frame_of, row_height, scale_bar, site_of
from dva_sim.experiments.figures.numbers import Numbers
from dva_sim.experiments.figures.style import INK, Drawn, finish, panels
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

_MOMENTS = 6
_ABREAST = 3
_COLOURS = ("#D55E00", "#0072B2", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
_NOSE = 0.05  # length of the line that shows where an agent heads, as a share of the width


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
    low, high = frame_of(points)
    height = row_height(high - low, columns=_ABREAST)
    figure, rows = panels(_MOMENTS // _ABREAST, _ABREAST, height, sharex=True, sharey=True)
    nose = _NOSE * float(high[0] - low[0])
    times, numbers = instants(episode.moments, _MOMENTS), Numbers()
    for ax, time in zip((ax for row in rows for ax in row), times, strict=True):
        draw_ground(ax, site)
        for order, (name, (when, places)) in enumerate(moved.items()):
            _agent(ax, places[when <= time], _COLOURS[order % len(_COLOURS)], nose)
            if len(moved) > 1 and (when <= time).any():
                _name(ax, name, places[when <= time][-1])
        for incident in (i for i in episode.incidents if i.start <= time):
            ax.plot(incident.x, incident.y, "X", ms=7, color="#8a0000", mec="white", zorder=8)
        ax.set_title(f"{number(time)} s")
        ax.label_outer()
    for name, (when, places) in moved.items():
        x, y, heading = places.T
        told = {"t_s": when, "x_m": x, "y_m": y, "heading_rad": heading}
        numbers.add({"agent": name}, told)
    rows[0][0].set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    scale_bar(rows[-1][0], low)
    title = f"{capital(which)} run: {_what(view, episode)}"
    return finish(figure, f"time_lapse_{which}", title, _caption(view, episode, which), numbers)


def _what(view: View, episode: Episode) -> str:
    value = quantity(episode.value, unit_of(view.measure))
    where = f", {setting(episode.setting)}" if episode.setting else ""
    return f"{measure_name(view.measure)} {value}{where}"


def _caption(view: View, episode: Episode, which: str) -> str:
    chosen = {
        "typical": "nearest to the median of all runs",
        "worst": "with the largest value",
    }[which]
    return (
        f"Of the {episode.kept:,} runs of which the ways were kept, the one {chosen}: person "
        f"{episode.person}, trial {episode.trial}; {percent(episode.rank)} of all "
        f"{len(view.part):,} runs have a smaller value. Six moments from the first to the last; "
        "line, the way so far; dot and nose, where an agent is and heads."
        f"{' Cross: an incident, once it has begun.' if episode.incidents else ''}"
    )


def _name(ax: Axes, name: str, place: Floats) -> None:
    ax.annotate(
        name,
        (float(place[0]), float(place[1])),
        xytext=(4, 4),
        textcoords="offset points",
        fontsize=7,
        zorder=12,
    )


def _agent(ax: Axes, so_far: Floats, colour: str, nose: float) -> None:
    """The way so far, and where it has led."""
    if not len(so_far):
        return
    x, y, heading = so_far[-1]
    ax.plot(so_far[:, 0], so_far[:, 1], color=colour, lw=1.6, zorder=9)
    ax.plot(*so_far[0, :2], "o", ms=4, mfc="white", mec=colour, mew=1.2, zorder=10)
    if np.isfinite(heading):
        ends = [x, x + nose * np.cos(heading)], [y, y + nose * np.sin(heading)]
        ax.plot(*ends, color=INK, lw=1.2, zorder=11)
    ax.plot(x, y, "o", ms=5.5, color=colour, mec=INK, mew=0.6, zorder=10)
