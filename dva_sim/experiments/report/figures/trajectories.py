"""Paths that robots took, on the map of the site."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dva_sim.experiments.analysis.run_grid import Floats, Table, as_floats, codes_of
from dva_sim.experiments.analysis.study_view import StudyView
from dva_sim.experiments.report.figures.csv_numbers import Numbers
from dva_sim.experiments.report.figures.map_background import (
    draw_ground,
    frame_of,
    row_height,
    scale_bar,
    site_of,
)
from dva_sim.experiments.report.figures.palette import PAPER, SOFT, colours
from dva_sim.experiments.report.figures.style import Drawn, ReportFigure, panels, stop_of, wrapped
from dva_sim.experiments.report.prose import caption
from dva_sim.experiments.study.parts import POINT, Level
from dva_sim.simulation.labels import factor_name, level_name, setting

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from dva_sim.experiments.report.summary import Reading


_ABREAST, _MOST = 4, 7  # panels, if they are broad or high
_TITLE = 76  # characters of titles that stand abreast


class Trajectories(ReportFigure):
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


def _way(ax: Axes, way: Floats, colour: str) -> None:
    ax.plot(*way.T, color=colour, lw=1.8, zorder=9)
    ax.plot(*way[0], "o", ms=5, mfc=PAPER, mec=colour, mew=1.4, zorder=10)
    ax.plot(*way[-1], "o", ms=5, color=colour, zorder=10)


def _heading(view: StudyView, line: Level, stop: Level) -> str:
    words = [level_name(view.line.name, line, short=True)] if view.line else []
    if view.over:
        words.append(f"{factor_name(view.over.name)} {level_name(view.over.name, stop)}")
    return ", ".join(words)
