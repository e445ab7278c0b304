"""One run as a strip of moments on the map: a typical one, and the worst."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np

from dva_sim.experiments.analysis.kept_episodes import (
    KeptEpisode,
    SeenIncident,
    agents_of,
    instants,
    way_of,
)
from dva_sim.experiments.analysis.run_grid import Floats
from dva_sim.experiments.analysis.study_view import StudyView
from dva_sim.experiments.report.figures.csv_numbers import Numbers
from dva_sim.experiments.report.figures.legend import key
from dva_sim.experiments.report.figures.map_background import (
    draw_ground,
    frame_of,
    row_height,
    scale_bar,
    site_of,
)
from dva_sim.experiments.report.figures.palette import HAZARD, INK, PAPER, Look, look_of
from dva_sim.experiments.report.figures.style import ASIDE, Drawn, ReportFigure, panels
from dva_sim.experiments.report.prose import caption
from dva_sim.kernel.units import unit_of
from dva_sim.kernel.wording import capital, number, percent, quantity
from dva_sim.simulation.labels import measure_name, setting

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from dva_sim.experiments.report.summary import Reading
    from dva_sim.worlds.site import Site


_MOMENTS = 6


_STRIPS_ABREAST = 3


_TALL = 1.3  # height over width, from which on all moments stand abreast


_NOSE = 0.05  # length of the line that shows where an agent heads, as a share of the width


_NUMBERED = 9  # of a kind: more have no room for their numbers


class _TimeLapse(ReportFigure):
    """Positions and paths of all agents at some moments of one run.

    Attributes:
        which: Choice among the kept runs.
    """

    pages = ("driving",)
    which: ClassVar[Literal["typical", "worst"]]

    def draw(self, view: StudyView, reading: Reading) -> Drawn | None:
        """Draw it."""
        if reading.episodes is None:
            return None
        typical, worst = reading.episodes
        episode = typical if self.which == "typical" else worst
        return self.drawn(view, episode, reading.scenario_of(view.part.name))

    def drawn(
        self, view: StudyView, episode: KeptEpisode, scenario: Mapping[str, Any]
    ) -> Drawn | None:
        """The figure of a run; None where nobody moved in it.

        Args:
            view: Names the measure.
            episode: The run.
            scenario: Scenario of its part, which names the site.
        """
        names = agents_of(episode.moments)
        ways = {name: way_of(episode.moments, name) for name in names}
        times = instants(episode, _MOMENTS)
        moved = {name: _with(times, *way) for name, way in ways.items() if len(way[0])}
        if not moved:
            return None
        site = site_of(scenario)
        points = np.vstack([places[:, :2] for _, places in moved.values()])
        incidents = [(i, *_place_of(i, site)) for i in episode.incidents]
        known = [(x, y) for _, x, y in incidents if math.isfinite(x)]
        low, high = frame_of(np.vstack([points, *known]))
        size = high - low
        abreast = _MOMENTS if size[1] > _TALL * size[0] else _STRIPS_ABREAST
        height = row_height(size, columns=abreast)
        figure, rows = panels(_MOMENTS // abreast, abreast, height, sharex=True, sharey=True)
        nose, numbers = _NOSE * float(size[0]), Numbers()
        numbered = _numbered(list(moved))
        for ax, time in zip((ax for row in rows for ax in row), times, strict=True):
            draw_ground(ax, site)
            for name, (when, places) in moved.items():
                so_far = places[when <= time]
                _agent(ax, so_far, look_of(kind_of(name)), nose)
                if name in numbered and len(so_far):
                    _number(ax, name, so_far[-1])
            for incident, x, y in incidents:
                if incident.start <= time and math.isfinite(x):
                    _incident(ax, incident, x, y)
            ax.set_title(_clock(episode, time))
            ax.label_outer()
        for name, (when, places) in moved.items():
            x, y, heading = places.T
            columns = {"t_s": when, "x_m": x, "y_m": y, "heading_rad": heading}
            numbers.add({"agent": name}, columns)
        rows[0][0].set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
        scale_bar(rows[-1][0], low)
        _key(figure, list(moved), any(not i.room for i in episode.incidents))
        title = f"{capital(self.which)} run {_OF_ALL[self.which]}: {_what(view, episode)}"
        words = caption(
            "time_lapse",
            episode=episode,
            is_typical=self.which == "typical",
            kept=f"{episode.kept:,}",
            smaller=percent(episode.rank),
            runs=f"{len(view.part):,}",
        )
        return self.finish(figure, words, numbers, title=title, reads=(_READS,))


class TypicalRun(_TimeLapse):
    name = "time_lapse_typical"
    title = "A typical run"
    which = "typical"


class WorstRun(_TimeLapse):
    name = "time_lapse_worst"
    title = "The worst run"
    which = "worst"


def _clock(episode: KeptEpisode, time: float) -> str:
    """`30.0 s`, as the measure counts where it is a time; the last with what ended it."""
    span = episode.span
    if span is None:
        return f"{number(time)} s"
    end = f": {span.by}" if time >= span.ends else ""
    return f"{number(time - span.begins)} s{end}"


def _with(times: Sequence[float], when: Floats, places: Floats) -> tuple[Floats, Floats]:
    """A way with its places at some moments between its samples, too: on the line between them."""
    more = [t for t in times if when[0] < t < when[-1] and t not in when]
    last = np.searchsorted(when, more, side="right") - 1  # a heading holds until the next one
    between = [np.interp(more, when, places[:, i]) for i in (0, 1)]
    every = np.concatenate([when, more])
    order = np.argsort(every, kind="stable")
    added = np.column_stack([*between, places[last, 2]])
    return every[order], np.vstack([places, added])[order]


def _place_of(incident: SeenIncident, site: Site | None) -> tuple[float, float]:
    """Position of an incident [m]; the middle of its room if only the room is known."""
    if not incident.room or site is None:
        return incident.x, incident.y
    boxes = [room.box for room in site.rooms if room.name == incident.room]
    if not boxes:
        return incident.x, incident.y
    left, bottom, right, top = boxes[0]
    return (left + right) / 2, (bottom + top) / 2


def _incident(ax: Axes, incident: SeenIncident, x: float, y: float) -> None:
    """Its kind, beside a cross where its place is known, else in its room."""
    words: dict[str, Any] = {"fontsize": 7, "color": HAZARD, "zorder": 8, "clip_on": True}
    if incident.room:
        ax.text(x, y, f"{incident.kind}\nin here", ha="center", va="center", **words)
        return
    ax.plot(x, y, "X", ms=7, color=HAZARD, mec=PAPER, zorder=8)
    ax.annotate(incident.kind, (x, y), xytext=(5, 3), textcoords="offset points", **words)


def _what(view: StudyView, episode: KeptEpisode) -> str:
    value = quantity(episode.value, unit_of(view.measure))
    where = f", {setting(episode.setting)}" if episode.setting else ""
    return f"{measure_name(view.measure)} {value}{where}"


_OF_ALL = {
    "typical": "(nearest to the median over all configurations)",
    "worst": "of all configurations",
}


_READS = (
    "Typical and worst run: six moments with the way so far; a nose shows where an agent heads. "
    "Where the measure is a time, they count from where it does, and the last is where it ends; "
    "else they are times of the run."
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
        ax.plot(*ends, color=INK, lw=1.2, zorder=9, label=ASIDE)
    ax.plot(x, y, look.mark, ms=7, color=look.colour, mec=INK, mew=0.6, zorder=10)
