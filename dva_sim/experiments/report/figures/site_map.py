"""The site from above, with the ways that robots took.

One run as a strip of moments on the map: a typical one, and the worst.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from dva_sim.experiments.analysis.kept_episodes import (
    KeptEpisode,
    SeenIncident,
    agents_of,
    instants,
    way_of,
)
from dva_sim.experiments.analysis.run_grid import Floats, Table, as_floats, codes_of
from dva_sim.experiments.analysis.study_view import StudyView
from dva_sim.experiments.report.figures.palette import (
    HAZARD,
    INK,
    PAPER,
    SOFT,
    Look,
    colours,
    key,
    look_of,
)
from dva_sim.experiments.report.figures.style import (
    ASIDE,
    WIDTH,
    Drawn,
    Numbers,
    ReportFigure,
    panels,
    stop_of,
    wrapped,
)
from dva_sim.experiments.report.prose import caption
from dva_sim.experiments.study.parts import POINT, Level
from dva_sim.kernel.errors import DvaSimError
from dva_sim.kernel.units import unit_of
from dva_sim.kernel.wording import capital, number, quantity
from dva_sim.simulation import scenario as scenes
from dva_sim.simulation.labels import factor_name, level_name, measure_name, setting

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from dva_sim.experiments.report.summary import Reading
    from dva_sim.worlds.site import Site


_ABREAST, _MOST = 4, 7  # panels, if they are broad or high
_TITLE = 76  # characters of titles that stand abreast
_MARGIN = 2.5  # [m] around everything driven
_BAR = 5.0  # [m]


class Trajectories(ReportFigure):
    """One person, one trial: the ways taken under each line, at the first and the last stop."""

    name = "trajectories"
    title = "Ways taken"
    pages = ("driving",)
    tables = ("runs", "tracks")

    def draw(self, view: StudyView, reading: Reading) -> Drawn | None:
        """Draw it."""
        tracks, scenario = reading.table("tracks"), reading.scenario_of(view.part.name)
        ways = DrivenWays(tracks, view)
        if not ways:
            return None
        stops = list(dict.fromkeys((view.stops[0], view.stops[-1])))
        site, aside = site_of(scenario), ways.reference()
        low, high = frame_of(ways.all_points)
        size, count = high - low, len(view.lines)
        abreast = min(count, _MOST if size[1] > size[0] else _ABREAST)
        deep = -(-count // abreast)
        height = row_height(size, columns=abreast)
        figure, axes = panels(deep * len(stops), abreast, height, sharex=True, sharey=True)
        paint, numbers = colours(view.line), Numbers()
        for index, stop in enumerate(stops):
            block = [ax for row in axes[index * deep : (index + 1) * deep] for ax in row]
            for ax, level in zip(block, view.lines, strict=False):
                draw_ground(ax, site)
                for way in aside:
                    ax.plot(*way.T, color=SOFT, lw=1.3, ls=(0, (3, 2)), zorder=8)
                for way in ways.under(level, stop):
                    _way(ax, way, paint[level])
                    where = view.setting(view.panels[0], level) | stop_of(view, stop)
                    numbers.add(where, {"x_m": way[:, 0], "y_m": way[:, 1]})
                ax.set_title(wrapped(_heading(view, level, stop), _TITLE // abreast), fontsize=8.5)
                ax.label_outer()
            for ax in block[count:]:
                ax.set_visible(False)
        axes[0][0].set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
        scale_bar(axes[-1][0], low)
        words = caption("trajectories", has_reference=bool(aside), has_site=site is not None)
        within = f" ({setting(view.panels[0])})" if view.panels[0] else ""
        return self.finish(figure, words, numbers, title=f"Ways taken{within}")


class DrivenWays:
    """Tracks of one person and trial, picked by what they were driven under."""

    def __init__(self, tracks: Table, view: StudyView) -> None:
        self._view = view
        rows = {key: np.asarray(values) for key, values in tracks.items()}
        here = (rows["part"] == view.part.name) & np.isfinite(rows["x_m"].astype(float))
        self._part = _first_trial({key: values[here] for key, values in rows.items()})

    def __bool__(self) -> bool:
        return len(self._part["x_m"]) > 0

    @property
    def all_points(self) -> Floats:
        """Every point of every way `(n, 2)` [m]."""
        return _points(self._part)

    def reference(self) -> list[Floats]:
        """Ways of the reference run, one `(n, 2)` for each agent that moved."""
        return self._moved(self._part["is_reference"].astype(bool))

    def under(self, line: Level, stop: Level) -> list[Floats]:
        """Ways under one line and stop, in the panel the answer speaks of."""
        view = self._view
        wanted = view.setting(view.panels[0], line) | stop_of(view, stop)
        mask = ~self._part["is_reference"].astype(bool)
        for factor in view.part.factors:
            mask &= codes_of(self._part, factor) == factor.levels.index(wanted[factor.name])
        return self._moved(mask)

    def _moved(self, mask: NDArray[np.bool_]) -> list[Floats]:
        ways = []
        for agent in np.unique(self._part["agent"][mask].astype(str)):
            mine = mask & (self._part["agent"].astype(str) == agent)
            order = np.argsort(self._part["t_s"][mine], kind="stable")
            way = _points(self._part)[mine][order]
            if len(way) > 1 and np.ptp(way, axis=0).max() > 0.5:
                ways.append(way)
        return ways


def _first_trial(rows: Table) -> Table:
    if not len(rows["person"]):
        return rows
    first = np.ones(len(rows["person"]), dtype=bool)
    for name in ("person", "trial", POINT):
        if name in rows:
            values = as_floats(rows[name])  # a reference run has no point: it is that of all
            first &= (values == np.nanmin(values[first])) | np.isnan(values)
    return {key: values[first] for key, values in rows.items()}


def _points(rows: Table) -> Floats:
    return np.column_stack([rows["x_m"], rows["y_m"]]).astype(float)


def site_of(scenario: Mapping[str, Any]) -> Site | None:
    """The site, or None where its files are not to be had; the ways are shown all the same."""
    try:
        return scenes.site_of(scenes.build(scenario), seed=0)
    except DvaSimError:
        return None


def draw_ground(ax: Axes, site: Site | None) -> None:
    """The plan of the site; axes in metres where its files are not to be had."""
    ax.set_aspect("equal")
    ax.grid(False)
    if site is None:
        ax.set_xlabel("x (east) [m]")
        ax.set_ylabel("y (north) [m]")
        return
    from dva_sim.worlds.view import draw_site  # late: start-up

    draw_site(ax, site, labels=False, scale=False)
    for artist in (*ax.lines, *ax.patches, *ax.collections):
        artist.set_label(ASIDE)


def _way(ax: Axes, way: Floats, colour: str) -> None:
    ax.plot(*way.T, color=colour, lw=1.8, zorder=9)
    ax.plot(*way[0], "o", ms=5, mfc=PAPER, mec=colour, mew=1.4, zorder=10)
    ax.plot(*way[-1], "o", ms=5, color=colour, zorder=10)


def frame_of(points: Floats) -> tuple[Floats, Floats]:
    """Lower left and upper right corner of what is worth seeing [m]."""
    return points.min(axis=0) - _MARGIN, points.max(axis=0) + _MARGIN


def row_height(size: Floats, columns: int) -> float:
    """Height of a row of panels that are as wide as there is room for [in]."""
    return float(np.clip(WIDTH / columns * size[1] / size[0] + 0.3, 1.2, 5.0))


def scale_bar(ax: Axes, corner: Floats) -> None:
    """Five metres, in the lower left corner."""
    x, y = corner + 0.8
    ax.plot([x, x + _BAR], [y, y], color=INK, lw=2, solid_capstyle="butt", zorder=11, label=ASIDE)
    ax.annotate(
        f"{_BAR:g} m", (x, y), xytext=(0, 3), textcoords="offset points", fontsize=7.5, zorder=11
    )


def _heading(view: StudyView, line: Level, stop: Level) -> str:
    words = [level_name(view.line.name, line, short=True)] if view.line else []
    if view.over:
        words.append(f"{factor_name(view.over.name)} {level_name(view.over.name, stop)}")
    return ", ".join(words)


_MOMENTS = 6
_STRIPS_ABREAST = 3
_TALL = 1.3  # height over width, from which on all moments stand abreast
_NOSE = 0.05  # length of the line that shows where an agent heads, as a share of the width
_NUMBERED = 9  # of a kind: more have no room for their numbers


class _TimeLapse(ReportFigure):
    """Where everybody was at some moments of one run, with the way so far.

    Attributes:
        which: Of the runs that were kept.
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
            scenario: Of its part, for the site.
        """
        names = agents_of(episode.moments)
        ways = {name: way_of(episode.moments, name) for name in names}
        moved = {name: way for name, way in ways.items() if len(way[0])}
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
        times, numbered = instants(episode, _MOMENTS), _numbered(list(moved))
        for ax, time in zip((ax for row in rows for ax in row), times, strict=True):
            draw_ground(ax, site)
            for name, (when, places) in moved.items():
                so_far = _until(when, places, time)
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
            told = {"t_s": when, "x_m": x, "y_m": y, "heading_rad": heading}
            numbers.add({"agent": name}, told)
        rows[0][0].set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
        scale_bar(rows[-1][0], low)
        _key(figure, list(moved), any(not i.room for i in episode.incidents))
        title = f"{capital(self.which)} run {_OF_ALL[self.which]}: {_what(view, episode)}"
        words = caption("time_lapse", episode=episode, which=self.which, runs=len(view.part))
        return self.finish(figure, words, numbers, title=title, reads=(_READS,))


class TypicalRun(_TimeLapse):
    """The run in the middle."""

    name = "time_lapse_typical"
    title = "A typical run"
    which = "typical"


class WorstRun(_TimeLapse):
    """The run that took most."""

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


def _until(when: Floats, places: Floats, time: float) -> Floats:
    """The way up to a moment, the last step as far as it was gone `(n, 3)`."""
    so_far, after = places[when <= time], places[when > time]
    if not len(so_far) or not len(after) or when[len(so_far) - 1] == time:
        return so_far
    before, following = when[len(so_far) - 1], when[len(so_far)]
    x, y, heading = so_far[-1]
    dx, dy = (after[0, :2] - (x, y)) * (time - before) / (following - before)
    return np.vstack([so_far, (x + dx, y + dy, heading)])


def _place_of(incident: SeenIncident, site: Site | None) -> tuple[float, float]:
    """Where it is [m]; of one whose room alone is known, a place in that, for its name."""
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
